"""What is said of a cell that is no number."""

from __future__ import annotations

from pathlib import Path

from sysid.errors import ReaderError
from sysid.ingest.cells.headers import Header
from sysid.ingest.readers.csv.layout import Layout


def not_a_number(cell: str, header: Header, *, line: int, layout: Layout, path: Path) -> ReaderError:
    """The error for a cell that is no number.

    Args:
        cell: Its text.
        header: Of its column.
        line: Its line.
        layout: How numbers are written.
        path: The file.

    Returns:
        The error to raise where the column is asked for.
    """
    thousands = f" and thousands {layout.numbers.thousands!r}" if layout.numbers.thousands else ""
    return ReaderError(
        "a cell is not a number",
        where=f"{path}, line {line}, column {header.name}",
        expected=f"a number with decimal {layout.numbers.decimal!r}{thousands}",
        got=repr(cell),
        remedy=_remedy(cell.strip()),
    )


def _remedy(cell: str) -> str:
    if (cell.count(".") > 1 or cell.count(",") > 1) and any(map(str.isdigit, cell)):
        mark = "." if cell.count(".") > 1 else ","
        return (
            f"say what the marks mean: thousands: '{mark}' if they all separate thousands, "
            f"and decimal: '{mark}' beside it if the last one is the decimal mark"
        )
    if ":" in cell or cell.count("-") > 1 or cell.count("/") > 1:
        return "if this is calendar time, write time: {column: ..., unit: datetime}"
    if any(letter.isdigit() for letter in cell):
        return "correct the cell, or name the decimal mark (decimal: ',')"
    return f"if it stands for a missing value, write missing: ['{cell}']; if for a state, states: {{'{cell}': 0}}"
