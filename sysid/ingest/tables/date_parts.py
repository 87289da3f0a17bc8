"""Dates in columns of their own, year, month, day, hour, as weather stations and hydrologists write them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.cells.began import Began
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable

_CALLED = {
    "year": ("year", "yyyy", "YY", "yr", "jahr", "année", "año"),
    "month": ("month", "MM", "mon", "mo", "monat", "mois", "mes"),
    "day": ("day", "DD", "dd", "dy", "tag", "jour", "día"),
    "of_year": ("doy", "jday", "dayofyear", "day_of_year", "day of year", "julian day"),
    "hour": ("hour", "hh", "hr", "HH", "stunde", "heure", "hora"),
    "minute": ("minute", "mm", "min", "mn"),
    "second": ("second", "ss", "sec", "seconds", "sekunde"),
}
"""Names of each part; those of two letters as they are written, as MM is a month where mm are minutes."""
_LEAST = {"year": 1900.0, "month": 1.0, "day": 1.0, "of_year": 1.0, "hour": 0.0, "minute": 0.0, "second": 0.0}
_MOST = {"year": 2200.0, "month": 12.0, "day": 31.0, "of_year": 366.0, "hour": 24.0, "minute": 59.0, "second": 60.0}
_SECONDS = {"hour": 3600.0, "minute": 60.0, "second": 1.0}


def time_of_parts(table: RawTable) -> RawTable:
    """A table whose columns of a year, a month, a day (or a day of the year), hours and so on are one column of time.

    Args:
        table: From any reader.

    Returns:
        The table; as it is where it has another time, or these columns are no dates that go on.
    """
    parts = _parts(table)
    days = "of_year" in parts or {"month", "day"} <= set(parts)
    if (
        "year" not in parts
        or not days
        or (table.time is not None and table.time not in {c.name for c in parts.values()})
    ):
        return table
    if any(not _fits(column.values, part) for part, column in parts.items()):
        return table
    date, clock = _seconds({part: column.values for part, column in parts.items()})
    stamps = (date - date[0]) * 86_400.0 + clock - clock[0]
    if len(stamps) < 2 or (np.diff(stamps) < 0.0).any() or "time" in table.names:
        return table
    began = Began(micros=round((float(date[0]) * 86_400.0 + float(clock[0])) * 1e6))
    time = RawColumn(name="time", values=stamps, unit="s", began=began)
    used = [column.name for column in parts.values()]
    others = tuple(column for column in table.columns if column.name not in used)
    told = f"time is {', '.join(used)} together"
    return replace(table, columns=(time, *others), time="time", step=None, notes=(*table.notes, told))


def _parts(table: RawTable) -> Mapping[str, RawColumn]:
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
    return found


def _fits(values: NDArray[np.float64], part: str) -> bool:
    whole = part in {"hour", "second"} or bool((values == np.rint(values)).all())
    return whole and bool(
        np.isfinite(values).all() and (values >= _LEAST[part]).all() and (values <= _MOST[part]).all()
    )


def _seconds(parts: Mapping[str, NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Days since 1970, and seconds since midnight."""
    years = (parts["year"].astype(np.int64) - 1970).astype("datetime64[Y]")
    if "of_year" in parts:
        days = years.astype("datetime64[D]").astype(np.int64) + parts["of_year"] - 1.0
    else:
        months = years.astype("datetime64[M]") + (parts["month"].astype(np.int64) - 1)
        days = months.astype("datetime64[D]").astype(np.int64) + parts["day"] - 1.0
    clock: NDArray[np.float64] = np.zeros(len(days))
    for part, seconds in _SECONDS.items():
        clock += parts[part] * seconds if part in parts else 0.0
    return days, clock
