"""Which column of a file is its time, by what it is called and by its unit."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from sysid.errors import UnitError
from sysid.ingest.tables.columns import RawColumn
from sysid.units import check_unit, convert
from sysid.written_units import USUAL_UNITS, plain_unit

_TIME_NAMES = {
    "t", "time", "zeit", "tijd", "temps", "tiempo", "tempo", "tid", "timestamp", "timestamps", "time stamp",
    "elapsed time", "elapsed", "seconds", "tout", "date", "datum", "datetime", "date time", "date/time", "date & time",
    "uhrzeit", "zeitstempel", "tijdstip", "clock", "hora", "heure", "fecha", "epoch", "unix time", "unixtime", "utc",
    "local time", "localtime", "time of day", "timeofday", "test time", "run time", "sim time", "simulation time",
    "total time", "relative time", "cumulative time", "absolute time", "rel time",
    "record time", "recording time", "measurement time", "system time",
    "unix timestamp", "timestring", "time string", "millis", "micros",
    "время", "дата", "дата/время", "дата и время", "czas", "čas", "tarih", "zaman", "idő", "aika",
    "时间", "日期", "时间戳", "日期时间", "時間", "時刻", "日時", "日付", "시간", "시각", "날짜", "일시",
}  # fmt: skip
_TIME_UNITS = {"s", "ms", "us", "µs", "ns", "hns", "ds", "min", "h", "second", "millisecond", "minute", "hour", "day"}

_SPELT = {"millis": "ms", "micros": "us", "nanos": "ns", "day": "day", "days": "day", "d": "day"}
_WORDS_IN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[^\W\d_A-Z]+")

_COUNTED = r"id|idx|index|row|line|zeile|sample|frame|scan|record|point|data[ _]?point|step|messung"
_COUNTER = re.compile(
    rf"(?:(?:lfd\.?|{_COUNTED})s?[ _.]*)?(?:#|no\.?|nr\.?|num|number|index|id|count(?:er)?)|n|k|i|{_COUNTED}",
    re.IGNORECASE,
)

MOSTLY = 0.8
"""Part of a column that may be missing; of what has more nothing is proposed."""

_FALLS = 0.1
_NAMELESS = re.compile(r"column_\d+")

_ON = 3.0  # usual steps, within which a clock runs on
GOES_BACK = 0.25
"""Part of the steps that lead back, from which on a column moves as a signal does; stamps that do are out of order."""


def recognise_time(columns: Sequence[RawColumn]) -> str | None:
    """The column that holds time, by its name, else by its unit.

    A signal may be called ``t``, too, as a temperature is: what goes back and forth gives way to what does not, and
    with a unit of something else it is no time at all.

    Args:
        columns: The columns of a file.

    Returns:
        Its name, or ``None`` if no column is plainly one.
    """
    named = [column for column in columns if is_called_time(column.name) and not _is_mostly_blank(column)]
    # A capital T may be a temperature: only where nothing else is called time, and it rises.
    plain = [column for column in named if re.split(r"[/.]", column.name.strip())[-1] != "T"]
    clocks = [column for column in named if _may_be_clock(column)]
    timed = [column for column in columns if column.unit is not None and time_unit(column.unit) in _TIME_UNITS]
    # How long a day is, or it rained, is in a unit of time too: by its unit alone is known what goes on like a clock.
    timed = [column for column in timed if column in named or _goes_on(column)]
    likely = [*plain, *clocks, *timed]
    back = {one.name for one in likely if _goes_back(one) or (_has_other_unit(one) and not _goes_on(one))}
    forward = [column for column in likely if column.name not in back]
    found = next((going_on_beside(one, forward) or one for one in forward), None) or next(
        (column for column in likely if not _has_other_unit(column)), None
    )
    return None if found is None else found.name


def _goes_back(column: RawColumn) -> bool:
    steps = np.diff(column.values)
    return bool(len(steps)) and float(np.mean(steps < 0.0)) > GOES_BACK


def going_on_beside(clock: RawColumn, others: Sequence[RawColumn]) -> RawColumn | None:
    """The clock of the whole record beside one of its parts, as cyclers of batteries write both.

    Args:
        clock: Which may begin anew, with each step of a program.
        others: Of which one may run on there, as it does from sample to sample.

    Returns:
        The other; ``None`` where the clock itself runs on, or all of them stop where it begins anew, as between
        records.
    """
    anew = np.flatnonzero(np.diff(clock.values) < 0.0)
    for other in others if len(anew) else ():
        steps = np.diff(other.values) if len(other.values) == len(clock.values) else np.empty(0)
        if other is clock or not len(steps) or not np.isfinite(steps).all() or steps.min() < 0.0:
            continue
        usual = float(np.median(steps))
        if usual > 0.0 and float(np.median(steps[anew])) <= _ON * usual:
            return other
    return None


def _goes_on(column: RawColumn) -> bool:
    """Whether what changes rises, but where a record begins anew; of a column without values nothing is known."""
    if not len(column.values):
        return True
    steps = np.diff(column.values[np.isfinite(column.values)])
    rises, falls = int((steps > 0.0).sum()), int((steps < 0.0).sum())
    return not _is_mostly_blank(column) and rises > 0 and falls <= _FALLS * (rises + falls)


def _is_mostly_blank(column: RawColumn) -> bool:
    """Whether nearly all of a column of numbers is missing: as a clock it would take the samples of all others."""
    if column.problem is not None or column.words is not None or not len(column.values):
        return False
    return float(np.mean(np.isnan(column.values))) > MOSTLY


def _has_other_unit(column: RawColumn) -> bool:
    """Whether a unit is known, and is none of time."""
    if column.unit is None or is_time_unit(column.unit):
        return False
    try:
        check_unit(column.unit)
    except UnitError:
        return False
    return True


def _may_be_clock(column: RawColumn) -> bool:
    if column.unit is not None and time_unit(column.unit) not in _TIME_UNITS:
        return False
    rises = column.values[1:] > column.values[:-1]
    return not len(rises) or bool(rises.mean() > 0.9)


def is_called_time(name: str) -> bool:
    """Whether a column is called time, by itself or in whatever group it stands.

    Args:
        name: Its name without the unit.

    Returns:
        Whether it is.

    Example:
        >>> is_called_time("rig/Time"), is_called_time("t_ms"), is_called_time("test_time_second")
        (True, True, True)
        >>> is_called_time("temperature"), is_called_time("dead_time")
        (False, False)
    """
    whole = name.casefold().strip().lstrip("_")
    # In whatever group it stands: "rig/time", "run{2}.t".
    for plain in (whole, re.split(r"[/.]", whole)[-1]):
        # "t_ms", "time.s", "test_time_seconds": the unit at the end of the name
        ends = [u for one in _TIME_UNITS for u in (one, f"{one}s")]
        stem = next((plain[: -len(u) - 1] for u in ends if plain.endswith((f"_{u}", f".{u}"))), plain)
        if {plain, stem, plain.replace("_", " "), stem.replace("_", " ")} & _TIME_NAMES:
            return True
    return False


def unit_of_clock(name: str) -> str | None:
    """The unit of time that the name of a clock is, or ends with.

    Args:
        name: Of the column of time.

    Returns:
        The unit; ``None`` where the name says none.

    Example:
        >>> [unit_of_clock(name) for name in ("hours", "ElapsedMillis", "time_h", "Zeit Minuten", "t", "heights")]
        ['hour', 'ms', 'h', 'min', None, None]
    """
    words = _WORDS_IN.findall(name)
    if not words or (len(words[-1]) == 1 and not is_called_time(name)):
        return None
    last = words[-1].casefold()
    unit = _SPELT.get(last) or time_unit(last)
    return unit if unit in _TIME_UNITS and (len(words) > 1 or len(last) > 1) else None


def is_nameless(name: str) -> bool:
    """Whether a column has no name in its file, and was given a number.

    Args:
        name: Its name.

    Returns:
        Whether it has none.
    """
    return _NAMELESS.fullmatch(name) is not None


def is_counter(name: str) -> bool:
    """Whether a column is called a number of rows.

    Args:
        name: Its name.

    Returns:
        Whether it is.
    """
    return _COUNTER.fullmatch(name.strip()) is not None


def is_time_unit(unit: str) -> bool:
    """Whether a unit is one of time.

    Args:
        unit: As found in a file.

    Returns:
        True if it is.
    """
    if time_unit(unit) in _TIME_UNITS:
        return True
    if unit in USUAL_UNITS:  # those of time are above
        return False
    try:
        convert(np.zeros(1), unit, "s")
    except UnitError:
        return False
    return True


def time_unit(unit: str) -> str:
    """A unit of time as pint writes it: in capitals, as loggers have it, it is another one to pint.

    Args:
        unit: For example ``"S"``, ``"MS"``, ``"ms"``.

    Returns:
        For example ``"s"``, ``"ms"``, ``"ms"``.
    """
    if unit in USUAL_UNITS:
        return unit
    plain = plain_unit(unit.casefold()) or unit
    return plain if plain in _TIME_UNITS else unit
