"""Dates of three numbers: which of them is the year, which the month and which the day."""

from __future__ import annotations

from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.zones import guess_zone, utc_microseconds

DAY = 86_400_000_000
"""Microseconds of a day."""


def full_year(year: int) -> int:
    """A year of four digits.

    Args:
        year: As it was written; of two digits it is from 1970 to 2069.

    Returns:
        The year.
    """
    return year if year > 99 else year + (2000 if year < 70 else 1900)


_ORDERS = {"year-month-day": (0, 1, 2), "day-month-year": (2, 1, 0), "month-day-year": (2, 0, 1)}


def days_of(dates: NDArray[np.int64], micros: NDArray[np.int64], where: str) -> tuple[NDArray[np.int64], list[str]]:
    """Days since 1970 of dates of three numbers, in the order of them that can be.

    Args:
        dates: Each as one number, ``100,000,000 a + 10,000 b + c``, shape ``(n_samples,)``.
        micros: Microseconds since midnight, shape ``(n_samples,)``.
        where: What the dates are of, for errors.

    Returns:
        The days, shape ``(n_samples,)``, and what is said of a guess.

    Raises:
        ReaderError: If no order can be.
    """
    codes, places = np.unique(dates, return_inverse=True)
    parts = [codes // 100_000_000, codes // 10_000 % 10_000, codes % 10_000]
    possible: dict[str, NDArray[np.int64]] = {}
    for name, order in _ORDERS.items():
        year, month, day = (parts[index] for index in order)
        if ((parts[0] > 31) != (order[0] == 0)).any() or (month > 12).any() or (day > 31).any() or (day < 1).any():
            continue
        found = _since_1970(year, month, day)
        if found is not None:
            possible[name] = found[places]
    if not possible:
        raise ReaderError(
            "a date cannot be told",
            where=where,
            expected="year-month-day, day.month.year or month/day/year, one of them throughout",
            got=f"{parts[0][0]}, {parts[1][0]}, {parts[2][0]} and others",
            remedy="give its pattern, for example time: {unit: datetime, format: '%d.%m.%Y %H:%M:%S'}",
        )
    if len(possible) == 1:
        return next(iter(possible.values())), []

    def unevenness(days: NDArray[np.int64]) -> tuple[int, int]:
        steps = np.diff(days * DAY + micros)
        return int((steps <= 0).sum()), int(steps.max(initial=0))

    best = min(possible, key=lambda name: unevenness(possible[name]))
    if unevenness(possible[best])[0] or len({*map(unevenness, possible.values())}) == 1:
        # A clock that is changed may tell the date: the night on which it was put back, or on.
        best = next((name for name, days in possible.items() if guess_zone(days * DAY + micros)), best)
    differ = len(codes) > 1
    return possible[best], [f"dates taken as {best}, which is a guess: time.format says it"] if differ else []


def _since_1970(year: NDArray[np.int64], month: NDArray[np.int64], day: NDArray[np.int64]) -> NDArray[np.int64] | None:
    days = []
    for y, m, d in zip(year.tolist(), month.tolist(), day.tolist(), strict=True):
        try:
            days.append(utc_microseconds(datetime(full_year(y), m, d)) // DAY)
        except ValueError:
            return None
    return np.array(days, dtype=np.int64)
