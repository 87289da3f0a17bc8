"""Further clocks and counters beside the time column are no channels, nor is what stands behind one of another pace."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sysid.ingest.inspecting.second_clocks import without_second_clocks
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable

T = np.arange(20) * 0.1
Y = np.sin(T)


def a_table(*columns: tuple[str, np.ndarray, str | None]) -> RawTable:
    made = tuple(RawColumn(name=name, values=values, unit=unit) for name, values, unit in columns)
    return RawTable(source=Path("rig.csv"), reader="csv", columns=made, time=made[0].name)


SECOND = {
    "the same": (("t2", T, None), "the time again, as in t"),
    "in another unit": (("t_ms", 1000 * T, None), "the time again, as in t"),
    "in a unit that is said": (("y.time", 1000 * T, "ms"), "the time again, as in t"),
    "from another origin": (("timestamp", 1.7e9 + T, None), "the time again, as in t"),
    "ahead": (("Time y", T + 5.0, None), "a second clock, 5 ahead of t"),
    "a counter": (("frame", np.arange(20.0), None), "counts the rows"),
    "of another pace": (("t_y", 2.5 * T, None), "a clock of another pace than t"),
    "a ramp": (("u", 2.5 * T, None), ""),
    "a ramp of pulse widths": (("Servo 3", 1400.0 + 58.3 * T, "µs"), ""),
    "a temperature": (("t_oil", 20.0 + Y, None), ""),
}


@pytest.mark.parametrize("case", SECOND)
def test_what_goes_like_a_clock_is_no_channel(case: str) -> None:
    column, said = SECOND[case]
    first, second, behind = without_second_clocks(a_table(("t", T, None), column, ("y", Y, None)), "t").columns
    assert (first.aside, second.aside) == ("", said)
    assert bool(behind.aside) is (case == "of another pace")


@pytest.mark.parametrize("name", ["n", "k", "Sample Number", "column_1", "Nr.", "index"])
def test_a_number_of_rows_is_no_channel_where_nothing_is_time(name: str) -> None:
    counts = RawColumn(name=name, values=np.arange(1.0, 21.0))
    table = RawTable(source=Path("rig.csv"), reader="csv", columns=(counts, RawColumn(name="y", values=Y)), step=0.05)
    assert [column.aside for column in without_second_clocks(table, None).columns] == ["counts the rows", ""]
    endless = replace(counts, values=np.r_[np.arange(18.0), np.inf, np.inf])  # of whose difference NumPy would warn
    assert not without_second_clocks(replace(table, columns=(endless, table.columns[1])), None).columns[0].aside
    gaps = replace(counts, values=np.delete(np.arange(21.0), 7))
    assert not without_second_clocks(replace(table, columns=(gaps, table.columns[1])), None).columns[0].aside
