"""What the time stamps of a record look like: step, gaps, jitter, order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        gaps: Indices ``i`` for which samples are missing between ``i`` and ``i + 1``.
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
    steps = np.diff(stamps)
    highest = np.maximum.accumulate(stamps)
    backward = np.flatnonzero(stamps[1:] < highest[:-1]) + 1
    duplicates = np.flatnonzero(steps == 0.0) + 1
    rising = np.delete(stamps, np.concatenate([backward, duplicates]))
    steps = np.diff(rising)
    kept = np.delete(np.arange(len(stamps)), np.concatenate([backward, duplicates]))
    if len(steps) == 0:
        median, slope, jitter, slots, is_gap = np.nan, np.nan, 0.0, np.zeros(1), np.zeros(0, dtype=bool)
    else:
        median = float(np.median(steps))
        limit = _GAP_FACTOR * median if longest_step is None else longest_step
        is_gap = steps > limit * (1.0 + 1e-9)
        # Outside gaps every step is one slot, however uneven: only a gap lacks samples.
        slots = np.concatenate([[0.0], np.cumsum(np.where(is_gap, np.maximum(np.rint(steps / median), 1.0), 1.0))])
        slope, jitter = _line(slots, rising)
    return Timing(
        samples=len(stamps),
        first=float(stamps[0]),
        last=float(stamps[-1]),
        step=slope,
        median_step=median,
        jitter=jitter,
        gaps=kept[:-1][is_gap],
        missing=int(slots[-1]) - len(steps),
        duplicates=duplicates,
        backward=backward,
    )


def _line(slots: NDArray[np.float64], stamps: NDArray[np.float64]) -> tuple[float, float]:
    """Slope of the least-squares line through the stamps, and the largest distance from it."""
    x, y = slots - slots.mean(), stamps - stamps.mean()
    slope = float(x @ y / (x @ x))
    return slope, float(np.abs(y - slope * x).max())


def round_step(step: float, *, samples: int, even: bool) -> float:
    """A measured step as a person would write it.

    Args:
        step: Seconds between samples, as fitted.
        samples: How many samples it was fitted over.
        even: Whether the stamps are even. If so, the result keeps the last stamp within a thousandth
            of a step of its place; if not (they will be resampled) it is within 0.5 % of the step.

    Returns:
        The number of fewest digits that does so.

    Example:
        >>> round_step(0.10029, samples=1500, even=False), round_step(1 / 120, samples=100, even=True)
        (0.1, 0.0083333)
    """
    tolerance = 1e-3 / samples if even else 5e-3
    for digits in range(1, 15):
        rounded = float(f"{step:.{digits}g}")
        if abs(rounded - step) <= tolerance * step:
            return rounded
    return step
