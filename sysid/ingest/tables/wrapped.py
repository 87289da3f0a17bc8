"""Clocks that begin anew because they are full: counters of 16 and 32 bit, seconds of the day and of the week."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import unit_of_clock

_DAY, _WEEK = 86_400.0, 604_800.0
_FULL = {
    **{2.0**bits: f"a counter of {bits} bit" for bits in (16, 24, 31, 32)},
    **{
        span * factor: f"a clock of the {name}"
        for span, name in ((_DAY, "day"), (_WEEK, "week"))
        for factor in (1.0, 1e3, 1e6)
    },
}
_ROUNDS = {60.0: "a clock that counts to 60", 3600.0: "a clock of the hour", 24.0: "a clock that counts to 24"}
"""Clocks that are full so soon that records one below the other may look alike; those begin near nothing."""
_LEAST, _MOST = 0.5, 1.5
"""Of the usual step the least that a step over the end may be, and of the longest the most."""
_FEWEST = 8


def going_on(table: RawTable, clock: str | None = None) -> RawTable:
    """A table whose clock goes on where it began anew for want of digits, as that of a microcontroller does.

    Args:
        table: From any reader.
        clock: Its column of time, where that is said; else the one that is recognised, or is called by a unit of time.

    Returns:
        The table, and what the clock is among its notes; as it is where a step back is of another length than to the
        end of such a clock.
    """
    name = clock or table.time
    for time in table.columns:
        may_be = time.name == name if name is not None else unit_of_clock(time.name) is not None
        if not may_be or time.problem is not None or time.began is not None or table.records:
            continue
        found = _unwrapped(time.values)
        if found is None:
            continue
        values, what = found
        columns = tuple[RawColumn, ...](replace(c, values=values) if c is time else c for c in table.columns)
        told = f"{time.name} begins anew where {what} is full, and is taken to go on"
        return replace(table, columns=columns, time=time.name, notes=(*table.notes, told))
    return table


def _unwrapped(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], str] | None:
    if len(values) < _FEWEST or not np.isfinite(values).all() or values.min() < 0.0:
        return None
    steps = np.diff(values)
    back = steps < 0.0
    if not back.any() or 2 * back.sum() > len(steps):
        return None
    usual, longest = float(np.median(steps[~back])), float(steps[~back].max())
    # Records begin where their clocks do, a clock on the wall anywhere.
    rounds = _ROUNDS if values[0] > usual else {}
    for full, what in {**_FULL, **rounds}.items():
        over = steps[back] + full
        if values.max() < full and (over >= _LEAST * usual).all() and (over <= _MOST * longest).all():
            return values + full * np.concatenate([[0.0], np.cumsum(back)]), what
    return None
