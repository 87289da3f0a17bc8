"""Records that stand side by side in a table, each with a clock of its own: ``t1,u1,y1,t2,u2,y2``."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable, RecordChoice
from sysid.ingest.tables.time_columns import is_called_time

_NUMBERED = re.compile(r"(?P<stem>.*?[^\d _.-])[ _.-]?(?P<number>\d{1,3})")
_FEWEST_ROWS, _FEWEST_COLUMNS = 8, 3


def records_beside(table: RawTable) -> tuple[RecordChoice, ...]:
    """The records of a table whose columns come again with another number, and with them a clock.

    A shorter record ends where its cells are empty. What has one clock for all, or the same one again, is one record of
    many channels, and so are channels that each have a clock.

    Args:
        table: A table of text.

    Returns:
        A record for each number; none where the columns are not of such.
    """
    tags = dict[str, dict[str, RawColumn]]()
    for column in table.columns:
        found = _NUMBERED.fullmatch(column.name)
        stem, number = (found["stem"], found["number"]) if found else (column.name, "1")
        if stem in tags.setdefault(number, {}) or column.problem is not None:
            return ()
        tags[number][stem] = column
    stems = [list(members) for members in tags.values()]
    clock = next((stem for stem in stems[0] if is_called_time(stem)), None) if stems else None
    if (
        len(stems) < 2
        or clock is None
        or len(stems[0]) < _FEWEST_COLUMNS
        or any(set(one) != set(stems[0]) for one in stems)
    ):
        return ()
    lengths = [_length(list(members.values())) for members in tags.values()]
    clocks = [members[clock].values for members in tags.values()]
    if None in lengths or all(np.array_equal(one, clocks[0], equal_nan=True) for one in clocks):
        return ()
    return tuple(
        _record(table, number, members, clock, length or 0)
        for (number, members), length in zip(tags.items(), lengths, strict=True)
    )


def _length(columns: list[RawColumn]) -> int | None:
    """Rows of a record, which are its first ones; ``None`` where its clock does not rise over all of them."""
    known = np.isfinite(np.column_stack([column.values for column in columns])).any(axis=1)
    length = int(np.flatnonzero(known)[-1]) + 1 if known.any() else 0
    clock = next(column for column in columns if is_called_time(re.sub(r"[ _.-]?\d+$", "", column.name)))
    rises = bool((np.diff(clock.values[:length]) > 0.0).all())
    return length if length >= _FEWEST_ROWS and rises else None


def _record(table: RawTable, number: str, members: dict[str, RawColumn], clock: str, length: int) -> RecordChoice:
    columns = tuple(replace(column, name=stem) for stem, column in members.items())
    options: dict[str, object] = {
        "columns": {stem: column.name for stem, column in members.items() if stem != clock},
        "time": members[clock].name,
    }
    if length < len(table):
        options["rows"] = [1, length]
    own = replace(table, columns=columns, time=clock, step=None).between(1, length)
    return RecordChoice(name=f"record_{int(number)}", options=options, table=own)
