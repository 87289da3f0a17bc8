"""Lines to cells, and what a cell looks like: a number, a time, a word, or nothing."""

from __future__ import annotations

import csv
import enum
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from sysid.errors import ReaderError
from sysid.ingest.cells.calendar import is_calendar
from sysid.ingest.cells.headers import is_unit
from sysid.ingest.cells.numbers import HEXADECIMAL, MISSING, usually_missing
from sysid.written_units import USUAL_UNITS

BLANKS = " "
"""The separator that stands for a run of blanks and tabs."""

MOST_LINES = 64
"""Lines of a table that lies on its side, at most: each is a channel."""


class Kind(enum.Enum):
    """What a cell looks like."""

    NUMBER = enum.auto()
    WHOLE = enum.auto()  # a whole number that float64 cannot hold, as a clock counts in nanoseconds
    TIME = enum.auto()
    WORD = enum.auto()
    NOTHING = enum.auto()

    __hash__ = object.__hash__  # of an enumeration it is written in Python, and asked for with every cell


DATA = frozenset({Kind.NUMBER, Kind.WHOLE, Kind.TIME})

_NUMBER = re.compile(
    r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+"
    r"|[0-9]{1,3}(?:[.,'\u2019 \u00a0\u2009\u202f][0-9]{3})+(?:[.,][0-9]*)?)(?:[eEdD][+-]?[0-9]+)?"
    r"|[+-]?(?i:inf(?:inity)?)"
)
_BRACKETED = re.compile(r"\([0-9][0-9.,'\u2019 ]*[0-9](?:[eE][+-]?[0-9]+)?\)")
"""A negative number, as accountants write it; ``(1)`` may be a unit."""
_WITH_UNIT = re.compile(r"[+-]?[0-9]*[.,]?[0-9]+(?:[eE][+-]?[0-9]+)?\s?(?P<unit>[A-Za-z%°][A-Za-z/^0-9°]{0,5})")
# Fortran's columns may touch where a number is negative: 1.0000E+00-2.0000E+00.
TOUCHING = re.compile(r"(?<=[0-9])-(?=[0-9]*\.[0-9])")
_WHOLE = re.compile(r"[+-]?[0-9]{16,19}")


