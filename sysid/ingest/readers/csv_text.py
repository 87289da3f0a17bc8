"""CSV and its relatives: any of the usual separators and decimal marks, units in the header or below it.

Comments of the form ``# key: value`` before the header become metadata.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.calendar import seconds_since_first
from sysid.ingest.headers import Header, parse_header, split_reference
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.csv_layout import Layout, Row, read_text, recognise, split_rows, unit_text
from sysid.ingest.readers.reader import Reader
from sysid.ingest.table import RawColumn, RawTable, recognise_time


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:
    text, encoding = read_text(path, options.encoding)
    layout = recognise(text, options, path)
    rows, comments = split_rows(text, layout.separator, options=options, path=path)
    headers, body = _headers(rows, layout, options, path)
    body, notes = _regular(body, len(headers), repairs, path)
    if len(headers) > 1 and not headers[-1].name and not any(row.cells[len(headers) - 1].strip() for row in body):
        headers = headers[:-1]  # a separator at the end of every line
    lines = np.array([row.line for row in body], dtype=np.int64)
    calendar = _calendar_column(headers, options)
    columns = []
    for index, header in enumerate(headers):
        cells = [row.cells[index] for row in body]
        if index == calendar:
            where = f"{path}, column {header.name}"
            seconds = seconds_since_first(cells, options.time.format, lines=lines, where=where)
            columns.append(RawColumn(name=header.name, values=seconds, unit="s"))
        else:
            columns.append(_column(header, cells, layout=layout, lines=lines, path=path))
    if layout.numbers.decimal != ".":
        notes.append("decimal comma")
    return RawTable(
        source=path,
        reader="csv",
        columns=tuple(columns),
        time=columns[calendar].name if calendar is not None else recognise_time(columns),
        lines=lines,
        notes=tuple(notes),
        metadata=dict(_metadata(comments)),
        settings={
            "separator": layout.separator,
            "decimal": layout.numbers.decimal,
            "encoding": encoding,
            "header": layout.header,
            "units_line": layout.units_line,
        },
    )


READER = Reader(
    name="csv",
    suffixes=(".csv", ".tsv", ".txt", ".dat", ".asc"),
    read=_read,
    options=frozenset(
        {"separator", "decimal", "thousands", "comment", "encoding", "skip_lines", "header", "units_line"}
        | {"names", "missing"}
    ),
)


def _headers(rows: list[Row], layout: Layout, options: FileOptions, path: Path) -> tuple[list[Header], list[Row]]:
    if not rows:
        raise ReaderError(
            "the file holds no samples",
            where=path,
            expected="a header line and rows of numbers",
            got="no line that is neither blank nor a comment",
            remedy="check that the recording was saved, and the options comment and skip_lines",
        )
    width = len(rows[0].cells)
    texts = rows[0].cells if layout.header else [f"column_{index + 1}" for index in range(width)]
    if options.names is not None:
        texts = _given_names(options.names, rows[0], path)
    headers = [parse_header(text) for text in texts]
    body = rows[1:] if layout.header else rows
    if layout.header and layout.units_line and body:
        units = [split_reference(unit_text(cell)) for cell in body[0].cells]
        headers = [
            Header(name=header.name, unit=unit or header.unit, reference=reference or header.reference)
            for header, (unit, reference) in zip(headers, units, strict=False)
        ]
        body = body[1:]
    nameless = [index for index, header in enumerate(headers) if not header.name]
    if nameless and nameless != [len(headers) - 1]:
        raise ReaderError(
            f"column {nameless[0] + 1} has no name",
            where=f"{path}, line {rows[0].line}",
            expected="a name for each column",
            got=", ".join(repr(text) for text in texts),
            remedy="name it in the file, or give names: [...] for all columns",
        )
    return headers, body


def _given_names(names: Sequence[str], first: Row, path: Path) -> list[str]:
    filled = len(first.cells) - (1 if len(first.cells) > 1 and not first.cells[-1].strip() else 0)
    if len(names) not in {filled, len(first.cells)}:
        raise ReaderError(
            "names does not fit the columns",
            where=f"{path}, line {first.line}",
            expected=f"{len(first.cells)} names",
            got=f"{len(names)}: {', '.join(names)}",
            remedy="give one name per column of the file, in order",
        )
    return [*names, *[""] * (len(first.cells) - len(names))]


def _regular(body: list[Row], width: int, repairs: RepairOptions, path: Path) -> tuple[list[Row], list[str]]:
    if body and all(len(row.cells) == width + 1 and not row.cells[-1].strip() for row in body):
        return [Row(line=row.line, cells=row.cells[:width]) for row in body], []
    ragged = [row for row in body if len(row.cells) != width]
    if not ragged:
        return body, []
    if repairs.ragged == "drop":
        note = f"{len(ragged)} ragged rows dropped, first at line {ragged[0].line}"
        return [row for row in body if len(row.cells) == width], [note]
    raise ReaderError(
        f"{len(ragged)} rows have too many or too few cells",
        where=f"{path}, line {ragged[0].line}",
        expected=f"{width} cells, as in the header",
        got=f"{len(ragged[0].cells)} cells: {ragged[0].cells}",
        remedy="correct the line or the separator, or ask for repairs: {ragged: drop}",
    )


def _calendar_column(headers: Sequence[Header], options: FileOptions) -> int | None:
    """Index of the column of calendar time, if the options say that there is one."""
    if options.time.unit != "datetime":
        return None
    names = [header.name for header in headers]
    if options.time.column in names:
        return names.index(options.time.column)
    bare = [RawColumn(name=name, values=np.empty(0)) for name in names]
    recognised = recognise_time(bare) if options.time.column is None else None
    return names.index(recognised) if recognised else 0


def _column(header: Header, cells: Sequence[str], *, layout: Layout, lines: NDArray[np.int64], path: Path) -> RawColumn:
    values = layout.numbers.column(cells)
    problem = None
    if isinstance(values, int):
        problem = _not_a_number(cells[values], header, line=int(lines[values]), layout=layout, path=path)
        values = np.full(len(cells), np.nan)
    return RawColumn(name=header.name, values=values, unit=header.unit, reference=header.reference, problem=problem)


def _not_a_number(cell: str, header: Header, *, line: int, layout: Layout, path: Path) -> ReaderError:
    thousands = f" and thousands {layout.numbers.thousands!r}" if layout.numbers.thousands else ""
    return ReaderError(
        "a cell is not a number",
        where=f"{path}, line {line}, column {header.name}",
        expected=f"a number with decimal {layout.numbers.decimal!r}{thousands}",
        got=repr(cell),
        remedy=_remedy(cell.strip()),
    )


def _remedy(cell: str) -> str:
    if cell.count(".") > 1 or cell.count(",") > 1:
        mark = "." if cell.count(".") > 1 else ","
        return (
            f"say what the marks mean: thousands: '{mark}' if they all separate thousands, "
            f"and decimal: '{mark}' beside it if the last one is the decimal mark"
        )
    if ":" in cell or cell.count("-") > 1 or cell.count("/") > 1:
        return "if this is calendar time, write time: {column: ..., unit: datetime}"
    if any(letter.isdigit() for letter in cell):
        return "correct the cell, or name the decimal mark (decimal: ',')"
    return f"if it stands for a missing value, write missing: ['{cell}']"


def _metadata(comments: Sequence[str]) -> list[tuple[str, str]]:
    pairs = [comment.split(":", 1) for comment in comments if ":" in comment]
    return [(key.strip(), value.strip()) for key, value in pairs]
