"""Dates in columns of their own, year, month, day, hour, as weather stations and hydrologists write them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.cells.began import Began
from sysid.ingest.tables.clock_digits import seconds_of_digits
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import is_called_time, is_nameless

_CALLED = {
    "year": ("year", "yyyy", "YY", "yr", "Yr", "jahr", "année", "año", "anno", "ano", "jaar"),
    "month": ("month", "MM", "mon", "mo", "mnth", "mth", "monat", "mois", "mes", "mese", "maand"),
    "day": ("day", "DD", "dd", "dy", "Dy", "tag", "jour", "día", "dia", "giorno", "dag"),
    "of_year": ("doy", "jday", "dayofyear", "day_of_year", "day of year", "julian day", "yday"),
    "hour": ("hour", "hh", "hr", "Hr", "HH", "hrs", "stunde", "heure", "hora", "ora", "uur"),
    "minute": ("minute", "mm", "min", "mn"),
    "second": ("second", "ss", "sec", "seconds", "sekunde"),
    "digits": (
        "hhmm",
        "hhmmss",
        "hrmn",
        "time",
        "lst",
        "utc",
        "gmt",
        "mst",
        "cst",
        "est",
        "pst",
        "lst_time",
        "utc_time",
    ),
}
"""Names of each part; those of two letters as they are written, as MM is a month where mm are minutes."""
_LEAST = {"year": 1900.0, "month": 1.0, "day": 1.0, "of_year": 1.0, "hour": 0.0, "minute": 0.0, "second": 0.0}
_MOST = {"year": 2200.0, "month": 12.0, "day": 31.0, "of_year": 366.0, "hour": 24.0, "minute": 60.0, "second": 60.0}
_SECONDS = {"hour": 3600.0, "minute": 60.0, "second": 1.0}
_CALENDARS = (
    ("year", "of_year", "month", "day", "hour", "minute"),
    ("year", "month", "day", "hour", "minute", "second"),
    ("year", "month", "day", "hour", "minute"),
    ("year", "month", "day", "hour"),
    ("year", "month", "day", "digits"),
    ("year", "of_year", "hour", "minute"),
    ("year", "of_year", "digits"),
    ("year", "of_year", "hour"),
    ("year", "month", "day"),
    ("month", "day", "hour", "minute"),
    ("month", "day", "hour"),
)
"""What columns beside one another may be, that nobody named; the longest first."""
_EVEN, _VARY, _HALF_A_YEAR = 0.5, 2, 183.0
_A_DAY = 86_400.0


def time_of_parts(table: RawTable) -> RawTable:
    """A table whose columns of a year, a month, a day (or a day of the year), hours and so on are one column of time.

    Columns without names are such where their numbers, read as dates, go on evenly. Of a year that is put together of
    months of several years, or that says no year, the months and days are.

    Args:
        table: From any reader.

    Returns:
        The table; as it is where it has another time, or these columns are no dates that go on. Beside a column of
        dates they are no channels.
    """
    own = next((column for column in table.columns if column.name == table.time), None)
    if own is not None and own.began is not None:
        return _said_twice(table, own)
    for parts in (_parts(table), *_beside_one_another(table)):
        # A column that is known for a clock by its unit alone may be anything that lasts.
        if own is not None and is_called_time(own.name) and own not in parts.values():
            continue
        named = not any(is_nameless(column.name) for column in parts.values())
        found = _put_together(table, parts, named=named)
        if found is not None:
            return found
    return table


def _put_together(table: RawTable, parts: Mapping[str, RawColumn], *, named: bool) -> RawTable | None:
    """The table with one column of time; ``None`` where the parts are no dates that go on."""
    if not ("of_year" in parts or {"month", "day"} <= set(parts)) or "time" in set(table.names) - {
        column.name for column in parts.values()
    }:
        return None
    if any(not _fits(column.values, part) for part, column in parts.items()):
        return None
    values = {part: column.values for part, column in parts.items()}
    used = ", ".join(column.name for column in parts.values())
    told = f"time is {used} together" + ("" if named else ", which is a guess: they go on as dates do")
    if "year" in values:
        date, clock = _seconds(values)
        stamps = (date - date[0]) * _A_DAY + clock - clock[0]
        if len(stamps) > 1 and (_goes_on(stamps) if named else _goes_on_evenly(stamps, parts)):
            began = Began(micros=round((float(date[0]) * _A_DAY + float(clock[0])) * 1e6))
            return _with_time(table, parts, stamps, began, told)
    if not {"hour", "digits"} & set(parts):
        return None
    date, clock = _seconds({**values, "year": _any_years(values)})
    stamps = (date - date[0]) * _A_DAY + clock - clock[0]
    if not _goes_on_evenly(stamps, parts):
        return None
    years = values.get("year")
    why = "no year is said" if years is None else f"years, {years.min():g} to {years.max():g}, do not go on"
    return _with_time(table, parts, stamps, None, f"{told}; {why}: only how far apart they are counts")


def _with_time(
    table: RawTable, parts: Mapping[str, RawColumn], stamps: NDArray[np.float64], began: Began | None, told: str
) -> RawTable:
    time = RawColumn(name="time", values=stamps, unit="s", began=began)
    used = {column.name for column in parts.values()}
    others = tuple(column for column in table.columns if column.name not in used)
    return replace(table, columns=(time, *others), time="time", step=None, notes=(*table.notes, told))


def _said_twice(table: RawTable, own: RawColumn) -> RawTable:
    """Parts of dates beside the dates themselves are no channels, where both go on alike."""
    parts = {part: column for part, column in _parts(table).items() if column is not own}
    if not ("of_year" in parts or {"month", "day"} <= set(parts)) or "year" not in parts:
        return table
    if any(not _fits(column.values, part) for part, column in parts.items()) or not np.isfinite(own.values).all():
        return table
    date, clock = _seconds({part: column.values for part, column in parts.items()})
    if np.ptp(date * _A_DAY + clock - own.values) > _A_DAY:
        return table
    beside = {column.name for column in parts.values()}
    columns = (replace(c, aside=f"a part of {own.name}") if c.name in beside else c for c in table.columns)
    return replace(table, columns=tuple(columns))


def _parts(table: RawTable) -> dict[str, RawColumn]:
    found = dict[str, RawColumn]()
    for part, names in _CALLED.items():
        exact = {name for name in names if len(name) == 2}
        for column in table.columns:
            name = column.name.strip().lstrip("#").strip()
            if (name in exact or (len(name) != 2 and name.casefold() in names)) and column.problem is None:
                found.setdefault(part, column)
    # The min beside a max is no minute: each part needs the one before it.
    for part, before in (("minute", "hour"), ("second", "minute")):
        if before not in found:
            found.pop(part, None)
    # Hours and minutes in one number; a time that counts otherwise is another column.
    if "digits" in found and ("hour" in found or not _fits(found["digits"].values, "digits")):
        del found["digits"]
    return found


def _beside_one_another(table: RawTable) -> Iterator[Mapping[str, RawColumn]]:
    """Columns without names, beside one another, whose numbers may be those of dates."""
    columns = table.columns
    for start, first in enumerate(columns):
        if not is_nameless(first.name) or first.problem is not None:
            continue
        # Without a year months have to go on, as what counts to 12 is common.
        begins = [part for part in ("year", "month") if _fits(first.values, part)]
        begins = [part for part in begins if part == "year" or np.ptp(first.values) > 0.0]
        for calendar in (one for one in _CALENDARS if one[0] in begins):
            run = columns[start : start + len(calendar)]
            if len(run) == len(calendar) and all(is_nameless(c.name) and c.problem is None for c in run):
                yield dict(zip(calendar, run, strict=True))


def _fits(values: NDArray[np.float64], part: str) -> bool:
    if part == "digits":
        return seconds_of_digits(values) is not None
    head = values[:64]
    if not len(head) or not ((head >= _LEAST[part]) & (head <= _MOST[part])).all():
        return False
    whole = part in {"hour", "second"} or bool((values == np.rint(values)).all())
    return whole and bool(
        np.isfinite(values).all() and (values >= _LEAST[part]).all() and (values <= _MOST[part]).all()
    )


def _goes_on(stamps: NDArray[np.float64]) -> bool:
    return not bool((np.diff(stamps) < 0.0).any())


def _goes_on_evenly(stamps: NDArray[np.float64], parts: Mapping[str, RawColumn]) -> bool:
    """Whether stamps rise by one and the same step mostly, in more than one of their parts."""
    steps = np.diff(stamps)
    if not len(steps) or not (steps > 0.0).all():
        return False
    varying = sum(bool(np.ptp(column.values)) for column in parts.values())
    # Hours and minutes in one number are two parts, where it does not just count.
    varying += "digits" in parts and len(np.unique(np.diff(parts["digits"].values))) > 1
    usual = float(np.median(steps))
    slots = steps / usual
    # A signal in the place of minutes would leave steps that are no gaps.
    nameless = any(is_nameless(column.name) for column in parts.values())
    if nameless and (np.abs(slots - np.rint(slots)) > 1e-6 * slots).any():
        return False
    return varying >= _VARY and float(np.mean(np.abs(slots - 1.0) <= 1e-3)) >= _EVEN


def _any_years(values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Years from one on that has a 29th of February if the dates have one; another begins where days begin anew."""
    if "of_year" in values:
        days, leap = values["of_year"], bool((values["of_year"] == 366.0).any())
    else:
        days = 31.0 * (values["month"] - 1.0) + values["day"]
        leap = bool(((values["month"] == 2.0) & (values["day"] == 29.0)).any())
    anew = np.concatenate([[0.0], np.cumsum(np.diff(days) < -_HALF_A_YEAR)])
    return (2000.0 if leap else 2001.0) + anew


def _seconds(parts: Mapping[str, NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Days since 1970, and seconds since midnight."""
    years = (parts["year"].astype(np.int64) - 1970).astype("datetime64[Y]")
    if {"month", "day"} <= set(parts):
        months = years.astype("datetime64[M]") + (parts["month"].astype(np.int64) - 1)
        days = months.astype("datetime64[D]").astype(np.int64) + parts["day"] - 1.0
    else:
        days = years.astype("datetime64[D]").astype(np.int64) + parts["of_year"] - 1.0
    clock: NDArray[np.float64] = np.zeros(len(days))
    for part, seconds in _SECONDS.items():
        clock += parts[part] * seconds if part in parts else 0.0
    if "digits" in parts:
        found = seconds_of_digits(parts["digits"])
        clock += 0.0 if found is None else found
    return days, clock
