"""Tables of text that lie on their side: each line is a channel, its name and then its samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sysid.ingest.cells.headers import parse_header
from sysid.ingest.cells.numbers import NumberFormat
from sysid.ingest.tables.columns import RawColumn, distinct
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import recognise_time

_MOST, _LEAST = 64, 8
"""Channels at most, and samples at least."""
_SEPARATORS = (("\t", "."), (";", ","), (";", "."), (",", "."), ("\t", ","))
"""What stands between cells, and the decimal mark beside it."""


def sideways(path: Path, lines: Sequence[str], *, comment: str | None) -> RawTable | None:
    """A table whose lines are channels.

    Args:
        path: The file.
        lines: All of its lines.
        comment: Marks of a comment.

    Returns:
        The table; ``None`` where the lines are not a name each, and then numbers, more of them than there are lines.
    """
    kept = [line.strip() for line in lines if line.strip() and line.lstrip()[0] not in (comment or "#%")]
    if not 1 < len(kept) <= _MOST:
        return None
    for separator, decimal in _SEPARATORS:
        cells = [line.rstrip(separator).split(separator) for line in kept]
        width = len(cells[0])
        if width <= max(len(cells), _LEAST) or any(len(row) != width for row in cells):
            continue
        numbers = NumberFormat(decimal=decimal)
        parsed = [numbers.column(row[1:]) for row in cells]
        names = [row[0].strip().strip('"') for row in cells]
        if any(isinstance(one, int) for one in parsed) or any(numbers.parse(name) is not None for name in names):
            continue
        heads = [parse_header(name) for name in names]
        columns = [
            RawColumn(name=head.name, values=np.asarray(values), unit=head.unit, reference=head.reference)
            for head, values in zip(heads, parsed, strict=True)
        ]
        columns, renamed = distinct(columns)
        return RawTable(
            source=path,
            reader="csv",
            columns=tuple(columns),
            time=recognise_time(columns),
            notes=(f"its {len(columns)} lines are taken as channels, of {width - 1} samples", *renamed),
        )
    return None
