"""Workbooks of Excel, ``.xlsx`` and ``.xls``, by openpyxl and xlrd (the extra ``excel``).

In each sheet the header is the last row before the numbers, with a row of units between them if there is one.
"""

from __future__ import annotations

import datetime
import io
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.extras import need
from sysid.ingest.headers import Header, is_unit, parse_header, split_reference
from sysid.ingest.options import FileOptions, RepairOptions
from sysid.ingest.readers.bounds import check_zip, too_large
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.table import RawColumn, RawTable, RecordChoice, array_column, distinct, recognise_time

_ZIP, _OLD = b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_MOST_CELLS = 40_000_000
_FIRST = (b"[Content_Types].xml", b"_rels/", b"docProps/", b"xl/")


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    with path.open("rb") as file:
        modern = file.read(4) == _ZIP
    engine = "openpyxl" if modern else "xlrd"
    need(engine, f"reading {path.name}")
    sheets = _sheets(path, engine)
    tables: dict[str, RawTable] = {}
    problem: ReaderError | None = None
    for name, cells in sheets.items():
        try:
            tables[name] = _table(path, name, cells)
        except ReaderError as error:
            problem = problem or error
    if options.sheet is not None and options.sheet not in sheets:
        raise ReaderError(
            f"there is no sheet {options.sheet}",
            where=path,
            expected=f"one of {', '.join(sheets)}",
            got=options.sheet,
            remedy="correct sheet",
        )
    if not tables or (options.sheet is not None and options.sheet not in tables):
        raise problem or damaged(path, "Excel", ValueError("it has no sheets"))
    chosen = tables[options.sheet or next(iter(tables))]
    return chosen if options.sheet is not None or len(sheets) == 1 else _with_records(chosen, tables)


def _is_mine(head: bytes) -> bool:
    length = int.from_bytes(head[26:28], "little")
    return head.startswith(_OLD) or (head.startswith(_ZIP) and head[30 : 30 + length].startswith(_FIRST))


READER = Reader(
    name="excel",
    suffixes=(".xlsx", ".xls", ".xlsm"),
    read=_read,
    options=frozenset({"sheet"}),
    is_mine=_is_mine,
)


def _sheets(path: Path, engine: str) -> dict[str, NDArray[Any]]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about styles and such, which are nothing to us
            sheets = _modern(path) if engine == "openpyxl" else _old(path)
    except ReaderError:
        raise
    except Exception as error:  # xlrd and openpyxl raise classes of their own and any others on damaged files
        raise damaged(path, "Excel", error) from error
    for name, rows in sheets.items():
        cells = len(rows) * max((len(row) for row in rows), default=0)
        if cells > _MOST_CELLS:
            raise too_large(path, f"{cells:.3g} cells in the sheet {name}", 8 * _MOST_CELLS)
    return {name: _grid(rows) for name, rows in sheets.items()}


def _modern(path: Path) -> dict[str, list[Sequence[Any]]]:
    import openpyxl

    check_zip(path)
    with path.open("rb") as file:  # by name it would refuse whatever ends in anything else
        book = openpyxl.load_workbook(file, read_only=True, data_only=True)
        sheets: dict[str, list[Sequence[Any]]] = {}
        for sheet in book.worksheets:
            sheet.reset_dimensions()  # some writers state them wrongly
            sheets[sheet.title] = list(sheet.iter_rows(values_only=True))
        book.close()
    return sheets


def _old(path: Path) -> dict[str, list[Sequence[Any]]]:
    import xlrd

    with xlrd.open_workbook(str(path), on_demand=True, logfile=io.StringIO()) as book:

        def value(cell: Any) -> Any:
            if cell.ctype == xlrd.XL_CELL_DATE:
                return xlrd.xldate_as_datetime(cell.value, book.datemode)
            return None if cell.ctype in {xlrd.XL_CELL_EMPTY, xlrd.XL_CELL_BLANK, xlrd.XL_CELL_ERROR} else cell.value

        return {
            name: [[value(cell) for cell in row] for row in book.sheet_by_name(name).get_rows()]
            for name in book.sheet_names()
        }


def _grid(rows: list[Sequence[Any]]) -> NDArray[Any]:
    grid = np.full((len(rows), max((len(row) for row in rows), default=0)), None, dtype=object)
    for at, row in enumerate(rows):
        grid[at, : len(row)] = row
    return grid


