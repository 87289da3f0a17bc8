"""A head with a name more or fewer than the rows have cells: names are kept where it is plain which column has none.

Indices have no name where R writes them (``write.table``: the head is a name short), as loggers do with numbers of
rows. A name that is lost in the middle cannot be placed; such a head is left, and columns are numbered.
"""

from __future__ import annotations

from itertools import pairwise

from sysid.ingest.cells.headers import parse_header
from sysid.ingest.readers.csv.cells import BLANKS, Kind, Row
from sysid.ingest.readers.csv.split import Split
from sysid.ingest.tables.time_columns import is_called_time, is_counter

_LOOKED = 100
"""Rows by which it is told what the first column is."""
_EVEN = 0.25
"""Of a clock's usual step, how far each may be off it."""


def without_name(cells: list[str], row: Row, split: Split) -> str | None:
    """What the first column is to be called where a head is a name short, and it is the first that has none.

    Args:
        cells: The head's, one fewer than there are columns.
        row: Where they stand.
        split: The rows of the file.

    Returns:
        A name, empty where none is plain; ``None`` where it is not plain that it is the first column.
    """
    timed = _is_time(cells[0])
    quoted = split.lines[row.line - 1].lstrip(" #%").startswith('"')
    if split.separator == BLANKS and not (quoted or timed):  # any line of words would be names
        return None
    if is_counter(cells[0].strip()) or (split.separator == "," and not quoted and _whole(split)):
        return None  # a comma may stand in a number
    if split.kinds[0] is Kind.TIME:
        return "date" if timed and split.kinds[1] is Kind.TIME else None if timed else "time"
    if timed and not _rises(split, 1):
        return None
    words = [row.cells[0] for row in split.run()[:_LOOKED]]
    if (split.kinds[0] is Kind.WORD and len(set(words)) == len(words)) or _counts(split):
        return "row"
    return "" if _is_even(split) and not any(map(_is_time, cells)) else None


def has_no_column(cells: list[str], split: Split) -> bool:
    """Whether the first name of a head that is a name long belongs to an index that was not written.

    Args:
        cells: The head's, one more than there are columns.
        split: The rows of the file.

    Returns:
        Whether it is empty, or the second is time and the first column goes as time does.
    """
    if not cells[0].strip():
        return True
    return not _is_time(cells[0]) and _is_time(cells[1]) and _is_even(split) and not _rises(split, 1)


def rises(split: Split) -> bool:
    """Whether the first column goes up from row to row, as time does.

    Args:
        split: The rows of the file.

    Returns:
        Whether it does.
    """
    return _rises(split, 0)


def _is_time(cell: str) -> bool:
    return is_called_time(parse_header(cell).name)


def _whole(split: Split) -> bool:
    return not any("." in cell for row in split.run()[:_LOOKED] for cell in row.cells)


def _steps(split: Split, column: int) -> list[float]:
    """From row to row; none where a cell is no number."""
    try:
        values = [float(row.cells[column].replace(",", ".")) for row in split.run()[:_LOOKED]]
    except ValueError:
        return []
    return [after - before for before, after in pairwise(values)]


def _rises(split: Split, column: int) -> bool:
    steps = _steps(split, column)
    return len(split.kinds) > column and (
        split.kinds[column] is Kind.TIME or (len(steps) > 1 and all(step > 0.0 for step in steps))
    )


def _is_even(split: Split) -> bool:
    steps = sorted(_steps(split, 0))
    usual = steps[len(steps) // 2] if len(steps) > 1 else 0.0
    return usual > 0.0 and max(usual - steps[0], steps[-1] - usual) <= _EVEN * usual


def _counts(split: Split) -> bool:
    """Whether the first column numbers the rows, from any number in quotes, as R writes names of rows, else from 0."""
    rows = split.run()[:_LOOKED]
    numbers = [row.cells[0].strip() for row in rows]
    if len(rows) < 2 or not numbers[0].isdecimal():
        return False
    quoted = all(split.lines[row.line - 1].lstrip().startswith('"') for row in rows)
    begun = quoted or int(numbers[0]) <= 1
    return begun and numbers == [str(int(numbers[0]) + k) for k in range(len(rows))]
