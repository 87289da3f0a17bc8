"""CSV as it comes: separators, decimal marks, encodings, comments, unit lines, and their refusals."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, RepairOptions, inspect_file, propose_dataset, read_table, read_trace

Write = Callable[[str, str | bytes], Path]

READABLE = {
    "comma": "t [s],u [V]\n0.0,1.5\n0.1,-2.5\n",
    "semicolon and decimal comma": "t [s];u [V]\n0,0;1,5\n0,1;-2,5\n",
    "tab and decimal comma": "t [s]\tu [V]\n0,0\t1,5\n0,1\t-2,5\n",
    "CRLF": "t [s],u [V]\r\n0.0,1.5\r\n0.1,-2.5\r\n",
    "no newline at the end": "t [s],u [V]\n0.0,1.5\n0.1,-2.5",
    "comments": "# rig 3\n# by: me\nt [s],u [V]\n0.0,1.5\n# paused\n0.1,-2.5\n",
    "blank lines": "\n\nt [s],u [V]\n\n0.0,1.5\n \n0.1,-2.5\n\n",
    "units line": "t,u\ns,V\n0.0,1.5\n0.1,-2.5\n",
    "units line in brackets": "t;u\n[s];[V]\n0,0;1,5\n0,1;-2,5\n",
    "separator at the end of every line": "t [s],u [V],\n0.0,1.5,\n0.1,-2.5,\n",
    "separator at the end of every row but not of the header": "t [s],u [V]\n0.0,1.5,\n0.1,-2.5,\n",
    "quoted cells": '"t [s]","u [V]"\n"0.0","1.5"\n"0.1","-2.5"\n',
    "quoted cells with blanks between": '"t [s]" , "u [V]"\n"0.0" , "1.5"\n"0.1" ,  "-2.5"\n',
    "spaces around cells": "t [s] , u [V]\n 0.0 , 1.5\n 0.1 , -2.5\n",
}


@pytest.mark.parametrize("text", READABLE.values(), ids=READABLE)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_layout_is_recognised(write: Write, text: str, encoding: str) -> None:
    table = read_table(write("run.csv", text.encode(encoding)))
    assert [(column.name, column.unit) for column in table.columns] == [("t", "s"), ("u", "V")]
    assert [column.values.tolist() for column in table.columns] == [[0.0, 0.1], [1.5, -2.5]]
    assert table.time == "t"


def test_windows_encoding_is_recognised(write: Write) -> None:
    table = read_table(write("run.csv", "t [s];T [°C]\n0;20,5\n1;21,5\n".encode("cp1252")))
    assert (table.find("T").unit, table.settings["encoding"]) == ("degC", "cp1252")


def test_a_file_without_header_gets_numbered_columns(write: Write) -> None:
    table = read_table(write("run.csv", "0;1,5\n1;2,5\n"))
    assert (table.names, len(table), table.time) == (("column_1", "column_2"), 2, None)


def test_a_separator_at_the_end_of_every_line_makes_no_column(write: Write) -> None:
    assert read_table(write("run.dat", "0.1\t1.5\t\n0.2\t-2.5\t\n")).names == ("column_1", "column_2")


@pytest.mark.parametrize("times", [1, 20_000], ids=["row by row", "in bulk"])
def test_rows_of_separators_alone_are_no_lost_samples(write: Write, times: int) -> None:
    body = "1.5,2\n,\n2.5,3\n" * times + ",\n,\n"
    without = read_table(write("run.csv", "u [V],y\n" + body))
    assert without.find("u").values[:3].tolist() == pytest.approx([1.5, np.nan, 2.5], nan_ok=True)
    assert len(without) == 3 * times
    stamped = read_table(write("run.csv", "t [s],u [V]\n" + body))
    assert stamped.find("u").values[:2].tolist() == [2.0, 3.0]
    assert any("without a value left out" in note for note in stamped.notes)


def test_lines_before_the_header_are_skipped_and_lines_still_count_from_the_top(write: Write) -> None:
    path = write("run.csv", "Logger 7\nSerial;12;34\nt [s];u [V]\n0;1,5\n1;x\n")
    table = read_table(path, files=FileOptions(skip_lines=2, separator=";"))
    with pytest.raises(ReaderError, match=r"line 5, column u"):
        table.find("u")


def test_what_the_options_say_is_not_guessed(write: Write) -> None:
    path = write("run.csv", "1;1,500\n2;2,500\n")
    european = read_table(path).find("column_2").values
    english = read_table(path, files=FileOptions(thousands=",", decimal=".")).find("column_2").values
    assert (european.tolist(), english.tolist()) == ([1.5, 2.5], [1500.0, 2500.0])


def test_stamps_whose_marks_all_look_alike_are_read_as_told(write: Write) -> None:
    path = write("run.csv", "0.000;3.658;7.315\r\n301.000;3.657;7.315\r\n1.003.000;3.658;7.317")
    options = FileOptions(names=("t [ms]", "P [bar]", "U [V]"), decimal=".", thousands=".")
    table = read_table(path, files=options)
    assert table.find("t").values.tolist() == [0.0, 301.0, 1003.0]
    assert table.find("U").values.tolist() == [7.315, 7.315, 7.317]


def test_calendar_time_becomes_seconds(write: Write) -> None:
    path = write("run.csv", "u [V],stamp\n1,01.05.2024 23:59:59.5\n2,02.05.2024 00:00:01.0\n")
    options = FileOptions.model_validate(
        {"time": {"column": "stamp", "unit": "datetime", "format": "%d.%m.%Y %H:%M:%S.%f"}}
    )
    table = read_table(path, files=options)
    assert (table.time, table.find("stamp").values.tolist()) == ("stamp", [0.0, 1.5])


def test_missing_values_are_what_the_options_name(write: Write) -> None:
    path = write("run.csv", "t [s],u [V]\n0,---\n1,\n2,3\n")
    table = read_table(path, files=FileOptions(missing=("---",)))
    np.testing.assert_array_equal(table.find("u").values, [np.nan, np.nan, 3.0])


def test_a_column_of_remarks_does_no_harm(write: Write) -> None:
    table = read_table(write("run.csv", "t [s],state,u [V]\n0,OK,1\n1,OK,2\n"))
    assert table.find("u").values.tolist() == [1.0, 2.0]
    with pytest.raises(ReaderError, match=r"(?s)column state.*got: +'OK'.*states: \{'OK': 0\}.*missing: \['OK'\]"):
        table.find("state")


REFUSED = {
    "several points": ("t;u\n0.000;1\n1.003.000;2\n", {}, "t", r"(?s)line 3, column t.*'1\.003\.000'.*thousands: '\.'"),
    "commas in numbers and between them": ("t,u\n0,1,1,5\n0,2,2,5\n", {}, "t", r"(?s)twice as many.*semicolons"),
    "calendar time beside time": ("t;when\n0;2024-05-01 10:00\n1;2024-05-01 10:01\n", {}, "when", "unit: datetime"),
    "wrong decimal mark": ("t,u\n0,1.5\n1,2;5\n", {}, "u", r"(?s)line 3, column u.*'2;5'.*decimal"),
    "two decimal marks": ("t;u\n0,5;1\n1.5;2\n", {}, "t", r"(?s)decimal comma and.*lines 2 and 3.*decimal: ','"),
    "nothing": ("", {}, "t", "holds no samples"),
    "comments alone": ("# a\n# b\n", {}, "t", "holds no samples"),
    "header alone": ("t [s],u [V]\n", {}, "t", "holds no samples"),
    "zero bytes": ("t,u\n0,1\n\0\0\0\0,2\n", {}, "t", r"(?s)not text.*zero bytes"),
    "an open quote": ('t,u\n0,"1\n1,2\n', {}, "t", r"(?s)cannot be split.*quotes in pairs"),
    "names that do not fit": ("0,1,2\n1,2,3\n", {"names": ("t", "u")}, "t", r"(?s)expected: 3 names.*got: +2"),
    "an unknown encoding": ("t,u\n0,1\n", {"encoding": "klingon"}, "t", r"(?s)not text.*klingon"),
    "mixed calendar": (
        "t,u\n2024-05-01 10:00,1\n2024-05-01 11:00+02:00,1\n",
        {"time": {"column": "t", "unit": "datetime"}},
        "t",
        "some time stamps have a time zone",
    ),
    "not a date": (
        "t,u\n2024-05-01 10:00,1\nyesterday,1\n2024-05-01 10:02,1\n",
        {"time": {"column": "t", "unit": "datetime"}},
        "t",
        r"(?s)line 3.*'yesterday'.*format:",
    ),
}


@pytest.mark.parametrize(("text", "options", "column", "message"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_read_is_refused(
    write: Write, text: str, options: dict[str, object], column: str, message: str
) -> None:
    with pytest.raises(ReaderError, match=message):
        read_table(write("run.csv", text), files=FileOptions.model_validate(options)).find(column)


def test_ragged_rows_are_dropped_on_request_and_told(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t [s],u [V]\n0,1\n1\n2,3,4\n3,4\n")
    with pytest.raises(ReaderError, match=r"(?s)2 rows.*line 3.*expected: 2 cells.*ragged: drop"):
        read_table(tmp_path / "run.csv")
    table = read_table(tmp_path / "run.csv", repairs=RepairOptions(ragged="drop"))
    assert table.find("u").values.tolist() == [1.0, 4.0]
    assert table.notes == ("2 ragged rows dropped, first at line 3",)


@settings(max_examples=200)
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.mktemp("any") / "run.csv"
    path.write_bytes(content)
    try:
        table = read_table(path)
    except ReaderError as error:
        assert error.remedy
    else:
        assert len({len(column.values) for column in table.columns}) == 1


@settings(max_examples=200)
@given(st.text(alphabet="0123456789.,;\t\n\r\"'# ekPatsV[]()-", max_size=120))
def test_any_text_that_looks_like_csv_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: str
) -> None:
    path = tmp_path_factory.mktemp("any") / "run.csv"
    path.write_bytes(content.encode())
    try:
        table = read_table(path)
    except ReaderError as error:
        assert error.remedy
    else:
        assert table.lines is not None
        assert (np.diff(table.lines) > 0).all()


@pytest.mark.parametrize("blank", [" ", "\u00a0", "\u202f", "\u2009"])
def test_thousands_may_stand_behind_any_blank(write: Write, blank: str) -> None:
    found = inspect_file(write("run.csv", f"t;u\n0,0;1{blank}000,5\n0,1;1{blank}234{blank}567,0\n0,2;12,0\n"))
    assert found.table.find("u").values.tolist() == [1000.5, 1234567.0, 12.0]


def test_a_packed_file_is_told_to_be_unpacked(write: Write) -> None:
    path = write("run.csv", "")
    path.write_bytes(gzip.compress(b"t,u\n0,1\n1,2\n"))
    with pytest.raises(ReaderError, match=r"(?s)packed with gzip.*unpack"):
        read_table(path)


def _zipped(data: bytes, *names: str) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        for name in names:
            archive.writestr(name, data)
    return held.getvalue()


PACKED = {"gz": gzip.compress, "bz2": bz2.compress, "xz": lzma.compress, "zip": lambda data: _zipped(data, "r/run.csv")}


@pytest.mark.parametrize("ending", PACKED)
def test_a_packed_table_is_read_as_it_is(write: Write, ending: str) -> None:
    path = write(
        f"run.csv.{ending}", PACKED[ending](b"t [s],u [V]\n" + b"".join(b"%d,%d\n" % (k, k % 3) for k in range(20)))
    )
    trace = read_trace(path)
    assert (trace.name, trace["u"].tolist()) == ("run", [k % 3 for k in range(20)])
    assert "name: run\n" in propose_dataset(inspect_file(path))


@pytest.mark.parametrize(
    ("ending", "data", "told"),
    [
        ("csv.gz", gzip.compress(b"t,u\n0,1\n1,2\n")[:-9], "cannot be unpacked"),
        ("zip", _zipped(b"t,u\n0,1\n", "a.csv", "b.csv"), r"(?s)holds 2 files.*a\.csv, b\.csv"),
        ("mat.gz", gzip.compress(b"\x00\x01" * 80), "not text"),
    ],
    ids=["cut short", "two files", "no text"],
)
def test_a_packed_file_that_is_no_table_is_refused(write: Write, ending: str, data: bytes, told: str) -> None:
    with pytest.raises(ReaderError, match=told):
        read_table(write(f"run.{ending}", data))


ROWS = "".join(f"{k / 10},{k % 3},{k * k}\n" for k in range(5, 20))
HEADERS = {
    "words in the first cells": ("t,u,y\n" + "".join(f"{k / 10},{k % 3},warmup\n" for k in range(5)), ["t", "u", "y"]),
    "limits in the first cells": ("t,u,y\n" + "".join(f"{k / 10},{k % 3},<0.5\n" for k in range(5)), ["t", "u", "y"]),
    "a title with numbers": ("Test 12, 2024, Rig 3\nt,u,y\n", ["t", "u", "y"]),
    "titles over names": ("Engine,Engine,Pump\nt,u,y\n", ["t", "u", "y"]),
    "titles over names that come again": (",Inlet,Outlet\nt,p,p\n", ["t", "Inlet p", "Outlet p"]),
    "a head on two lines": ("t,Druck [bar],\n,ein,aus\n", ["t", "Druck ein", "Druck aus"]),
    "a head on two lines, with units below": ("t,Druck,\n,ein,aus\ns,bar,bar\n", ["t", "Druck ein", "Druck aus"]),
    "a line of units": ("load,pump,level\nt,V,m\n", ["load", "pump", "level"]),
}


@pytest.mark.parametrize("case", HEADERS)
def test_the_header_is_the_line_of_names(write: Write, case: str) -> None:
    head, names = HEADERS[case]
    # Tonnes need not rise from row to row, as time does.
    rows = ROWS if names[0] == "t" else "".join(reversed(ROWS.splitlines(keepends=True)))
    table = read_table(write("run.csv", head + rows))
    assert list(table.names) == names
    assert len(table) == 15 + head.count("\n0.")


def test_points_between_thousands_of_whole_numbers_are_no_decimal_points(write: Write) -> None:
    """1.234.567 beside whole numbers had been read as 1234.567."""
    counts = ["1.234.567", "1.235.001", "998.100"] * 5
    found = inspect_file(write("run.csv", "t;u;n\n" + "".join(f"{k};{k % 3};{n}\n" for k, n in enumerate(counts))))
    assert found.table.find("n").values[:3].tolist() == [1234567.0, 1235001.0, 998100.0]


def test_a_header_that_comes_again_in_another_order_is_refused(write: Write) -> None:
    """It had been told as a mark of a missing value, and what it asked to write would have exchanged the columns."""
    rows = "".join(f"{k / 10},{k % 3},{k * k}\n" for k in range(15))
    with pytest.raises(ReaderError, match=r"(?s)another order.*line 17"):
        read_table(write("run.csv", f"t,u,y\n{rows}t,y,u\n{rows}"))


def test_names_of_rows_have_no_head_in_tables_of_r(write: Write) -> None:
    """``write.table`` quotes them; the head, a name short, had been left out, and they had been time."""
    rows = "".join(f'"{k + 1}" {k / 10} {k % 3} {k * k}\n' for k in range(15))
    found = inspect_file(write("run.txt", '"t" "u" "y"\n' + rows))
    assert [column.name for column in found.channels] == ["u", "y"]
    assert (found.time.column, found.sample_time) == ("t", 0.1)


def test_a_title_over_columns_gives_them_its_unit(write: Write) -> None:
    """Merged cells of a sheet leave blanks; the second name had been taken for a unit, attoseconds among them."""
    head = "Zeit [s];Druck [bar];;Weg [mm]\n;ein;aus [kPa];\n"
    rows = "".join(f"{k / 10};{k % 3}.5;{k * k};{k}\n" for k in range(15))
    found = {column.name: column.unit for column in inspect_file(write("run.csv", head + rows)).columns}
    assert found == {"Druck ein": "bar", "Druck aus": "kPa", "Weg": "mm"}


def test_signals_that_stand_one_after_the_other_are_a_long_table(write: Write) -> None:
    rows = "".join(f"{k / 10},y,{k * k}\n" for k in range(10))
    finding = inspect_file(write("run.csv", "time,name,value\n0.0,u,1\n0.5,u,3\n" + rows))
    assert [(column.name, column.maximum) for column in finding.columns] == [("u", 3.0), ("y", 81.0)]


@pytest.mark.parametrize(
    ("above", "names", "step"),
    [
        ("Sample rate;2,5 kHz\nu;y\n", ("u", "y"), 4e-4),
        ("Sampling rate;10 Hz\nT;A\n", ("T", "A"), 0.1),
        ("Date;2024-01-01\nT;A\n", ("T", "A"), None),
        ("Date;01.02.2024 08:15\nu;v\n", ("u", "v"), None),
        ("t;25 mm\ns;V\n", ("t", "25 mm"), None),
        ("in;out\nV;A\n", ("in", "out"), None),
    ],
)
def test_a_line_of_what_the_record_is_about_is_no_header(
    write: Write, above: str, names: tuple[str, ...], step: float | None
) -> None:
    """Over two columns it looks like names, and names as short as u and y look like units."""
    path = write("run.csv", above + "0,5;1,5\n0,7;2,5\n0,6;1,5\n0,9;2,5\n")
    assert read_table(path).names == names
    if step is not None:
        assert inspect_file(path).sample_time == pytest.approx(step)
