"""Times that stand in the digits of one number, 1359 for 13:59, or in two columns: seconds, and what is beyond them."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import is_called_time

_A_DAY = 86_400.0
_EVEN, _FEWEST, _FIRST = 0.95, 8, 8
_TOLD = "hours, minutes (and seconds) in its digits"
_BEYOND = re.compile(
    r"(?P<stem>.*?)(?:(?P<ns>nsecs?|nano(?:sec(?:ond)?s?)?|ns)|(?P<us>usecs?|micro(?:sec(?:ond)?s?)?|us)"
    r"|(?P<ms>msecs?|milli(?:sec(?:ond)?s?)?|ms))",
    re.IGNORECASE,
)
_PARTS_OF_A_SECOND = {"ns": 1e9, "us": 1e6, "ms": 1e3}
_WHOLE = re.compile(r"(?P<stem>.*?)(?:secs?|seconds?|s)", re.IGNORECASE)
_DATE_DIGITS = (19_000_101.0, 22_001_231.0)


def seconds_of_digits(values: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Seconds since midnight of numbers such as 1359 or 135930.

    Args:
        values: Shape ``(n,)``.

    Returns:
        Shape ``(n,)``; ``None`` where a number is no time of day.

    Example:
        >>> seconds_of_digits(np.array([135930.25])).tolist()
        [50370.25]
        >>> seconds_of_digits(np.array([5.0, 1359.0, 2400.0])).tolist(), seconds_of_digits(np.array([1375.0]))
        ([300.0, 50340.0, 86400.0], None)
    """
    if not len(values) or not np.isfinite(values).all() or values.min() < 0.0:
        return None
    largest = float(values.max())
    if largest <= 2400.0 and (values != np.rint(values)).any():
        return None  # only seconds have parts
    if largest > 240_000.0 or largest < 100.0:
        return None
    seconds = values % 100.0 if largest > 2400.0 else np.zeros(len(values))
    minutes = values // 100.0 if largest > 2400.0 else values
    if (seconds >= 60.0).any() or (minutes % 100.0 > 59.0).any():
        return None
    found: NDArray[np.float64] = minutes // 100.0 * 3600.0 + minutes % 100.0 * 60.0 + seconds
    return found


def time_of_digits(table: RawTable) -> RawTable:
    """A table whose clock stands in the digits of a number, or beside one in a column of parts of a second, as time.

    Args:
        table: From any reader.

    Returns:
        The table, with what was taken for its time among its notes; as it is where nothing shows such a clock.
    """
    own = next((column for column in table.columns if column.name == table.time), None)
    for found in (_with_parts_of_a_second(table, own), _of_day_and_digits(table, own), _of_digits(table, own)):
        if found is not None:
            return found
    return table


def _with_parts_of_a_second(table: RawTable, own: RawColumn | None) -> RawTable | None:
    """Whole seconds and a column of what is beyond them, as ROS, GNSS and PLCs write both."""
    for column in table.columns:
        match = None if column.problem is not None else _BEYOND.fullmatch(column.name.strip())
        if match is None or column is own:
            continue
        part = next(name for name in _PARTS_OF_A_SECOND if match[name])
        scale, values = _PARTS_OF_A_SECOND[part], column.values
        if not np.isfinite(values).all() or values.min() < 0.0 or values.max() >= scale or not np.ptp(values):
            continue
        dated = own is not None and (own.began is not None or table.settings.get("calendar"))
        seconds = own if dated else _whole_seconds(table, match["stem"])
        if seconds is None or not np.isfinite(seconds.values).all() or len(seconds.values) < 2:
            continue
        whole = seconds.values
        finer = whole - whole[0] + (values - values[0]) / scale
        # Of a clock that is as fine already nothing is told by another column.
        if (whole - whole[0] != np.rint(whole - whole[0])).any() or not (np.diff(finer) > 0.0).all():
            continue
        began = seconds.began and replace(seconds.began, micros=seconds.began.micros + round(1e6 * values[0] / scale))
        time = replace(seconds, values=finer, unit="s", began=began)
        kept = tuple(time if c is seconds else c for c in table.columns if c is not column)
        told = f"time is {seconds.name} and {column.name} together"
        return replace(table, columns=kept, time=time.name, step=None, notes=(*table.notes, told))
    return None


