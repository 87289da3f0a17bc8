"""Calendar time to seconds since the first sample."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError


def seconds_since_first(
    cells: Sequence[str], pattern: str | None, *, lines: NDArray[np.int64], where: str
) -> NDArray[np.float64]:
    """Date and time as text to seconds since the first one.

    Args:
        cells: For example ``"2024-05-01 10:00:00.100"``; an empty one becomes NaN.
        pattern: As for ``datetime.strptime``; ``None`` is ISO 8601.
        lines: Line of each cell in the file.
        where: File and column, for errors.

    Returns:
        Shape ``(len(cells),)``.

    Raises:
        ReaderError: If a cell is not a date and time of that pattern, or some have a time zone and
            some have none.

    Example:
        >>> seconds_since_first(["2024-05-01 23:59:59", "2024-05-02 00:00:00.5"], None, lines=np.arange(2), where="a")
        array([0. , 1.5])
    """
    stamps: list[datetime | None] = []
    for line, cell in zip(lines, cells, strict=True):
        text = cell.strip()
        try:
            stamp = None if not text else datetime.fromisoformat(text) if pattern is None else _parse(text, pattern)
        except ValueError as error:
            raise ReaderError(
                "a cell is not a date and time",
                where=f"{where}, line {line}",
                expected="ISO 8601 (2024-05-01 10:00:00.100)" if pattern is None else pattern,
                got=repr(cell),
                remedy="give its pattern, for example time: {unit: datetime, format: '%d.%m.%Y %H:%M:%S.%f'}",
            ) from error
        stamps.append(stamp)
    first = next((stamp for stamp in stamps if stamp is not None), None)
    try:
        return np.array([np.nan if s is None or first is None else (s - first).total_seconds() for s in stamps])
    except TypeError as error:
        raise ReaderError(
            "some time stamps have a time zone and some have none",
            where=where,
            expected="a time zone on all or on none",
            got=error,
            remedy="export the time stamps in one form",
        ) from error


def _parse(text: str, pattern: str) -> datetime:
    # Without a zone in the pattern all stamps are taken as one clock: UTC has no summer time.
    stamp = datetime.strptime(text, pattern)
    return stamp if stamp.tzinfo is not None else stamp.replace(tzinfo=UTC)
