"""A head with a name more or fewer than the rows have cells keeps its names where it is plain which column has none."""

from collections.abc import Callable
from pathlib import Path

import pytest

from sysid.ingest.inspecting.inspection import inspect_file

Write = Callable[[str, str], Path]

ROWS = [(f"{k / 10:.1f}", f"{k % 3}.5", f"{k * k}") for k in range(15)]
PLAIN = ",".join


def rows(line: Callable[[int, tuple[str, ...]], str]) -> str:
    return "".join(line(k, row) + "\n" for k, row in enumerate(ROWS))


KEPT = {
    "a number of rows without name": "t,u,y\n" + rows(lambda k, row: f"{k},{PLAIN(row)}"),
    "numbers of rows that R writes without quotes": "t u y\n" + rows(lambda k, row: f"{k + 1} {' '.join(row)}"),
    "names of rows that are words": '"t","u","y"\n' + rows(lambda k, row: f'"run {k}",{PLAIN(row)}'),
    "units below": "t,u,y\ns,V,m\n" + rows(lambda k, row: f"{k},{PLAIN(row)}"),
    "separators behind the rows": "t,u,y\n" + rows(lambda _, row: PLAIN(row) + ",,"),
    "separators behind the head": "t,u,y,,\n" + rows(lambda _, row: PLAIN(row)),
    "an index that the rows do not have": "index,t,u,y\n" + rows(lambda _, row: PLAIN(row)),
    "an empty cell before the names": ";t;u;y\n" + rows(lambda _, row: ";".join(row)),
    "a mark of comments as a cell": "#,t,u,y\n" + rows(lambda _, row: PLAIN(row)),
}


@pytest.mark.parametrize("case", KEPT)
def test_names_are_kept(write: Write, case: str) -> None:
    found = inspect_file(write("run.csv", KEPT[case]))
    assert [column.name for column in found.channels] == ["u", "y"]
    assert (found.time.column, found.sample_time) == ("t", 0.1)


STAMPS = {
    "a clock": ("u,y\n", "{0:.1f},{1},{2}", "column_1"),
    "stamps": ("u,y\n", "2026-11-02 10:00:{0:04.1f},{1},{2}", "time"),
    "date and time of day": ("time,u,y\n", "2026-11-02,10:00:{0:04.1f},{1},{2}", "date"),
    "date and time of day between blanks": ("time u y\n", "2026-11-02 10:00:{0:04.1f} {1} {2}", "date"),
}


@pytest.mark.parametrize("case", STAMPS)
def test_a_clock_needs_no_name(write: Write, case: str) -> None:
    head, line, clock = STAMPS[case]
    found = inspect_file(write("run.csv", head + rows(lambda k, row: line.format(k / 10, *row[1:]))))
    assert [column.name for column in found.channels] == ["u", "y"]
    assert (found.time.column, found.sample_time) == (clock, 0.1)


def test_what_columns_lack_is_told_in_one_line(write: Write) -> None:
    """Of a table with two separators in a row each empty column had a line of its own."""
    body = rows(lambda _, row: "||".join(row))
    assert inspect_file(write("run.txt", "t||u||y\n" + body)).table.notes == (
        "columns 2, 4 have neither name nor values",
    )
    told = inspect_file(write("run.csv", "t,,\n" + rows(lambda _, row: PLAIN(row)))).table.notes
    assert told == ("columns 2, 3 have no name: called column_2, column_3",)


NUMBERED = {
    "the last name is lost": "t,u\n" + rows(lambda _, row: PLAIN(row)),
    "a counter that has its name": "n,u\n" + rows(lambda k, row: f"{k},{row[1]},{row[2]}"),
    "commas that may be decimal": "x,u,y\n" + rows(lambda k, row: f"{k},{k % 3},5,{row[2]}"),
    "a line of words": "measured by hand\n" + rows(lambda k, row: f"{k} {' '.join(row)}"),
    "a name too many": "t,u,v,y\n" + rows(lambda _, row: PLAIN(row)),
}


@pytest.mark.parametrize("case", NUMBERED)
def test_where_it_is_not_plain_columns_are_numbered(write: Write, case: str) -> None:
    found = inspect_file(write("run.csv", NUMBERED[case]))
    assert all(column.name.startswith("column_") for column in found.columns)
