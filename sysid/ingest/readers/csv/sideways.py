"""Tables of text that lie on their side: each line is a channel, its name, if it has one, and then its samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid.ingest.cells.calendar import is_calendar
from sysid.ingest.cells.headers import is_unit, parse_header, split_reference
from sysid.ingest.cells.numbers import NumberFormat
from sysid.ingest.readers.csv.cells import MOST_LINES
from sysid.ingest.tables.columns import RawColumn, array_column, distinct
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import recognise_time

_LEAST = 8
"""Samples at least."""
_NAMELESS, _LONGER = 32, 4
"""Samples that lines of numbers alone have at least, and how many times as many as there are lines."""
_MOST_LABELS = 6
"""Cells before the samples of a channel at most."""
_SEPARATORS = (("\t", "."), (";", ","), (";", "."), (",", "."), ("\t", ","), (None, "."), (None, ","))
"""What stands between cells, nothing for a run of blanks, and the decimal mark beside it."""


def sideways(path: Path, lines: Sequence[str], *, comment: str | None) -> RawTable | None:
    """A table whose lines are channels.

    Args:
        path: The file.
        lines: All of its lines.
        comment: Marks of a comment.

    Returns:
        The table; ``None`` where the lines are not a name each, and then numbers, more of them than there are lines;
        or numbers alone, many more of them. The first line may lack a name, as that of a turned index does.
    """
    kept = [line.strip() for line in lines if line.strip() and line.lstrip()[0] not in (comment or "#%")]
    if not 1 < len(kept) <= MOST_LINES:
        return None
    for separator, decimal in _SEPARATORS:
        cells = [line.rstrip(separator).split(separator) for line in kept]
        width = len(cells[0])
        if width <= max(len(cells), _LEAST) or any(len(row) != width for row in cells):
            continue
        numbers = NumberFormat(decimal=decimal)
        names = [row[0].strip().strip('"') for row in cells]
        bare = all(numbers.parse(name) is not None for name in names) and "" not in names
        named = all(numbers.parse(name) is None for name in names[1:]) and (
            not names[0] or numbers.parse(names[0]) is None
        )
        if named and all(map(is_calendar, names[1:])):
            return None  # dates one below the other are the time, whatever numbers the head has
        if not (named or (bare and width >= max(_NAMELESS, _LONGER * len(cells)))):
            continue
        labels = 1 if bare else _labels(cells[0])
        stamps = None if bare else _stamps(cells[0][labels:], path)
        parsed = [numbers.column(row if bare else row[labels:]) for row in cells[stamps is not None :]]
        if any(isinstance(one, int) for one in parsed):
            continue
        heads = [parse_header("" if bare else name) for name in names]
        units = [_unit(row[1:labels]) for row in cells]
        columns = [] if stamps is None else [replace(stamps, name=heads.pop(0).name or "time")]
        columns += [
            RawColumn(
                name=head.name or f"column_{number + 1}",
                values=np.asarray(values),
                unit=head.unit or units[number],
                reference=head.reference,
            )
            for number, (head, values) in enumerate(zip(heads, parsed, strict=True), len(columns))
        ]
        columns, renamed = distinct(columns)
        return RawTable(
            source=path,
            reader="csv",
            columns=tuple(columns),
            time=recognise_time(columns),
            settings={"calendar": stamps is not None and stamps.began is not None},
            notes=(f"its {len(columns)} lines are taken as channels, of {len(columns[0].values)} samples", *renamed),
        )
    return None


def _labels(first: Sequence[str]) -> int:
    """How many cells of each line say what it is: name, unit and whatever else a historian has, before the dates."""
    dated = [is_calendar(cell.strip().strip('"')) for cell in first[: _MOST_LABELS + 1]]
    return next((k for k in range(1, len(dated)) if dated[k] and not any(dated[:k])), 1)


def _unit(labels: Sequence[str]) -> str | None:
    """The unit among what a line says of itself behind its name."""
    return next(
        (split_reference(text)[0] for cell in labels if (text := cell.strip().strip('"')) and is_unit(text)), None
    )


def _stamps(cells: Sequence[str], path: Path) -> RawColumn | None:
    """Dates, times of day or lengths of time in the first line, as a turned table has its index there."""
    texts = [cell.strip().strip('"') for cell in cells]
    if not all(map(is_calendar, texts)):
        return None
    column = array_column("time", np.array(texts), where=str(path))
    return None if column.problem is not None else column
