"""The sheets of a workbook as lines of text, so that they are read as any other table of text is.

A cell is written so that nothing of it is lost: numbers with all their digits, dates and times of day as ISO 8601 has
them, durations as hours, minutes and seconds. Line numbers are those of the sheet.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sysid.ingest.readers.text_source import HEAD_LINES, Block

SEPARATOR = "\t"
NO_COMMENT = "\x01"
"""What no cell begins with: a sheet has no comments, and ``#N/A`` is an error."""
UNCOMPUTED = "="
"""What stands in place of the value of a formula that the file holds none for."""

_ERRORS = re.compile(r"#(?:N/A|NV|NAME\?|NULL!|NUM!|ZAHL!|REF!|BEZUG!|VALUE!|WERT!|DIV/0!|SPILL!|CALC!)")
_COMMA = re.compile(r"[+-]?(?:[0-9]{1,3}(?:\.[0-9]{3})+|[0-9]*),[0-9]+(?:[eE][+-]?[0-9]+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
_EPOCHS = (datetime.datetime(1899, 12, 31), datetime.datetime(1899, 12, 30))  # Excel has a 29 February 1900
_LEAP = datetime.datetime(1900, 3, 1)
_ELAPSED_BEFORE = 1901
"""Dates before are no dates: what is counted are days since an event."""
_BLOCK_LINES = 50_000
_EXACT = 1e15

Rows = list[Sequence[Any]]


@dataclass(kw_only=True)
class Sheet:
    """A sheet as it stands in its workbook.

    Args:
        name: Its name.
        rows: Its cells.
        hidden: Whether Excel does not show it.
    """

    name: str
    rows: Rows
    hidden: bool = False


@dataclass(kw_only=True)
class SheetText:
    """The cells of a sheet as a file of text; see :class:`~sysid.ingest.readers.text_source.TextFile`.

    Args:
        path: The workbook and the sheet, for messages.
        lines: A line a row, cells between tabs.
        notes: What was made of cells.
    """

    path: Path
    lines: list[str]
    notes: list[str] = field(default_factory=list)
    encoding: str = "utf-8"

    @property
    def size(self) -> int:
        """About how many bytes it has."""
        return sum(map(len, self.lines)) + len(self.lines)

    def head(self) -> tuple[list[str], bool]:
        """Its first lines, and whether these are all."""
        return self.lines[:HEAD_LINES], len(self.lines) <= HEAD_LINES

    def blocks(self, *, skip: int = 0) -> Generator[Block]:
        """Its lines, some thousands at a time."""
        for first in range(skip, len(self.lines), _BLOCK_LINES):
            part = self.lines[first : first + _BLOCK_LINES]
            yield Block(line=first + 1, lines=len(part), data="".join(f"{line}\n" for line in part).encode())


def as_text(sheet: Sheet, path: Path, decimal: str | None) -> SheetText:
    """A sheet as text.

    Args:
        sheet: The sheet.
        path: Its workbook.
        decimal: The decimal mark of numbers that are typed as text; ``None`` tells it by each column.

    Returns:
        Its lines, without columns in which nothing stands.
    """
    rows = sheet.rows
    width = max((len(row) for row in rows), default=0)
    columns = [[row[at] if at < len(row) else None for row in rows] for at in range(width)]
    texts, errors, commas = [], 0, 0
    for cells in columns:
        if all(_empty(cell) for cell in cells):
            continue
        errors += sum(isinstance(cell, str) and _ERRORS.fullmatch(cell.strip()) is not None for cell in cells)
        typed = decimal is None and _typed_with_commas(cells)
        commas += typed
        texts.append(_texts(cells, decimal or ".", typed=typed))
    lines = [SEPARATOR.join(row) if any(row) else "" for row in zip(*texts, strict=True)]
    notes = [f"{errors} {'cell holds an error' if errors == 1 else 'cells hold errors'} of Excel: missing values"]
    told = (
        f"{commas} {'column of numbers is text' if commas == 1 else 'columns of numbers are text'} with decimal comma"
    )
    return SheetText(
        path=Path(f"{path}, sheet {sheet.name}"), lines=lines, notes=notes * bool(errors) + [told] * bool(commas)
    )


def _empty(cell: Any) -> bool:
    return cell is None or (isinstance(cell, str) and not cell.strip()) or cell != cell  # noqa: PLR0124 - NaN, NaT


def _typed_with_commas(cells: Sequence[Any]) -> bool:
    """Whether numbers of a column are texts with a decimal comma: marks of thousands look like it, if all do."""
    found = [cell.strip() for cell in cells if isinstance(cell, str) and _COMMA.fullmatch(cell.strip())]
    return not all(_THOUSANDS.fullmatch(text) for text in found)


def _texts(cells: Sequence[Any], decimal: str, *, typed: bool) -> list[str]:
    dates = [cell for cell in cells if isinstance(cell, datetime.datetime) and cell.year >= _ELAPSED_BEFORE]
    whole_days = all(date.time() == datetime.time() for date in dates)

    def text(cell: Any) -> str:
        if isinstance(cell, float):
            shown = str(int(cell)) if cell.is_integer() and abs(cell) < _EXACT else repr(cell)
            return ("" if cell != cell else shown) if decimal == "." else shown.replace(".", decimal)  # noqa: PLR0124 - NaN
        if isinstance(cell, str):
            return _plain(cell, typed=typed)
        if cell is None:
            return ""
        if isinstance(cell, bool | int):
            return str(int(cell))
        if isinstance(cell, datetime.datetime) and cell.year >= _ELAPSED_BEFORE:
            return str(cell.date()) if whole_days else str(cell)
        elapsed = _elapsed(cell)
        return str(cell) if elapsed is None else elapsed

    return [text(cell) for cell in cells]


def _plain(cell: str, *, typed: bool) -> str:
    text = " ".join(cell.split())
    if text.startswith("#") and _ERRORS.fullmatch(text):
        return ""
    if typed and _COMMA.fullmatch(text):
        return text.replace(".", "").replace(",", ".")
    return '"' + text.replace('"', '""') + '"' if '"' in text else text


def _elapsed(cell: Any) -> str | None:
    """A time of day or a duration as hours, minutes and seconds; ``None`` for anything else."""
    if isinstance(cell, datetime.datetime):
        cell = cell - _EPOCHS[cell >= _LEAP]
    elif isinstance(cell, datetime.time):
        cell = datetime.timedelta(
            hours=cell.hour, minutes=cell.minute, seconds=cell.second, microseconds=cell.microsecond
        )
    if not isinstance(cell, datetime.timedelta) or cell < datetime.timedelta(0):
        return None
    seconds = cell.days * 86_400 + cell.seconds
    fraction = f".{cell.microseconds:06d}" if cell.microseconds else ".0"
    return f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}{fraction}"
