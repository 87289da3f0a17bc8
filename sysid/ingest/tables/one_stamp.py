"""Rows of one stamp that each hold some of the channels, as event loggers and telemetry write them, made one row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable


def rows_of_one_stamp(table: RawTable) -> RawTable:
    """A table whose rows of one stamp, of which no two hold the same channel, are one.

    Nothing is lost, and no value is moved: ``0.1,3,`` and ``0.1,,7`` are ``0.1,3,7``. Rows that both hold a channel are
    left, as repeated stamps that somebody has to decide about.

    Args:
        table: From any reader.

    Returns:
        The table, and that it was done among its notes; as it is where it cannot be done for all such rows.
    """
    time = next((column for column in table.columns if column.name == table.time), None)
    if time is None or time.problem is not None or len(table) < 2 or table.records:
        return table
    steps = np.diff(time.values)
    if not (steps >= 0.0).all() or not (steps == 0.0).any():  # what steps back, or has no stamp, is not in order
        return table
    begins = np.concatenate([[0], np.flatnonzero(steps > 0.0) + 1])
    columns = list[RawColumn]()
    apart = False
    for column in table.columns:
        if column is time:
            columns.append(replace(time, values=time.values[begins]))
            continue
        if column.problem is not None or column.words is not None:
            return table  # words would be lost
        known = np.isfinite(column.values)
        counts = np.add.reduceat(known, begins)
        if counts.max() > 1:
            return table
        apart = apart or not known.all()
        values = np.add.reduceat(np.where(known, column.values, 0.0), begins)
        columns.append(replace(column, values=np.where(counts == 1, values, np.nan)))
    if not apart:
        return table
    told = f"{len(table)} rows of {len(begins)} stamps, each with some of the channels, are taken together"
    lines = None if table.lines is None else table.lines[begins]
    return replace(table, columns=tuple(columns), lines=lines, notes=(*table.notes, told))
