"""Workbooks: titles, dates, lines below the table, sheets."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, read_table
from tests.ingest.readers.zoo_binary import TIME, U, Y, workbook


def test_dates_and_lines_below_the_table(tmp_path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append([None, "Zeit", "u [V]", "y [m]"])
    begin = datetime.datetime(2024, 5, 1, 10, tzinfo=None)
    for t, u, y in zip(TIME.tolist(), U.tolist(), Y.tolist(), strict=True):
        book.active.append([None, begin + datetime.timedelta(seconds=t), u, y])
    book.active.append([])
    book.active.append([None, "Mean", 2.0, 1.5])
    book.save(tmp_path / "a.xlsx")
    table = read_table(tmp_path / "a.xlsx")
    assert (table.names, table.time, table.notes) == (
        ("Zeit", "u", "y"),
        "Zeit",
        ("1 line after the numbers left out, the first, line 23: 'Mean 2 1.5'",),
    )
    np.testing.assert_allclose(table.find("Zeit").values, TIME, atol=1e-6)
    np.testing.assert_allclose(table.find("y").values, Y, rtol=1e-14)


def test_a_cell_that_is_no_number_is_told_when_it_is_asked_for(tmp_path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    for row in (["t", "u", "state"], [0.0, 1.0, "on"], [0.1, 2.0, "off"], [0.2, None, "on"]):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    table = read_table(tmp_path / "a.xlsx")
    np.testing.assert_array_equal(table.find("u").values, [1.0, 2.0, np.nan])
    with pytest.raises(ReaderError, match="holds words"):
        table.find("state")


def test_sheets_are_chosen_by_name(tmp_path: Path) -> None:
    workbook("one", "two")(tmp_path / "a.xlsx")
    table = read_table(tmp_path / "a.xlsx")
    assert [record.options for record in table.records] == [{"sheet": "one"}, {"sheet": "two"}]
    assert read_table(tmp_path / "a.xlsx", files=FileOptions(sheet="two")).place(0) == "sample 0 (line 2)"
    with pytest.raises(ReaderError, match=r"(?s)no sheet 3.*one of one, two"):
        read_table(tmp_path / "a.xlsx", files=FileOptions(sheet="3"))
