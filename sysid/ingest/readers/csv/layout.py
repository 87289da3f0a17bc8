"""What a text file does not say about itself: separator, decimal mark, where the numbers begin, and their header.

The numbers are found first: the rows that go on, of one width and one kind in each column. The header is the last
line before them, a line of units aside; what stands above it is a preamble.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sysid.errors import ReaderError
from sysid.ingest.cells.numbers import NumberFormat
from sysid.ingest.readers.csv.cells import (
    Kind,
    Row,
    kind_of,
    suffix_of,
    trimmed,
)
from sysid.ingest.readers.csv.header import header_of, labelled_header
from sysid.ingest.readers.csv.split import SEPARATORS, Split, best_split, first_row
from sysid.ingest.tables.options import FileOptions

_SEP_LINE = re.compile(r'"?sep=(?P<mark>.)"?\s*', re.IGNORECASE)
_COMMA = re.compile(r"[+-]?[0-9]*(?:[.' ][0-9]{3})*,[0-9]+(?:[eEdD][+-]?[0-9]+)?")
_POINT = re.compile(r"[+-]?[0-9]*(?:[,' ][0-9]{3})*\.[0-9]+(?:[eEdD][+-]?[0-9]+)?")


@dataclass(frozen=True, kw_only=True)
class Layout:
    """How a text file is laid out.

    Args:
        separator: What stands between cells; a blank is a run of blanks.
        numbers: How numbers are written.
        names: Texts of the header, one a column; empty where there is none.
        units: Texts of the line of units, or ``None``.
        kinds: What each column holds, as far as its first rows tell.
        skip: How many lines stand before the first row of numbers.
        header: Line of the header, or ``None``.
        preamble: Rows before the header.
        comments: Comments before the numbers, without their mark.
        suffixes: The unit behind every number of a column, or the empty text.
        notes: What was recognised and should be told.
        labels: How many columns at the left hold words about the record beside its first rows.
    """

    separator: str
    numbers: NumberFormat
    names: tuple[str, ...]
    units: tuple[str, ...] | None
    kinds: tuple[Kind, ...]
    skip: int
    header: int | None
    preamble: tuple[Row, ...]
    comments: tuple[str, ...]
    suffixes: tuple[str, ...]
    notes: tuple[str, ...] = ()
    labels: int = 0


def recognise(lines: Sequence[str], options: FileOptions, path: Path, *, whole: bool) -> Layout:
    """The layout of a text file; what the options say is not guessed.

    Args:
        lines: Its first lines, without their ends.
        options: What is known already.
        path: The file, for errors.
        whole: Whether these are all its lines.

    Returns:
        The layout.

    Raises:
        ReaderError: If there are no numbers, the decimal mark cannot be told, or there are too many columns.
    """
    lines, told = _without_marks(lines, options)
    comments = [
        (i + 1, t[len(options.comment) :].strip()) for i, t in enumerate(lines) if t.startswith(options.comment)
    ]
    split = best_split(lines, options.separator or told, options, path, whole=whole)
    first = first_row(split, options)
    numbers = NumberFormat(
        decimal=options.decimal or _decimal(split.run(first), path, options),
        thousands=options.thousands,
        missing=options.missing,
    )
    top = split.rows[first].first_line - 1
    above = [(line, text) for line, text in comments if line <= top]
    header = labelled_header(split, first) or header_of(split, first, above, options)
    above_header = [row for row in split.rows[:first] if header.line is None or row.line < header.line]
    preamble = [row for row in above_header if row.line != header.units_line]
    if preamble:
        shown = split.separator.join(preamble[0].cells).replace("\t", " ").strip()[:60]
        header.notes.append(f"{_lines(len(preamble))} before the header left out, the first: {shown!r}")
    return Layout(
        separator=split.separator,
        numbers=numbers,
        names=tuple(header.names),
        units=None if header.units is None else tuple(header.units),
        kinds=split.kinds,
        skip=top,
        header=header.line,
        preamble=tuple(preamble),
        comments=(*(text for _, text in above), *header.said),
        suffixes=_suffixes(split, first),
        notes=tuple(header.notes),
        labels=header.labels,
    )


def _lines(count: int) -> str:
    return "1 line" if count == 1 else f"{count} lines"


def _without_marks(lines: Sequence[str], options: FileOptions) -> tuple[list[str], str | None]:
    """The lines with those to be skipped made blank, and the separator that a first line ``sep=;`` names."""
    kept = ["" if i < options.skip_lines else text for i, text in enumerate(lines)]
    for index, text in enumerate(kept):
        match = _SEP_LINE.fullmatch(text)
        if match:
            kept[index] = ""
            return kept, match["mark"] if match["mark"] in SEPARATORS else None
        if text.strip():
            break
    return kept, None


def _suffixes(split: Split, first: int) -> tuple[str, ...]:
    rows = [trimmed(row.cells, split.width) for row in split.run(first)]

    def suffix(index: int) -> str:
        cells = (row[index].strip() for row in rows)
        suffixes = (suffix_of(cell) for cell in cells if cell and kind_of(cell) is Kind.NUMBER)
        one = next(suffixes, "")
        return one if one and all(other == one for other in suffixes) else ""  # most numbers have none: one tells

    return tuple(suffix(index) for index in range(split.width))


def _decimal(rows: Sequence[Row], path: Path, options: FileOptions) -> str:
    if options.thousands == ",":
        return "."
    commas, points = (
        {bare: row for row in rows for cell in row.cells if mark in cell and form.fullmatch(bare := _bare(cell))}
        for mark, form in ((",", _COMMA), (".", _POINT))
    )
    shown = _shown(commas, points)
    if commas and points and options.thousands is None and shown is None:
        first, other = next(iter(commas.values())), next(iter(points.values()))
        raise ReaderError(
            "the file holds numbers with a decimal comma and numbers with a decimal point",
            where=f"{path}, lines {first.line} and {other.line}",
            expected="one decimal mark",
            got=f"{first.cells} and {other.cells}",
            remedy="name it (decimal: ',' or decimal: '.'), and what separates thousands (thousands: '.')",
        )
    return shown or ("," if commas else ".")


def _bare(cell: str) -> str:
    """A number without the unit behind it."""
    text = cell.strip()
    return text.removesuffix(suffix_of(text)).rstrip() if text[-1:].isalpha() or text[-1:] in "%°" else text


def _shown(commas: Iterable[str], points: Iterable[str]) -> str | None:
    """The decimal mark that a number with both marks shows, ``4.000,00``, where all others go with it: ``800.000``."""
    for mark, other, decimal, grouped in ((",", ".", commas, points), (".", ",", points, commas)):
        both = any(other in text for text in decimal)
        if both and all(re.fullmatch(rf"[+-]?[0-9]{{1,3}}(?:{re.escape(other)}[0-9]{{3}})+", one) for one in grouped):
            return mark
    return None
