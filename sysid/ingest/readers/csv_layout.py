"""What a CSV file does not say about itself: encoding, separator, decimal mark, header lines."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

from sysid.errors import ReaderError
from sysid.ingest.headers import is_unit
from sysid.ingest.numbers import NumberFormat
from sysid.ingest.options import FileOptions

_SAMPLE_ROWS = 400
_BOMS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass(frozen=True, kw_only=True)
class Row:
    """A row of cells and the line it stands on (the last one, if a cell holds line breaks)."""

    line: int
    cells: list[str]


@dataclass(frozen=True, kw_only=True)
class Layout:
    """How a CSV file is laid out.

    Args:
        separator: What stands between cells.
        numbers: How numbers are written.
        header: Whether the first row holds names.
        units_line: Whether the row after it holds units.
    """

    separator: str
    numbers: NumberFormat
    header: bool
    units_line: bool


def read_text(path: Path, encoding: str | None) -> tuple[str, str]:
    """A text file decoded.

    Args:
        path: The file.
        encoding: Its encoding, or ``None`` to recognise it: a byte-order mark, else UTF-8, else
            Windows-1252.

    Returns:
        The text and the encoding.

    Raises:
        ReaderError: If it is not text in that encoding.
    """
    raw = path.read_bytes()
    marked = next((name for bom, name in _BOMS if raw.startswith(bom)), None)
    tries = [encoding] if encoding is not None else [marked] if marked else ["utf-8", "cp1252"]
    problem: Exception | None = None
    for name in tries:
        try:
            text = raw.decode(name)
        except (UnicodeDecodeError, LookupError) as error:
            problem = error
            continue
        if "\x00" in text:
            problem = ValueError("it holds zero bytes")
            break
        # An encoding that was asked for may leave the mark in the text.
        return text.removeprefix("\ufeff"), name
    raise ReaderError(
        "the file is not text",
        where=path,
        expected=f"text in {' or '.join(tries)}",
        got=problem,
        remedy="check that it is a CSV file, or name its encoding (encoding: cp1252)",
    )


def split_rows(text: str, separator: str, *, options: FileOptions, path: Path) -> tuple[list[Row], list[str]]:
    """Cells of every row that is neither blank nor a comment.

    Args:
        text: The whole file.
        separator: What stands between cells.
        options: ``skip_lines`` and ``comment``.
        path: The file, for errors.

    Returns:
        The rows, and the comments without their mark.

    Raises:
        ReaderError: If quotes do not close or a cell is absurdly long.
    """
    lines = io.StringIO(text, newline="")
    for _ in range(options.skip_lines):
        lines.readline()
    comments: list[str] = []

    def without_comments() -> io.StringIO:
        # A comment becomes a blank line, so that the line numbers in messages stay those of the file.
        kept = []
        for line in lines:
            if line.startswith(options.comment):
                comments.append(line[len(options.comment) :].strip())
                kept.append("\n")
            else:
                kept.append(line)
        return io.StringIO("".join(kept), newline="")

    parser = csv.reader(without_comments(), delimiter=separator, strict=True)
    rows = []
    try:
        for cells in parser:
            if any(cell.strip() for cell in cells):
                rows.append(Row(line=parser.line_num + options.skip_lines, cells=cells))  # noqa: PERF401 - line_num moves with the loop
    except csv.Error as error:
        raise ReaderError(
            "the file cannot be split into cells",
            where=f"{path}, line {parser.line_num + options.skip_lines}",
            expected="cells between separators, quotes in pairs",
            got=error,
            remedy="correct the line, or name the separator",
        ) from error
    return rows, comments


def recognise(text: str, options: FileOptions, path: Path) -> Layout:
    """The layout of a CSV file; what the options say is not guessed.

    Args:
        text: The whole file.
        options: What is known already.
        path: The file, for errors.

    Returns:
        The layout.

    Raises:
        ReaderError: If the decimal mark cannot be told.
    """
    head = "".join(_head_lines(text, options))
    separator = options.separator or _separator(head, options, path)
    rows, _ = split_rows(head, separator, options=options.model_copy(update={"skip_lines": 0}), path=path)
    decimal = options.decimal or _decimal(rows, separator, path, options)
    numbers = NumberFormat(decimal=decimal, thousands=options.thousands, missing=options.missing)
    header = options.header if options.header is not None else bool(rows) and not _numeric(rows[0], numbers)
    second = rows[1] if header and len(rows) > 1 else None
    units_line = options.units_line if options.units_line is not None else second is not None and _is_units(second)
    return Layout(separator=separator, numbers=numbers, header=header, units_line=units_line)


def _head_lines(text: str, options: FileOptions) -> list[str]:
    lines = io.StringIO(text, newline="")
    for _ in range(options.skip_lines):
        lines.readline()
    kept: list[str] = []
    for line in lines:
        if not line.startswith(options.comment) and line.strip():
            kept.append(line)
        if len(kept) == _SAMPLE_ROWS:
            break
    return kept


def _separator(head: str, options: FileOptions, path: Path) -> str:
    # A tab or a semicolon that stands equally often in every row is one; a comma may be decimal.
    plain = options.model_copy(update={"skip_lines": 0})
    best, best_share = ",", 0.0
    for candidate in ("\t", ";", ","):
        try:
            rows, _ = split_rows(head, candidate, options=plain, path=path)
        except ReaderError:
            continue
        widths = [len(row.cells) for row in rows]
        usual = max(set(widths), key=widths.count, default=1)
        share = widths.count(usual) / len(widths) if usual > 1 else 0.0
        if share > best_share + 0.2:  # the earlier candidate wins unless a later one fits clearly better
            best, best_share = candidate, share
    return best


def _decimal(rows: list[Row], separator: str, path: Path, options: FileOptions) -> str:
    if separator == "," or options.thousands == ",":
        return "."
    with_comma = re.compile(r"[+-]?[0-9]*(?:[.'][0-9]{3})*,[0-9]+(?:[eE][+-]?[0-9]+)?")
    with_point = re.compile(r"[+-]?[0-9]*(?:[,'][0-9]{3})*\.[0-9]+(?:[eE][+-]?[0-9]+)?")
    commas = next((row for row in rows for cell in row.cells if with_comma.fullmatch(cell.strip())), None)
    points = next((row for row in rows for cell in row.cells if with_point.fullmatch(cell.strip())), None)
    if commas and points and options.thousands is None:
        raise ReaderError(
            "the file holds numbers with a decimal comma and numbers with a decimal point",
            where=f"{path}, lines {commas.line} and {points.line}",
            expected="one decimal mark",
            got=f"{commas.cells} and {points.cells}",
            remedy="name it (decimal: ',' or decimal: '.'), and what separates thousands (thousands: '.')",
        )
    return "," if commas else "."


def _numeric(row: Row, numbers: NumberFormat) -> bool:
    filled = [cell for cell in row.cells if cell.strip()]
    return any(numbers.parse(cell) is not None or _looks_numeric(cell) for cell in filled)


def _looks_numeric(cell: str) -> bool:
    # Even a number that this format refuses (1.003.000) does not make a row a header.
    return re.fullmatch(r"[+-]?[0-9][0-9.,' ]*", cell.strip()) is not None


def _is_units(row: Row) -> bool:
    filled = [cell.strip() for cell in row.cells if cell.strip()]
    return bool(filled) and all(is_unit(unit_text(cell)) for cell in filled)


def unit_text(cell: str) -> str:
    """The unit in a cell of a units line, without brackets.

    Args:
        cell: For example ``"[kPa]"``.

    Returns:
        For example ``"kPa"``.
    """
    text = cell.strip()
    return text[1:-1].strip() if text[:1] + text[-1:] in {"[]", "()"} else text
