"""Columns in memory as the table that a reader makes of a file: names with units, time, lengths."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.ingest.cells.headers import parse_header, unit_in_name
from sysid.ingest.tables.columns import RawColumn, array_column
from sysid.ingest.tables.frames import INDEX, check_distinct, not_numbers
from sysid.ingest.tables.meaning import with_clock
from sysid.ingest.tables.one_stamp import rows_of_one_stamp
from sysid.ingest.tables.table import RawTable, by_length
from sysid.ingest.tables.time_columns import is_time_unit, recognise_time


def table_of(
    columns: Mapping[str, NDArray[Any]], *, name: str, channels: Collection[str] = (), timed: bool = True
) -> RawTable:
    """The columns as a reader would give them.

    Args:
        columns: Arrays of shape ``(n_samples,)`` by name, as :func:`sysid.ingest.tables.frames.columns_by_name` finds
            them.
        name: Of the record, for errors.
        channels: Names of columns that are wanted as channels: one is time only where no other column is.
        timed: Whether one of these may be time at all; not where the sample time is given.

    Returns:
        The table, with its time where a column or an index is one.

    Raises:
        ConfigError: If there are no samples, a name stands twice, or an array has several columns.
    """
    raw = []
    for key, array in columns.items():
        header = parse_header(key)
        if array.ndim > 1:
            raise ConfigError(
                "a column of several columns",
                where=f"{name}, column {key}",
                expected="shape (n_samples,) for each name",
                got=f"shape {array.shape}",
                remedy=f'name each: {{"{key}1": {key}[:, 0], "{key}2": {key}[:, 1]}}, or give the pair (u, y)',
            )
        # Spans of time in seconds; a number of any other kind is as it stands.
        numbers = array.astype("timedelta64[ns]").astype(np.int64) / 1e9 if array.dtype.kind == "m" else array
        unit = "s" if array.dtype.kind == "m" else header.unit
        column = array_column(header.name, np.atleast_1d(numbers), where=name, unit=unit, reference=header.reference)
        # Who has a frame knows the types of its columns: text in it is no number by accident, as it is in a file.
        problem = not_numbers(key, np.atleast_1d(array), where=name) or column.problem
        raw.append(replace(column, problem=problem))
    if not any(len(column.values) for column in raw):
        raise no_samples(name)
    check_distinct([column.name for column in raw], where=name)
    equal, others = by_length(raw)
    table = RawTable(
        source=Path(name),
        reader="memory",
        columns=equal,
        others=others,
        time=INDEX if INDEX in columns else _time(equal, channels, timed=timed),
        origin=f"given from memory (SHA-256 {_digest(columns)})",
    )
    # Time is in seconds in every function of ours, unless its name or the size of its numbers says otherwise.
    table = with_clock(rows_of_one_stamp(table))
    united = [replace(c, unit=_clock_unit(c.name)) if c.name == table.time and not c.unit else c for c in table.columns]
    return replace(table, columns=tuple(united))


def _time(columns: Sequence[RawColumn], channels: Collection[str], *, timed: bool) -> str | None:
    named = {parse_header(one).name for one in channels}
    others = recognise_time([column for column in columns if column.name not in named])
    return recognise_time(columns) if others is None and timed else others


def _clock_unit(name: str) -> str:
    unit = unit_in_name(name)
    return unit if unit is not None and is_time_unit(unit) else "s"


def _digest(columns: Mapping[str, NDArray[Any]]) -> str:
    sha = hashlib.sha256()
    for key, array in columns.items():
        sha.update(key.encode(errors="replace"))
        plain = array.dtype.kind != "O"
        sha.update(np.ascontiguousarray(array).view(np.uint8).data if plain else repr(array.tolist()).encode())
    return sha.hexdigest()[:16]


def check_lengths(table: RawTable, channels: Sequence[str]) -> None:
    """Refuse columns of another length as channels: it is said here, and not that they are missing.

    Args:
        table: The record.
        channels: Those that are wanted; all where none is named.

    Raises:
        ConfigError: If one of them has another length than the record.
    """
    wanted = [one for one in table.others if not channels or one.name in channels]
    if wanted:
        raise ConfigError(
            "the channels of a record differ in length",
            where=str(table.source),
            expected=f"{len(table)} samples in each, as in {', '.join(table.names)}",
            got=", ".join(f"{len(one.values)} in {one.name}" for one in wanted),
            remedy="cut them to the same span of time, or name the inputs and outputs that are meant; a constant is "
            "np.full(n, value); experiments of different lengths are a list of records",
        )


def no_samples(where: str) -> ConfigError:
    """What is said of a record without rows; ``where`` names it."""
    return ConfigError(
        "the record holds no samples",
        where=where,
        expected="at least one column of numbers",
        got="no rows",
        remedy="look at what was selected before: a filter that nothing passes leaves no rows",
    )
