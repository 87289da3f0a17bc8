"""Large text files: Arrow's way and ours give the same, and bounds stand before memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, RepairOptions, read_table
from sysid.ingest.readers import text_source
from sysid.ingest.readers.csv import body as csv_body
from sysid.ingest.readers.csv import split as csv_split

N = 9000
TIME = (np.arange(N) / 8.0).tolist()
VALUES = np.random.default_rng(3).normal(size=N).tolist()

Write = Callable[[str, str | bytes], Path]


def rows(line: Callable[[int], str]) -> str:
    return "".join(line(k) + "\n" for k in range(N))


LAYOUTS = {
    "comma": "t [s],u [V]\n" + rows(lambda k: f"{TIME[k]!r},{VALUES[k]!r}"),
    "decimal comma, CRLF": ("t [s];u [V]\n" + rows(lambda k: f"{TIME[k]!r};{VALUES[k]!r}".replace(".", ","))).replace(
        "\n", "\r\n"
    ),
    "runs of blanks, plus signs": "# t u\n" + rows(lambda k: f"   {TIME[k]:+.17e}  {VALUES[k]:+.17e} "),
    "Fortran": rows(lambda k: f" {TIME[k]:.17e} {VALUES[k]:.17e}".replace("e", "D")),
    "quotes": '"t","u"\n' + rows(lambda k: f'"{TIME[k]!r}","{VALUES[k]!r}"'),
    "a comment, a blank line and a footer": "t,u\n"
    + rows(lambda k: f"{TIME[k]!r},{VALUES[k]!r}" + "\n# pause\n" * (k == 4500))
    + "Mean,0.1\n",
    "a separator at the end of each line": "t,u,\n" + rows(lambda k: f"{TIME[k]!r},{VALUES[k]!r},"),
    "the same, not in the header": "t,u\n" + rows(lambda k: f"{TIME[k]!r},{VALUES[k]!r},"),
    "blank lines at the end": "t,u\r\n" + rows(lambda k: f"{TIME[k]!r},{VALUES[k]!r}\r") + "\r\n\r\n",
    "not ASCII": "t,u,Öl\n" + rows(lambda k: f"{TIME[k]!r},{VALUES[k]!r},{'größer' if k % 2 else 'ß'}"),
}


def lines_of(text: str) -> list[int]:
    numbers = [
        i + 1 for i, line in enumerate(text.replace("\r\n", "\n").split("\n")) if line.strip(' "+-')[:1].isdigit()
    ]
    assert len(numbers) == N
    return numbers


@pytest.mark.parametrize("text", LAYOUTS.values(), ids=LAYOUTS)
@pytest.mark.parametrize("way", ["by Arrow", "row by row"])
def test_every_digit_is_read_in_bulk_too(write: Write, monkeypatch: pytest.MonkeyPatch, text: str, way: str) -> None:
    assert len(text) > csv_body._PLAIN_FROM
    if way == "row by row":
        monkeypatch.setattr(csv_body, "_PLAIN_FROM", 10**9)
    table = read_table(write("run.csv", text))
    np.testing.assert_array_equal(table.columns[0].values, TIME)
    np.testing.assert_array_equal(table.columns[1].values, VALUES)
    assert table.lines is not None
    assert table.lines.tolist() == lines_of(text)


def test_blank_lines_at_the_end_do_not_make_a_file_slow(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_body.Body, "_row_by_row", lambda *_, **__: pytest.fail("row by row"))
    assert len(read_table(write("run.csv", LAYOUTS["blank lines at the end"]))) == N


def test_a_block_ends_anywhere(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write("run.csv", LAYOUTS["decimal comma, CRLF"].encode("utf-16"))
    monkeypatch.setattr(text_source, "_BLOCK", 4097)
    np.testing.assert_array_equal(read_table(path).columns[1].values, VALUES)


def test_missing_values_and_words_come_through_in_bulk(write: Write) -> None:
    def line(k: int) -> str:
        return f"{TIME[k]!r},{'' if k % 3 else 'NaN' if k % 2 else VALUES[k]},{'ON' if k % 5 else 'OFF'}"

    table = read_table(write("run.csv", "t,u,w\n" + rows(line)), files=FileOptions(states={"OFF": 0.0, "ON": 1.0}))
    known = np.arange(N) % 6 == 0
    np.testing.assert_array_equal(np.isfinite(table.find("u").values), known)
    np.testing.assert_array_equal(table.find("u").values[known], np.array(VALUES)[known])
    np.testing.assert_array_equal(table.find("w").values, (np.arange(N) % 5 > 0).astype(float))


def test_one_bad_cell_far_down_is_found_with_its_line(write: Write) -> None:
    text = LAYOUTS["comma"].replace(f"{TIME[8000]!r},", f"{TIME[8000]!r},x", 1)
    with pytest.raises(ReaderError, match=r"(?s)line 8002, column u.*got: +'x"):
        read_table(write("run.csv", text)).find("u")


def test_ragged_rows_far_down_are_dropped_and_told(write: Write) -> None:
    text = LAYOUTS["comma"].replace(f"{TIME[8000]!r},", f"{TIME[8000]!r},1,", 1)
    table = read_table(write("run.csv", text), repairs=RepairOptions(ragged="drop"))
    assert len(table) == N - 1
    assert table.notes == ("1 ragged rows dropped, first at line 8002",)


def test_a_clock_in_nanoseconds_keeps_its_digits(write: Write) -> None:
    text = "timestamp,u\n" + rows(lambda k: f"{1710231300000000001 + 125 * k},{VALUES[k]!r}")
    table = read_table(write("run.csv", text))
    np.testing.assert_array_equal(table.columns[0].values, 125.0 * np.arange(N))
    assert table.columns[0].counted_from == 1710231300000000001


def test_a_line_without_end_is_refused_before_it_is_read(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_source, "LONGEST_LINE", 300_000)
    with pytest.raises(ReaderError, match=r"(?s)a line is too long for a table.*line 2.*cut -c1-200"):
        read_table(write("run.csv", "t,u\n0," + "1" * 2_000_000 + "\n1,2\n"))


def test_too_many_columns_are_refused_with_the_command_that_cuts_them(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(csv_split, "MOST_COLUMNS", 8)
    text = "".join(",".join(str(i * k) for i in range(9)) + "\n" for k in range(12))
    with pytest.raises(ReaderError, match=r"(?s)the file has 9 columns.*cut -d ',' -f 1-8"):
        read_table(write("run.csv", text))


def test_a_quote_that_does_not_close_is_refused(write: Write) -> None:
    with pytest.raises(ReaderError, match=r"cannot be split into cells"):
        read_table(write("run.csv", LAYOUTS["comma"].replace(f"{TIME[8000]!r},", f'{TIME[8000]!r},"', 1)))
