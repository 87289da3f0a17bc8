"""Further clocks and counters beside the time column: no channels, and maybe the time of the columns behind them.

Loggers and spreadsheets put records side by side, each behind a time of its own: ``t1, u, t2, y``. Rows of such a
table are of one time only where the clocks agree.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import UnitError
from sysid.ingest.tables.clocks import since_1970
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import is_called_time, is_counter, is_time_unit
from sysid.units import convert

_NUMBERED = re.compile(r"(?:t|time|zeit|temps|tiempo)(?:[ _]?\d+|[ _.][^\W_]{1,12})", re.IGNORECASE)
_NAMELESS = re.compile(r"column_1|level_0|unnamed: \d+(?:\.\d+)*", re.IGNORECASE)
"""What a first column without a name is called, as those of indices that pandas wrote."""
_EVEN = 0.25
"""Of its usual step, how far each step of a clock may be off it."""
_TOGETHER = 0.1
"""Of a step, how far two clocks of one pace may come apart over the record."""
_ORIGIN = 1e6
"""Seconds that two clocks may be apart before one of them is taken to count from another origin."""
_FACTORS = (1e-9, 1e-6, 1e-3, 60.0, 3600.0, 86_400.0)
"""Seconds of the units in which one time may be written twice."""


def counts_rows(column: RawColumn) -> bool:
    """Whether a column is called a number of rows, or nothing, and is one: it rises by one from each to the next.

    Args:
        column: A column.

    Returns:
        Whether it is.
    """
    called = is_counter(column.name) or _NAMELESS.fullmatch(column.name) is not None
    return called and column.unit in {None, "1"} and _by_one(column.values)


def without_second_clocks(table: RawTable, clock: str | None) -> RawTable:
    """A table whose further clocks and counters are no channels, nor what stands behind one of another pace.

    Args:
        table: From any reader.
        clock: Its time column, if it has one.

    Returns:
        The table; each such column says why it is aside.
    """
    first = None if clock is None else table.find(clock)
    columns, other = list[RawColumn](), ""
    for column in table.columns:
        said = "" if column is first or column.problem is not None or column.aside else _said(column, first)
        if column is first or said:
            other = column.name if said.startswith("a clock of another pace") else ""
        elif other and column.problem is None:
            said = f"stands behind {other}, which goes at another pace than {clock}: its rows are of other times"
        columns.append(replace(column, aside=said) if said else column)
    return replace(table, columns=tuple(columns))


def _said(column: RawColumn, first: RawColumn | None) -> str:
    """What a column is if it is a clock or a counter, else nothing."""
    if counts_rows(column) or (first is None and is_called_time(column.name) and _by_one(column.values)):
        return "counts the rows"
    if first is None or is_counter(column.name):
        return ""
    if column.unit is None and since_1970(column.values) and since_1970(first.values):
        return f"a second clock beside {first.name}"
    called = is_called_time(column.name) or _NUMBERED.fullmatch(column.name.strip()) is not None
    timed = column.unit is not None and is_time_unit(column.unit)
    if not (called or timed) or not _is_even(column.values):
        return ""
    mine, theirs = _in_seconds(column), _in_seconds(first)
    if not float(np.median(np.diff(theirs))) > 0.0:
        return ""
    pace = float(np.median(np.diff(mine)) / np.median(np.diff(theirs)))
    factor = 1.0 if timed and first.unit else min((1.0, *_FACTORS), key=lambda f: abs(np.log(pace * f)))
    ahead = factor * mine - theirs
    step = float(np.median(np.diff(theirs)))
    if float(np.ptp(ahead)) > _TOGETHER * step:
        # A ramp of pulse widths, or of delays, is in a unit of time too, and is no clock.
        return f"a clock of another pace than {first.name}" if called else ""
    offset = float(np.median(ahead))
    if abs(offset) <= 1e-3 * step or abs(offset) > _ORIGIN or factor != 1.0:
        return f"the time again, as in {first.name}"
    return f"a second clock, {offset:.6g} ahead of {first.name}"


def _by_one(values: NDArray[np.float64]) -> bool:
    return len(values) > 2 and bool(np.isfinite(values).all()) and bool((np.diff(values) == 1.0).all())


def _is_even(values: NDArray[np.float64]) -> bool:
    """Whether values rise like a clock."""
    if len(values) < 3 or not np.isfinite(values).all():
        return False
    steps = np.diff(values)
    usual = float(np.median(steps))
    return usual > 0.0 and bool(np.mean(np.abs(steps - usual) <= _EVEN * usual) > 0.95)


def _in_seconds(column: RawColumn) -> NDArray[np.float64]:
    try:
        return convert(column.values, column.unit, "s") if column.unit else column.values
    except UnitError:
        return column.values