SHORT = 32
"""Letters of a cell; longer ones are rows that were not taken apart."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """A row of cells and the line it stands on (the last one, if a cell holds line breaks)."""

    line: int
    cells: list[str]

    @property
    def first_line(self) -> int:
        """The line on which it begins."""
        return self.line - sum(cell.count("\n") for cell in self.cells)


def kind_of(cell: str, missing: Sequence[str] = ()) -> Kind:
    """What a cell looks like, whatever the decimal mark.

    Args:
        cell: Its text.
        missing: Texts that stand for a missing value in this file.

    Returns:
        The kind; what usually stands for a missing value is nothing.
    """
    if missing and cell.strip() in missing:
        return Kind.NOTHING
    return _usual_kind(cell) if len(cell) <= SHORT else _kind(cell)


def kinds_of(cells: Sequence[str], missing: Sequence[str] = ()) -> tuple[Kind, ...]:
    """What the cells of a row look like, as :func:`kind_of` tells of each.

    Args:
        cells: Their texts.
        missing: Texts that stand for a missing value in this file.

    Returns:
        The kinds.
    """
    if missing or max(map(len, cells), default=0) > SHORT:
        return tuple([kind_of(cell, missing) for cell in cells])
    return tuple(map(_usual_kind, cells))


def _kind(cell: str) -> Kind:
    """What it looks like in any file; nearly every cell is a number."""
    text = cell.strip()
    if _NUMBER.fullmatch(text):
        return Kind.WHOLE if _WHOLE.fullmatch(text) and not is_calendar(text) else Kind.NUMBER
    if text.casefold() in MISSING or usually_missing(text):
        return Kind.NOTHING
    if is_calendar(text):
        return Kind.TIME
    other = suffix_of(text) or HEXADECIMAL.fullmatch(text) or _BRACKETED.fullmatch(text)
    return Kind.NUMBER if other else Kind.WORD


_usual_kind = lru_cache(maxsize=16384)(_kind)
"""For short cells: a file is gone through for each separator that it may have, and more than once for that it has."""


def suffix_of(text: str) -> str:
    """The unit behind a number in a cell.

    Args:
        text: For example ``"12.5 V"``.

    Returns:
        For example ``"V"``; empty where there is none, or the text is no number with a usual unit.
    """
    match = _WITH_UNIT.fullmatch(text)
    return match["unit"] if match and (match["unit"] in USUAL_UNITS or match["unit"] in "%°°C°F") else ""


def trimmed(cells: list[str], width: int) -> list[str]:
    """A row brought to a width, where a separator more or less at its end is all that lacks.

    Args:
        cells: The row.
        width: The width of the table.

    Returns:
        The row, without empty cells beyond the width.
    """
    if len(cells) > width and not any(cell.strip() for cell in cells[width:]):
        return cells[:width]
    return cells


def split_rows(
    lines: Iterable[str],
    separator: str,
    *,
    line: int,
    comment: str,
    path: Path,
    whole: bool = True,
    width: int = 0,
) -> Iterator[Row]:
    """Cells of every row that is neither blank nor a comment.

    Args:
        lines: Lines with their ends.
        separator: What stands between cells; a blank stands for a run of blanks.
        line: Number of the first line.
        comment: What a comment line begins with.
        path: The file, for errors.
        whole: Whether a quote that does not close is an error; otherwise the rows before it are all.
        width: How many empty cells a row of separators alone is; with 0 it is a blank one.

    Yields:
        The rows.

    Raises:
        ReaderError: If quotes do not close or a cell is absurdly long.
    """
    # A comment becomes a blank line, so that the line numbers in messages stay those of the file.
    kept = ("\n" if text.startswith(comment) else text for text in lines)
    beside = re.compile(rf'(?<=")[ ]+(?={re.escape(separator)})|(?<={re.escape(separator)})[ ]+(?=")')
    if separator != BLANKS:  # blanks between a quote and a separator are no part of a cell
        kept = (beside.sub("", text) if '"' in text else text for text in kept)
    else:
        kept = (TOUCHING.sub(" -", text.replace("\t", " ").strip()) + "\n" for text in kept)
    parser = csv.reader(kept, delimiter=separator, strict=True, skipinitialspace=separator == BLANKS)
    try:
        for cells in parser:
            if any(map(str.strip, cells)):
                yield Row(line=parser.line_num + line - 1, cells=cells)
            elif width and len(cells) > 1:
                yield Row(line=parser.line_num + line - 1, cells=[""] * width)
    except csv.Error as error:
        if not whole and "unexpected end" in str(error):
            return
        raise ReaderError(
            "the file cannot be split into cells",
            where=f"{path}, line {parser.line_num + line - 1}",
            expected="cells between separators, quotes in pairs",
            got=error,
            remedy="correct the line, or name the separator",
        ) from error


def is_units(cells: Sequence[str]) -> bool:
    """Whether a row below the header is one of units: all in brackets, or at least half of them known.

    Args:
        cells: The row.

    Returns:
        True if it is.
    """
    filled = [cell.strip() for cell in cells if cell.strip()]
    known = sum(is_unit(unit_text(cell)) for cell in filled)
    bracketed = all(unit_text(cell) != cell for cell in filled)
    return bool(filled) and (bracketed or 2 * known >= len(filled))


def unit_text(cell: str) -> str:
    """The unit in a cell of a units line, without brackets.

    Args:
        cell: For example ``"[kPa]"``.

    Returns:
        For example ``"kPa"``.
    """
    text = cell.strip()
    return text[1:-1].strip() if text[:1] + text[-1:] in {"[]", "()", "<>", "{}"} else text