def _with_records(chosen: RawTable, tables: dict[str, RawTable]) -> RawTable:
    alike = {name: table for name, table in tables.items() if table.names == chosen.names}
    records = tuple(RecordChoice(name=name, options={"sheet": name}, table=table) for name, table in alike.items())
    first = next(iter(alike))
    told = f"{len(tables)} sheets with numbers, of which {first} was read" if len(tables) > 1 else f"sheet {first}"
    settings = {"sheet": first} if len(records) < 2 else {}
    return replace(chosen, notes=(told, *chosen.notes), records=records if len(records) > 1 else (), settings=settings)


def _table(path: Path, sheet: str, cells: NDArray[Any]) -> RawTable:
    where = f"{path}, sheet {sheet}"
    filled = np.array([[not _empty(cell) for cell in row] for row in cells], dtype=bool).reshape(cells.shape)
    numbers = np.array([[_is_number(cell) for cell in row] for row in cells], dtype=bool).reshape(cells.shape)
    share = numbers.sum(axis=1) >= np.maximum(1, filled.sum(axis=1) / 2)
    first = next((row for row in np.flatnonzero(share) if share[row : row + 2].all() and row + 1 < len(cells)), None)
    if first is None:
        raise ReaderError(
            "the sheet holds no table of numbers",
            where=where,
            expected="a header row and rows of numbers below it",
            got=f"{len(cells)} rows",
            remedy="name the sheet that holds the record (sheet: ...), or save it as CSV",
        )
    used = np.flatnonzero(filled[first:].any(axis=0))
    headers, titles = _headers(cells, int(first), used)
    # A line below the numbers has text where they have none: the table ends above it.
    texts = (filled & ~numbers)[:, numbers[first]].any(axis=1)
    last = int(np.flatnonzero(filled[:, used].any(axis=1) & ~texts).max()) + 1
    below = int(filled[last:].any(axis=1).sum())
    columns, renamed = distinct(
        [_column(header, cells[first:last, at], where=where) for header, at in zip(headers, used, strict=True)]
    )
    notes = tuple(
        f"{count} {'line' if count == 1 else 'lines'} {where_} the table passed over"
        for count, where_ in ((titles, "above"), (below, "below"))
        if count
    )
    return RawTable(
        source=path,
        reader="excel",
        columns=tuple(columns),
        time=recognise_time(columns),
        lines=np.arange(first, last, dtype=np.int64) + 1,
        notes=(*notes, *renamed),
    )


def _headers(cells: NDArray[Any], first: int, used: NDArray[np.intp]) -> tuple[list[Header], int]:
    """Names and units from the rows above the numbers, and how many rows above them are passed over."""
    above = first - 1
    texts = [_text(cells[above, at]) for at in used] if above >= 0 else []
    units: list[str] = []
    if texts and above > 0 and all(is_unit(text.strip("[]() ")) for text in texts if text) and any(texts):
        units = [text.strip("[]() ") for text in texts]
        above -= 1
        texts = [_text(cells[above, at]) for at in used]
    headers = []
    for index in range(len(used)):
        header = parse_header(texts[index]) if index < len(texts) and texts[index] else None
        header = header or Header(name=f"column_{index + 1}")
        if units and units[index]:
            unit, reference = split_reference(units[index])
            header = Header(name=header.name, unit=unit, reference=reference or header.reference)
        headers.append(header)
    return headers, max(above, 0)


def _column(header: Header, cells: NDArray[Any], *, where: str) -> RawColumn:
    return array_column(header.name, _values(cells), where=where, unit=header.unit, reference=header.reference)


def _values(cells: NDArray[Any]) -> NDArray[Any]:
    """Cells as numbers, as dates and times, or as they are."""
    known = [cell for cell in cells if not _empty(cell)]
    if all(isinstance(cell, bool | int | float | np.number) for cell in known):
        return np.array([np.nan if _empty(cell) else float(cell) for cell in cells])
    if all(isinstance(cell, datetime.datetime) for cell in known):
        return np.array([None if _empty(cell) else cell for cell in cells], dtype="datetime64[us]")
    if all(isinstance(cell, datetime.time) for cell in known):
        return np.array([np.nan if _empty(cell) else _of_day(cell) for cell in cells])
    return np.array([str(cell) for cell in cells], dtype=np.str_)


def _of_day(time: datetime.time) -> float:
    return 3600.0 * time.hour + 60.0 * time.minute + time.second + 1e-6 * time.microsecond


def _text(cell: Any) -> str:
    return "" if _empty(cell) else str(cell).strip()


def _empty(cell: Any) -> bool:
    return cell is None or cell == "" or (isinstance(cell, str) and not cell.strip()) or cell != cell  # noqa: PLR0124 - NaN, NaT


def _is_number(cell: Any) -> bool:
    return isinstance(cell, int | float | np.number | datetime.datetime | datetime.time) and not _empty(cell)
