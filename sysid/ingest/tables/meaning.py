"""What columns mean beyond their format: states as numbers, long tables made wide, clocks by their size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, ReaderError, UnitError
from sysid.ingest.cells.words import Words, states_for
from sysid.ingest.tables.clock_digits import time_of_digits
from sysid.ingest.tables.clocks import clock_of
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.date_parts import time_of_parts
from sysid.ingest.tables.joining import Signal, joined
from sysid.ingest.tables.one_stamp import rows_of_one_stamp
from sysid.ingest.tables.options import FileOptions, LongOptions
from sysid.ingest.tables.quality import without_bad_values
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import time_unit
from sysid.ingest.tables.wrapped import going_on
from sysid.units import convert

_RATED = ("s", "ms", "us", "ns", "min", "h")
"""Units in which a time beside a rate may count."""
_FEWEST, _EVEN, _TOGETHER = 8, 0.9, 0.5
"""A long table is of signals with clocks of their own where the fastest of so many samples is as even, and another
shares fewer of its stamps."""
_WHOLE = 2.0**53
_NEAR = 0.02
"""Share of a sample time by which the steps of a clock may be off it."""


def with_meaning(table: RawTable, files: FileOptions) -> RawTable:
    """A table as its options and its contents say.

    Args:
        table: From any reader.
        files: How it is read.

    Returns:
        The table with states as numbers, with a column per signal where it was long, and with the unit of a clock
        that is known by the size of its numbers.

    Raises:
        ConfigError: If a table of states or a long table cannot be made as asked for.
        ChannelError: If a column that is named for it is not there.
    """
    _check_states(table, files)
    records = tuple(replace(record, table=with_meaning(record.table, files)) for record in table.records)
    columns, others = (tuple(_as_states(c, files) for c in group) for group in (table.columns, table.others))
    table = without_bad_values(replace(table, columns=columns, others=others, records=records))
    if files.long is not None:
        table = _wide(table, files.long)
    asked = files.time
    if asked.step is None:
        put_together = time_of_digits(time_of_parts(table))
        table = put_together if asked.column in {None, put_together.time} else table
    table = rows_of_one_stamp(going_on(table, asked.column))
    return table if asked.column or asked.unit or asked.step is not None else with_clock(table)


def _check_states(table: RawTable, files: FileOptions) -> None:
    for name, given in files.states.items():
        if isinstance(given, dict) and name not in table.names:
            raise ChannelError([name], table.names, where=f"{table.source}, field source.files.states")


def _as_states(column: RawColumn, files: FileOptions) -> RawColumn:
    if column.words is None:
        return column
    values = column.words.values(states_for(files.states, column.name))
    return column if values is None else replace(column, values=values, problem=None)


def with_clock(table: RawTable) -> RawTable:
    """A table whose time without a unit has that of the clock that it is: by a rate beside it, else by its size.

    Args:
        table: From any reader, or from memory.

    Returns:
        The table; what was told is among its notes, and that a rate and a time do not go together. As it is where
        nothing is told, or a unit is known.
    """
    if table.time is None:
        return table
    column = next(column for column in table.columns if column.name == table.time)
    if column.problem is not None:
        return table
    if table.step is not None and (beside := _beside_a_rate(table, column, table.step)) is not None:
        return beside
    if column.unit is not None:
        return table
    clock = clock_of(column.values, column.name, origin=column.counted_from)
    if clock is None:
        return table
    columns = tuple(replace(c, unit=clock.unit) if c is column else c for c in table.columns)
    told = f"{column.name} counts {clock.told}, told by its size"
    return replace(table, columns=columns, settings={**table.settings, "clock": told}, notes=(*table.notes, told))


def _beside_a_rate(table: RawTable, column: RawColumn, step: float) -> RawTable | None:
    """A table whose file says a rate and has a time too: they are of one unit, or one counts the samples."""
    steps = np.diff(column.values)
    known = steps[np.isfinite(steps)]
    if not len(known):
        return None
    usual = (float(np.median(known)), float(np.mean(known)))
    for unit in _RATED if column.unit is None else (column.unit,):
        seconds = _in_seconds(unit)
        if any(abs(seconds * pace - step) <= _NEAR * step for pace in usual):
            if column.unit is not None:
                return table
            columns = tuple(replace(c, unit=unit) if c is column else c for c in table.columns)
            told = f"{column.name} is taken in {unit}: its steps are the sample time that the file says, {step:g} s"
            return replace(table, columns=columns, notes=(*table.notes, told))
    if column.unit is None and bool((steps == 1.0).all()):
        told = f"{column.name} counts the rows: the file says {step:g} s between them"
        return replace(table, time=None, notes=(*table.notes, told))
    told = f"the file says {step:g} s between samples, and {column.name} rises by {usual[0]:g} {column.unit or ''}"
    return replace(table, notes=(*table.notes, f"{told.rstrip()}: {column.name} is believed"))


def _in_seconds(unit: str) -> float:
    try:
        return float(convert(np.ones(1), time_unit(unit), "s")[0])
    except UnitError:
        return float("nan")


def _wide(table: RawTable, long: LongOptions) -> RawTable:
    """A table of (time, signal, value) as one column per signal, a row per time."""
    by_name = {column.name: column for column in table.columns}
    wanted = [name for name in (long.names, long.values, long.units) if name is not None]
    missing = [name for name in wanted if name not in by_name]
    if missing or table.time is None:
        raise ChannelError(missing or ["time"], table.names, where=f"{table.source}, field source.files.long")
    names, time = by_name[long.names], by_name[table.time]
    texts, codes = _names(names, table)
    stamps, rows = np.unique(time.values, return_index=True)
    known = np.isfinite(stamps)
    stamps, rows = stamps[known], rows[known]
    places = np.searchsorted(stamps, time.values)
    source = by_name[long.values]
    if source.problem is not None:
        raise source.problem
    columns: list[RawColumn] = [replace(time, values=stamps)]
    signals: list[Signal] = []
    twice = 0
    for code, text in enumerate(texts):
        mine = (codes == code) & np.isfinite(time.values)
        values = np.full(len(stamps), np.nan)
        values[places[mine]] = source.values[mine]
        twice += int(mine.sum()) - len(np.unique(places[mine]))
        unit = _unit_of(by_name.get(long.units or ""), mine) or source.unit
        columns.append(RawColumn(name=text, values=values, unit=unit))
        signals += [_signal(columns[-1], stamps)] if np.isfinite(values).any() else []
    notes = [*table.notes, f"a long table of {len(texts)} signals made wide"]
    notes += [f"{twice} values stand twice at one time: the last one counts"] if twice else []
    lines = None if table.lines is None else table.lines[rows]
    if _have_own_clocks(signals):
        at, told = joined(signals, table.source)
        columns = [replace(time, values=at[0].stamps)]
        columns += [RawColumn(name=one.name, values=one.values.astype(np.float64), unit=one.unit) for one in at]
        return replace(table, columns=tuple(columns), lines=None, notes=(*notes, *told))
    return replace(table, columns=tuple(columns), lines=lines, notes=tuple(notes))


def _signal(column: RawColumn, stamps: NDArray[np.float64]) -> Signal:
    """What stands in a column of a long table, at its own stamps."""
    known = np.isfinite(column.values)
    values = column.values[known]
    whole = values.astype(np.int64) if (np.abs(values) < _WHOLE).all() and (values == np.rint(values)).all() else values
    return Signal(name=column.name, group="", values=whole, stamps=stamps[known], unit=column.unit)


def _have_own_clocks(signals: Sequence[Signal]) -> bool:
    """Whether signals were stamped one by one, the fastest of them evenly, not at common times with some left out."""
    fastest = min(signals, key=lambda signal: (signal.step, -len(signal.stamps)), default=None)
    if fastest is None or len(fastest.stamps) < _FEWEST:
        return False
    steps = np.diff(fastest.stamps)
    even = float(np.mean(np.abs(steps - fastest.step) <= 0.25 * fastest.step))
    return even >= _EVEN and any(np.mean(np.isin(one.stamps, fastest.stamps)) < _TOGETHER for one in signals)


def _names(column: RawColumn, table: RawTable) -> tuple[list[str], NDArray[np.integer]]:
    if column.words is not None and column.words.complete:
        return list(column.words.texts), column.words.codes
    if column.problem is None:
        numbers, codes = np.unique(column.values, return_inverse=True)
        if len(numbers) <= 256 and np.isfinite(numbers).all():
            return [f"{column.name}_{number:g}" for number in numbers], codes
    raise ConfigError(
        "the column holds no names of signals",
        where=f"{table.source}, column {column.name}",
        expected="a few different names",
        got=column.problem.got if isinstance(column.problem, ReaderError) else "numbers",
        remedy="name the column that holds them (long: {names: ..., values: ...})",
    )


def _unit_of(units: RawColumn | None, mine: NDArray[np.bool_]) -> str | None:
    words: Words | None = None if units is None else units.words
    if words is None or not mine.any():
        return None
    first = int(words.codes[mine][0])
    return words.texts[first] if first >= 0 else None
