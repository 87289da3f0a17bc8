"""What a clock without a unit counts, told by the size of its numbers: seconds since 1970, days since 1900 ..."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_FROM, _TO = 946_684_800.0, 4_102_444_800.0  # the years 2000 to 2100, in seconds since 1970
_DAY = 86_400.0
_DATE_NAMES = ("date", "datum", "fecha", "data", "timestamp", "time stamp", "datetime", "zeitstempel", "serial")


@dataclass(frozen=True, kw_only=True)
class Clock:
    """What a clock counts.

    Args:
        unit: The unit of its numbers.
        told: The unit and since when, for people.
        seconds: Of one count.
        low: Smallest count that it is taken for.
        high: Largest count that it is taken for.
        by_name: Whether the step must be small, or the name that of a date: plain seconds reach as far.
        names: What such a name has in it.
    """

    unit: str
    told: str
    seconds: float
    low: float
    high: float
    by_name: bool = False
    names: tuple[str, ...] = _DATE_NAMES


CLOCKS = (
    *(
        Clock(unit=unit, told=f"{unit} since 1970", seconds=scale, low=_FROM / scale, high=_TO / scale)
        for unit, scale in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
    ),
    *(
        Clock(
            unit="hns", told=f"steps of 100 ns since the year {year}, as {by} counts", seconds=1e-7, low=low, high=high
        )
        for year, by, low, high in ((1601, "Windows", 1.260e17, 1.577e17), (1, ".NET", 6.308e17, 6.625e17))
    ),
    Clock(unit="day", told="days since 1900, as Excel counts", seconds=_DAY, low=25_569.0, high=73_050.0, by_name=True),
    Clock(
        unit="day",
        told="days since year 0, as MATLAB counts",
        seconds=_DAY,
        low=719_529.0,
        high=767_010.0,
        by_name=True,
    ),
    Clock(
        unit="day",
        told="Julian days",
        seconds=_DAY,
        low=2_415_020.5,
        high=2_488_069.5,
        by_name=True,
        names=("jd", "julian"),
    ),
)
"""The clocks that are known by the size of their numbers."""


def clock_of(values: NDArray[np.float64], name: str, *, origin: int = 0) -> Clock | None:
    """The clock that a column without a unit is.

    Args:
        values: Shape ``(n,)``; NaN where there is no stamp.
        name: Name of the column.
        origin: What the values are counted from.

    Returns:
        The clock, or ``None`` if the numbers are not those of one.

    Example:
        >>> clock_of(np.array([1.7e12, 1.7e12 + 100.0]), "stamp").told
        'ms since 1970'
    """
    finite = np.isfinite(values)
    known = values if finite.all() else values[finite]
    if len(known) < 2:
        return None
    steps = np.diff(known[:10_000])
    rising = steps[steps > 0.0]
    if not len(rising):
        return None
    step, low, high = float(np.median(rising)), float(known.min()) + origin, float(known.max()) + origin
    for clock in CLOCKS:
        dated = any(word in name.casefold() for word in clock.names)
        possible = clock.low <= low and high <= clock.high and step * clock.seconds <= _DAY
        if possible and (not clock.by_name or dated or step * clock.seconds <= 2.0 or _is_in_days(step)):
            return clock
    return None


def since_1970(values: NDArray[np.float64]) -> bool:
    """Whether a column without a unit counts from 1970 on, by its size: no signal does.

    Args:
        values: Shape ``(n,)``; NaN where there is no stamp.

    Returns:
        Whether it does.

    Example:
        >>> since_1970(np.array([1.7e12, 1.7e12 + 100.0])), since_1970(np.array([0.0, 0.1]))
        (True, False)
    """
    clock = clock_of(values, "")
    return clock is not None and not clock.by_name


def _is_in_days(step: float) -> bool:
    """Whether a step is a whole number of seconds if it is in days, and no short number if it is not."""
    seconds = step * _DAY
    return abs(seconds - round(seconds)) < 1e-4 * seconds and abs(step - float(f"{step:.3g}")) > 1e-6 * step
