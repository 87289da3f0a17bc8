"""Further clocks and counters beside the time column: no channels, and maybe the time of the columns behind them.

Loggers and spreadsheets put records side by side, each behind a time of its own: ``t1, u, t2, y``. Rows of such a
table are of one time only where the clocks agree.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import UnitError
from sysid.ingest.cells.headers import is_unit
from sysid.ingest.tables.clocks import since_1970
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.quality import is_quality
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import is_called_time, is_counter, is_time_unit
from sysid.traces import Trace
from sysid.units import convert

_NUMBERED = re.compile(r"(?:t|time|zeit|temps|tiempo)(?:[ _]?\d+|[ _.](?P<of>[^\W_]{1,12}))", re.IGNORECASE)
_ENDS = re.compile(r".+[ _.-](?:t|time|timestamp|stamp|clock|zeit)", re.IGNORECASE)
_COUNTED = re.compile(
    r"(?:id|idx|index|row|line|zeile|sample|frame|scan|record|point|data[ _]?point|packet|message|msg|seq|sequence)s?"
    r"(?:[ _.]*(?:#|no\.?|nr\.?|num|number|index|id|count(?:er)?))?",
    re.IGNORECASE,
)
"""Numbers of rows, of pictures or of messages: no signal is called so."""
_NAMELESS = re.compile(r"column_1|level_0|unnamed: \d+(?:\.\d+)*", re.IGNORECASE)
"""What a first column without a name is called, as those of indices that pandas wrote."""
_TIME = "the time"
"""What no channel is called."""
_EVEN = 0.25
"""Of its usual step, how far each step of a clock may be off it."""
_SAME_PACE = 0.02
"""How far the pace of two clocks may be apart whose steps differ."""
_FAR = 0.05
"""Of the record, how far two such clocks may come apart."""
_FEW_STEPS = 0.2
"""Of the rows, how many a counter rises at least at: one that stands longer may be a stage of the experiment."""
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
    behind = [*(column.name for column in table.columns[1:]), ""]
    for column, following in zip(table.columns, behind, strict=True):
        said = "" if column is first or column.problem is not None or column.aside else _said(column, first, following)
        if column is first or said:
            other = column.name if said.startswith("a clock of another pace") else ""
        elif other and column.problem is None:
            said = f"stands behind {other}, which goes at another pace than {clock}: its rows are of other times"
        columns.append(replace(column, aside=said) if said else column)
    return replace(table, columns=tuple(columns))


def without_clocks(trace: Trace) -> tuple[Trace, tuple[str, ...]]:
    """A record of a file that says all, without its second clocks and counters.

    Args:
        trace: With all columns as channels.

    Returns:
        The record, and what was left out and why; the same where nothing else would be left.
    """
    channels = (RawColumn(name=c.name, values=trace[c.name], unit=c.unit) for c in trace.channels)
    time = RawColumn(name=_TIME, values=trace.time, unit="s")
    table = RawTable(source=Path(trace.name), reader="", columns=(time, *channels), time=_TIME)
    beside = {column.name: column.aside for column in without_second_clocks(table, _TIME).columns if column.aside}
    kept = [j for j, channel in enumerate(trace.channels) if channel.name not in beside]
    if not beside or not kept:
        return trace, ()
    usable = trace.usable[:, kept] if trace.usable is not None and trace.usable.ndim == 2 else trace.usable
    left = replace(
        trace, channels=tuple(trace.channels[j] for j in kept), values=trace.values[:, kept].copy(), usable=usable
    )
    return left, tuple(f"{name} ({said})" for name, said in beside.items())


def _said(column: RawColumn, first: RawColumn | None, behind: str) -> str:
    """What a column is if it is a clock or a counter, else nothing."""
    if counts_rows(column) or (
        first is None and (is_called_time(column.name) or column.name in {"x", "X"}) and _by_one(column.values)
    ):
        return "counts the rows"
    if is_quality(column):
        return "says how good values are"
    if _counts_on(column):
        return "counts on, but not by one from row to row"
    if first is None or is_counter(column.name):
        return ""
    dated = column.unit is None and since_1970(column.values)
    if dated and since_1970(first.values):
        return f"a second clock beside {first.name}"
    numbered = _NUMBERED.fullmatch(column.name.strip())
    called = is_called_time(column.name) or (
        numbered is not None and (numbered["of"] is None or numbered["of"].casefold() in behind.casefold())
    )
    timed = column.unit is not None and is_time_unit(column.unit)
    if column.unit not in {None, "1"} and not timed and is_unit(str(column.unit)):
        return ""  # T in kelvin rises as evenly as a clock where it is a ramp
    named = called or numbered is not None or _ENDS.fullmatch(column.name.strip()) is not None
    if not (named or timed or dated) or not _never_falls(column.values):
        return ""
    return _beside(column, first, called=called, timed=timed)


def _beside(column: RawColumn, first: RawColumn, *, called: bool, timed: bool) -> str:
    """How a column that never falls goes along with the time, if it does."""
    mine, theirs = _in_seconds(column), _in_seconds(first)
    step, lasts = float(np.median(np.diff(theirs))), float(theirs[-1] - theirs[0])
    if not (step > 0.0 and lasts > 0.0):
        return ""
    even = _is_even(mine) and _is_even(theirs)
    pace = float(np.median(np.diff(mine)) / step) if even else float(mine[-1] - mine[0]) / lasts
    if not pace > 0.0:
        return ""
    factor = 1.0 if timed and first.unit else min((1.0, *_FACTORS), key=lambda f: abs(np.log(pace * f)))
    ahead = factor * mine - theirs
    apart, offset = float(np.ptp(ahead)), float(np.median(ahead))
    if apart <= _TOGETHER * step:
        if abs(offset) <= 1e-3 * step or abs(offset) > _ORIGIN or factor != 1.0:
            return f"the time again, as in {first.name}"
        return f"a second clock, {offset:.6g} ahead of {first.name}"
    if even:
        # A ramp of pulse widths, or of delays, is in a unit of time too, and is no clock.
        return f"a clock of another pace than {first.name}" if called else ""
    if abs(factor * pace - 1.0) <= _SAME_PACE and apart <= _FAR * lasts:
        return f"a second clock beside {first.name}, whose steps differ from it by up to {apart:.3g} s"
    return f"a clock in uneven steps beside {first.name}" if is_called_time(column.name) else ""


def _by_one(values: NDArray[np.float64]) -> bool:
    return len(values) > 2 and bool(np.isfinite(values).all()) and bool((np.diff(values) == 1.0).all())


def _never_falls(values: NDArray[np.float64]) -> bool:
    return len(values) > 2 and bool(np.isfinite(values).all()) and bool((np.diff(values) >= 0.0).all())


def _counts_on(column: RawColumn) -> bool:
    """Whether a column is called a number of something that comes again and again, and goes up as one does."""
    if column.unit not in {None, "1"} or _COUNTED.fullmatch(re.split(r"[/.](?=\w)", column.name.strip())[-1]) is None:
        return False
    values = column.values
    return (
        _never_falls(values)
        and bool((values == np.round(values)).all())
        and float(np.mean(np.diff(values) > 0.0)) >= _FEW_STEPS
    )


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
