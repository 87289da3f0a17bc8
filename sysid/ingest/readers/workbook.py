"""Workbooks of Excel, ``.xlsx`` and ``.xls``, by openpyxl and xlrd (the extra ``excel``).

Each sheet is read as the table of text that it is: header, units, words, dates and times as in a CSV file.
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

from sysid.errors import ReaderError
from sysid.extras import need
from sysid.ingest.readers.bounds import check_zip, too_large
from sysid.ingest.readers.csv.text import table_of_text
from sysid.ingest.readers.marks import ZIP
from sysid.ingest.readers.reader import damaged
from sysid.ingest.readers.sheets import NO_COMMENT, SEPARATOR, UNCOMPUTED, Rows, Sheet, as_text
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable, RecordChoice

_MOST_CELLS = 40_000_000


def read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:
    """The table of a workbook.

    Args:
        path: The file.
        options: How it is read.
        repairs: Of its text.

    Returns:
        The sheet with the most numbers, or the one that is asked for; sheets of the same columns are records.

    Raises:
        ReaderError: If no sheet is a table, or there is none of the name.
        MissingExtraError: If the package that opens it is not installed.
    """
    with path.open("rb") as file:
        modern = file.read(4) == ZIP
    engine = "openpyxl" if modern else "xlrd"
    need(engine, f"reading {path.name}")
    sheets = _sheets(path, engine)
    names = [sheet.name for sheet in sheets]
    if options.sheet is not None and options.sheet not in names:
        raise ReaderError.unknown(
            f"there is no sheet {options.sheet}", options.sheet, names, "correct sheet", where=path
        )
    tables: dict[str, RawTable] = {}
    problem: ReaderError | None = None
    shown = [sheet for sheet in sheets if not sheet.hidden] or sheets
    for sheet in [s for s in sheets if s.name == options.sheet] if options.sheet is not None else shown:
        try:
            tables[sheet.name] = _table(sheet, path, options, repairs)
        except ReaderError as error:
            problem = problem or error
    if not tables:
        raise problem or damaged(path, "Excel", ValueError("it has no sheets"))
    return next(iter(tables.values())) if len(sheets) == 1 or options.sheet is not None else _of_sheets(tables, sheets)


def _sheets(path: Path, engine: str) -> list[Sheet]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about styles and such, which are nothing to us
            sheets = _modern(path) if engine == "openpyxl" else _counted(path, _old(path))
    except ReaderError:
        raise
    except Exception as error:  # xlrd and openpyxl raise classes of their own and any others on damaged files
        raise (_locked(path) if _is_locked(path) else damaged(path, "Excel", error)) from error
    return sheets


def _counted(path: Path, sheets: list[Sheet]) -> list[Sheet]:
    """The sheets of a workbook, none of which has so many cells that only to look into each takes a minute."""
    for sheet in sheets:
        cells = len(sheet.rows) * max((len(row) for row in sheet.rows), default=0)
        if cells > _MOST_CELLS:
            raise too_large(path, f"{cells:.3g} cells in the sheet {sheet.name}", 8 * _MOST_CELLS)
    return sheets


def _is_locked(path: Path) -> bool:
    with path.open("rb") as file:
        return "EncryptedPackage".encode("utf-16-le") in file.read(2**20)


def _locked(path: Path) -> ReaderError:
    return ReaderError(
        "the workbook is encrypted",
        where=path,
        expected="a workbook without a password",
        got="an encrypted package",
        remedy="open it in Excel with its password, and save a copy without one, or the sheet as CSV",
    )


def _modern(path: Path) -> list[Sheet]:
    check_zip(path)
    sheets = _counted(path, _cells(path, values=True))
    if any(_has_bare_header(sheet.rows) for sheet in sheets):
        # A program that writes formulas and does not compute them leaves their cells without values.
        for sheet, formulas in zip(sheets, _cells(path, values=False), strict=True):
            sheet.rows = [_marked(row, asked) for row, asked in zip(sheet.rows, formulas.rows, strict=True)]
    return sheets


def _cells(path: Path, *, values: bool) -> list[Sheet]:
    import openpyxl

    with path.open("rb") as file:  # by name it would refuse whatever ends in anything else
        book = openpyxl.load_workbook(file, read_only=True, data_only=values)
        sheets = []
        for sheet in book.worksheets:
            sheet.reset_dimensions()  # some writers state them wrongly
            rows: Rows = list(sheet.iter_rows(values_only=True))
            sheets.append(Sheet(name=sheet.title, rows=rows, hidden=sheet.sheet_state != "visible"))
        book.close()
    return sheets


def _has_bare_header(rows: Rows) -> bool:
    """Whether a column has text at its head and nothing below it."""
    width = max((len(row) for row in rows), default=0)
    for at in range(width):
        cells = [row[at] for row in rows if at < len(row) and row[at] is not None]
        if len(rows) > 2 and 0 < len(cells) <= 2 and isinstance(cells[-1], str):
            return True
    return False


def _marked(values: Sequence[Any], formulas: Sequence[Any]) -> list[Any]:
    return [
        UNCOMPUTED if value is None and isinstance(formula, str) and formula.startswith("=") else value
        for value, formula in zip(values, formulas, strict=True)
    ]


def _old(path: Path) -> list[Sheet]:
    import xlrd

    with xlrd.open_workbook(str(path), on_demand=True, logfile=io.StringIO()) as book:

        def value(cell: Any) -> Any:
            if cell.ctype == xlrd.XL_CELL_DATE:
                # Without a day it is a time of day, whichever year the workbook counts from.
                days = cell.value
                return datetime.timedelta(days=days) if days < 1.0 else xlrd.xldate_as_datetime(days, book.datemode)
            if cell.ctype == xlrd.XL_CELL_ERROR:
                return "#N/A"
            return None if cell.ctype in {xlrd.XL_CELL_EMPTY, xlrd.XL_CELL_BLANK} else cell.value

        sheets = [book.sheet_by_name(name) for name in book.sheet_names()]
        return [
            Sheet(name=s.name, rows=[[value(cell) for cell in row] for row in s.get_rows()], hidden=s.visibility != 0)
            for s in sheets
        ]


def _table(sheet: Sheet, path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:
    text = as_text(sheet, path, options.decimal)
    decimal = options.decimal or "."
    asked = options.model_copy(update={"separator": SEPARATOR, "comment": NO_COMMENT, "decimal": decimal})
    table = table_of_text(text, asked, repairs)
    kept = {key: table.settings[key] for key in ("calendar", "zone", "decimal") if key in table.settings}
    columns = tuple(_computed(column, text.path) for column in table.columns)
    return replace(
        table, source=path, reader="excel", columns=columns, notes=(*table.notes, *text.notes), settings=kept
    )


def _computed(column: RawColumn, where: Path) -> RawColumn:
    """A column as it is, or refused where its formulas have no values in the file."""
    if column.words is None or UNCOMPUTED not in column.words.texts:
        return column
    problem = ReaderError(
        "the column holds formulas that the file has no values for",
        where=f"{where}, column {column.name}",
        expected="numbers, or formulas with the values that they had when the file was saved",
        got="formulas alone, as programs write them that do not compute",
        remedy="open the file in Excel or LibreOffice and save it there, or save the sheet as CSV",
    )
    return replace(column, problem=problem, words=None)


def _of_sheets(tables: dict[str, RawTable], sheets: Sequence[Sheet]) -> RawTable:
    """The sheet with the most numbers, and those of the same columns as records."""
    first = max(tables, key=lambda name: _numbers(tables[name]))
    chosen = tables[first]
    alike = {name: table for name, table in tables.items() if table.names == chosen.names}
    told = [f"{len(tables)} sheets with numbers, of which {first} was read" if len(tables) > 1 else f"sheet {first}"]
    hidden = [sheet.name for sheet in sheets if sheet.hidden and sheet.name not in tables]
    if hidden:
        told.append(f"hidden and left out: {', '.join(hidden)} (sheet: reads one)")
    records = tuple(RecordChoice(name=name, options={"sheet": name}, table=table) for name, table in alike.items())
    if len(records) < 2:
        settings = {**chosen.settings, "sheet": first}
        return replace(chosen, notes=(*told, *chosen.notes), settings=settings)
    return replace(tables[next(iter(alike))], notes=(*told, *chosen.notes), records=records)


def _numbers(table: RawTable) -> int:
    return sum(int(np.isfinite(column.values).sum()) for column in table.columns)
