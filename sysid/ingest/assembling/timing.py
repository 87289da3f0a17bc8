"""What the time stamps of a record look like: step, gaps, jitter, order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.assembling.grid import grid_places

_MOST_SLOTS = 1e18  # of one gap: a stamp that is nonsense shall not overflow
_PIECE = 1 << 16
_A_DAY, _AN_HOUR, _LONGEST_OF_HOURS = 86_400.0, 3600.0, 1e6
_FEW = 0.25  # of the samples, that may be missing for stamps to be asked whether they are uneven instead
_FEWEST_ROUNDED = 16  # stamps that tell a rounded clock from an uneven one
_GAP_FACTOR = 1.5  # a step this many times the usual one means that a sample is missing


@dataclass(frozen=True, kw_only=True, eq=False)
class Timing:
    """A survey of time stamps.

    Args:
        samples: How many.
        first: First stamp in seconds.
        last: Last stamp in seconds.
        step: Seconds between samples: the slope of the line through the stamps, gaps counted with
            the samples that they lack. NaN if there are fewer than two different stamps.
        median_step: Median of the rising steps.
        jitter: Largest distance of a stamp from that line, in seconds.
        gaps: Indices of the samples after which some are missing.
        missing: How many samples are missing in all.
        duplicates: Indices of samples with the stamp of the one before.
        backward: Indices of samples whose stamp is before an earlier one's.
    """

    samples: int
    first: float
    last: float
    step: float
    median_step: float
    jitter: float
    gaps: NDArray[np.intp]
    missing: int
    duplicates: NDArray[np.intp]
    backward: NDArray[np.intp]

    @property
    def in_order(self) -> bool:
        """Whether each stamp is later than the one before."""
        return len(self.duplicates) == 0 and len(self.backward) == 0


def survey(stamps: NDArray[np.float64], *, longest_step: float | None = None) -> Timing:
    """Survey time stamps, in whatever order they are.

    Args:
        stamps: Shape ``(n,)``, seconds, finite, ``n >= 1``.
        longest_step: Seconds above which a step is a gap; ``None`` is one and a half times the median.

    Returns:
        The survey.

    Example:
        >>> timing = survey(np.array([0.0, 0.1, 0.2, 0.5, 0.6]))
        >>> round(timing.step, 6), timing.gaps.tolist(), timing.missing
        (0.1, [2], 2)
    """
    none, missing = np.zeros(0, dtype=np.intp), 0
    steps = np.diff(stamps)
    if len(steps) and steps.min() > 0.0:  # in order, as nearly all records are
        backward = duplicates = none
        kept, rising = None, stamps
    else:
        highest = np.maximum.accumulate(stamps)
        backward = np.flatnonzero(stamps[1:] < highest[:-1]) + 1
        duplicates = np.flatnonzero(steps == 0.0) + 1
        kept = np.flatnonzero(np.concatenate([[True], stamps[1:] > highest[:-1]]))
        rising = stamps[kept]
        steps = np.diff(rising)
    if len(steps) == 0:
        median, slope, jitter, is_gap = np.nan, np.nan, 0.0, np.zeros(0, dtype=bool)
    else:
        longest = float(steps.max())
        # In place: a copy of some ten millions of steps takes longer than all else here.
        median = float(np.median(steps, overwrite_input=True))
        limit = (_GAP_FACTOR * median if longest_step is None else longest_step) * (1.0 + 1e-9)
        slots, is_gap = None, np.zeros(0, dtype=bool)
        if longest > limit:
            steps = np.diff(rising)
            is_gap = steps > limit
            # Outside gaps every step is one slot, however uneven: only a gap lacks samples.
            slots = np.zeros(len(rising))
            slots[1:] = np.cumsum(np.where(is_gap, np.clip(np.rint(steps / median), 1.0, _MOST_SLOTS), 1.0))
            missing = int(slots[-1]) - (len(rising) - 1)
        del steps
        slope, jitter = _line(slots, rising)
        if slots is not None and longest_step is None and missing < _FEW * len(rising):
            # Stamps that are uneven by half a step look like gaps: where every sample is there, they are on a line.
            even, off = _line(None, rising)
            if off < 0.5 * min(jitter, even):
                slope, jitter, missing, is_gap = even, off, 0, np.zeros(0, dtype=bool)
    return Timing(
        samples=len(stamps),
        first=float(stamps[0]),
        last=float(stamps[-1]),
        step=slope,
        median_step=median,
        jitter=jitter,
        gaps=np.flatnonzero(is_gap) if kept is None else kept[:-1][is_gap],
        missing=missing,
        duplicates=duplicates,
        backward=backward,
    )


def _line(slots: NDArray[np.float64] | None, stamps: NDArray[np.float64]) -> tuple[float, float]:
    """Slope of the least-squares line through the stamps, and the largest distance from it; one slot each by default.

    Piece by piece: whole arrays of some ten millions of stamps would be the most that a reader needs.
    """
    n = len(stamps)
    middle, mean = (n - 1) / 2.0 if slots is None else float(slots.mean()), float(stamps.mean())

    def pieces() -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        for first in range(0, n, _PIECE):
            end = min(first + _PIECE, n)
            x = np.arange(first, end, dtype=np.float64) if slots is None else slots[first:end]
            yield x - middle, stamps[first:end] - mean

    sums = np.sum([(x @ y, x @ x) for x, y in pieces()], axis=0)
    slope = float(sums[0] / sums[1])
    return slope, float(max(np.abs(y - slope * x).max() for x, y in pieces()))


def round_step(step: float) -> float:
    """A measured step as a person would write it.

    Args:
        step: Seconds between samples, as fitted.

    Returns:
        The number of fewest digits that is within 0.5 % of it; from an hour to some days, whole days or hours.

    Example:
        >>> round_step(0.10029), round_step(1 / 120), round_step(86_395.0)
        (0.1, 0.0083, 86400.0)
    """
    for unit in (_A_DAY, _AN_HOUR) if step <= _LONGEST_OF_HOURS else ():
        whole = unit * round(step / unit)
        if whole and abs(whole - step) <= 5e-3 * step:
            return whole
    return next((value for value in _by_digits(step) if abs(value - step) <= 5e-3 * abs(step)), step)


def even_step(stamps: NDArray[np.float64], timing: Timing, *, tolerance: float) -> float | None:
    """The sample time of a grid that all stamps lie on, gaps apart.

    Args:
        stamps: Shape ``(n,)``, rising, seconds.
        timing: Their survey.
        tolerance: How far off a stamp may lie, as a fraction of the sample time.

    Returns:
        The number of fewest digits that is one, or ``None`` if there is none.

    Example:
        >>> stamps = np.array([0.0, 1 / 120, 2 / 120, 5 / 120])
        >>> even_step(stamps, survey(stamps), tolerance=0.01)
        0.00833
    """
    if not timing.step > 0.0:
        return None
    for value in _by_digits(timing.step):
        places = grid_places(stamps, value, start=float(stamps[0]), tolerance=tolerance) if value > 0.0 else None
        if places is not None and int(np.sum(np.diff(places) > 1)) == len(timing.gaps):
            return value
    return None


def rounded_step(stamps: NDArray[np.float64], timing: Timing) -> tuple[float, float] | None:
    """The sample time of an even clock whose stamps were rounded when they were written: 30 in a second, to 0.01 s.

    Between neighbours there are then two steps only, one unit of the last digit apart, and no stamp is further off an
    even clock than that unit: nothing has to be interpolated.

    Args:
        stamps: Shape ``(n,)``, rising, seconds.
        timing: Their survey.

    Returns:
        The sample time, as a period or a rate of few digits; and how far off the grid of the first stamp the others
        may lie, as a fraction of it. ``None`` if the clock is not such a one.

    Example:
        >>> stamps = np.round(np.arange(60) / 30, 2)
        >>> rounded_step(stamps, survey(stamps))
        (0.03333333333333333, 0.31)
    """
    if len(stamps) < _FEWEST_ROUNDED or not timing.step > 0.0:
        return None
    slots = np.rint((stamps - stamps[0]) / timing.step)
    apart = np.diff(slots)
    steps = np.sort(np.diff(stamps)[apart == 1.0])
    if apart.min() < 1.0 or len(steps) < 2 or int(np.sum(apart > 1.0)) != len(timing.gaps):
        return None
    fuzz = max(1e-6 * timing.step, 8.0 * float(np.spacing(np.abs(stamps).max())))
    rises = np.diff(steps)
    unit = float(steps[-1] - steps[0])
    if int(np.sum(rises > fuzz)) != 1 or rises.max() < unit - fuzz or not fuzz < unit < 0.5 * timing.step:
        return None
    found = [(len(f"{value:.15g}".strip("0.")), rate, value) for value, rate in _periods_and_rates(timing.step)]
    for _, rate, value in sorted(found):
        step = 1.0 / value if rate else value
        if np.ptp(stamps - step * slots) <= unit * (1.0 + 1e-3) + fuzz:
            return step, float(np.ceil(100.0 * (unit + fuzz) / step) / 100.0)
    return None


def roundest(low: float, high: float) -> float:
    """The sample time of fewest digits between two, as a period or as a rate.

    Args:
        low: Least, in seconds.
        high: Most.

    Returns:
        Seconds.

    Example:
        >>> roundest(0.0332, 0.03335), roundest(0.1349, 0.1351)
        (0.03333333333333333, 0.135)
    """
    middle = 0.5 * (low + high)
    found = [(len(f"{value:.15g}".strip("0.")), rate, value) for value, rate in _periods_and_rates(middle)]
    steps = (1.0 / value if rate else value for _, rate, value in sorted(found))
    return next((step for step in steps if low <= step <= high), middle)


def _periods_and_rates(step: float) -> list[tuple[float, bool]]:
    return [(value, False) for value in _by_digits(step)] + [(value, True) for value in _by_digits(1.0 / step)]


def _by_digits(step: float) -> list[float]:
    return [float(f"{step:.{digits}g}") for digits in range(1, 17)]