def _whole_seconds(table: RawTable, stem: str) -> RawColumn | None:
    for column in table.columns:
        match = _WHOLE.fullmatch(column.name.strip())
        if match is not None and match["stem"] == stem and column.problem is None and column.unit in {None, "s"}:
            return column
    return None


def _of_day_and_digits(table: RawTable, own: RawColumn | None) -> RawTable | None:
    """Dates without a time of day, text or eight digits, and the time of day in the digits of the next column."""
    if own is not None and own.began is None and is_called_time(own.name) and _days_of_digits(own) is None:
        digits = seconds_of_digits(own.values)
        if digits is None:
            return None
    for date, column in zip(table.columns, table.columns[1:], strict=False):
        seconds = None if date.problem or column.problem else seconds_of_digits(column.values)
        days = None if seconds is None else _days(date)
        if days is None or seconds is None or own not in {None, date, column}:
            continue
        stamps = days * _A_DAY + seconds
        stamps = stamps - stamps[0]
        if not _is_even(stamps) or _is_even(days * _A_DAY):
            continue
        began = date.began and replace(date.began, micros=date.began.micros + round(1e6 * float(seconds[0])))
        # Dates of text are asked for by their own name; of those of digits nothing else says that they are time.
        name = "time" if date.began is None else date.name
        if name in set(table.names) - {date.name, column.name}:
            return None
        time = RawColumn(name=name, values=stamps, unit="s", began=began)
        kept = (time, *(c for c in table.columns if c is not date and c is not column))
        told = f"time is {date.name} and {column.name} together, {_TOLD}"
        return replace(table, columns=kept, time=name, step=None, notes=(*table.notes, told))
    return None


def _days(column: RawColumn) -> NDArray[np.float64] | None:
    if column.began is None:
        return _days_of_digits(column)
    days = column.values / _A_DAY
    return days if np.isfinite(days).all() and (days == np.rint(days)).all() else None


def _days_of_digits(column: RawColumn) -> NDArray[np.float64] | None:
    """Days since 1970 of numbers such as 20240312."""
    values, (low, high) = column.values, _DATE_DIGITS
    if not len(values) or not ((values >= low) & (values <= high)).all() or (values != np.rint(values)).any():
        return None
    year, month, day = values // 10_000.0, values // 100.0 % 100.0, values % 100.0
    if (month < 1.0).any() or (month > 12.0).any() or (day < 1.0).any() or (day > 31.0).any():
        return None
    months = (12 * (year.astype(np.int64) - 1970) + month.astype(np.int64) - 1).astype("datetime64[M]")
    return months.astype("datetime64[D]").astype(np.int64) + day - 1.0


def _of_digits(table: RawTable, own: RawColumn | None) -> RawTable | None:
    """A column alone whose digits, read as hours and minutes, go on evenly, which the numbers themselves do not."""
    for column in table.columns[:_FIRST] if own is None else (own,):
        if column.problem is not None or column.began is not None or column.unit is not None:
            continue
        seconds = seconds_of_digits(column.values) if len(column.values) >= _FEWEST else None
        if seconds is None:
            continue
        passed = np.concatenate([[0.0], np.cumsum(np.diff(seconds) < -0.5 * _A_DAY)])
        stamps = seconds + _A_DAY * passed
        if not _is_even(stamps) or _is_even(column.values):
            continue
        time = replace(column, values=stamps - stamps[0], unit="s")
        columns = tuple(time if c is column else c for c in table.columns)
        told = f"{column.name} has {_TOLD}, which is a guess: they go on evenly then"
        return replace(table, columns=columns, time=column.name, step=None, notes=(*table.notes, told))
    return None


def _is_even(stamps: NDArray[np.float64]) -> bool:
    steps = np.diff(stamps)
    if not len(steps) or not (steps > 0.0).all():
        return False
    usual = float(np.median(steps))
    return float(np.mean(np.abs(steps - usual) <= 1e-6 * usual)) >= _EVEN
