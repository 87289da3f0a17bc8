"""Further clocks and counters beside the time column are no channels, nor is what stands behind one of another pace."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.ingest.inspecting.second_clocks import without_second_clocks
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.table import RawTable

T = np.arange(20) * 0.1
Y = np.sin(T)
UNEVEN = "counts on, but not by one from row to row"


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
    said = without_second_clocks(replace(table, columns=(gaps, table.columns[1])), None).columns[0].aside
    # A speed is called n, too, and a position k: what does not count the rows is told by plain names alone.
    assert said == (UNEVEN if name in {"Sample Number", "index"} else "")


JITTER = np.random.default_rng(0).uniform(0.0, 0.06, 20)
FRAMES = np.cumsum(np.tile([1.0, 1.0, 2.0, 1.0, 3.0], 4))
DIFFERS = f"a second clock beside t, whose steps differ from it by up to {np.ptp(JITTER):.3g} s"
RISING = {
    "a wall clock": ("timestamp", 1.7e9 + T + JITTER, None, DIFFERS),
    "a wall clock in days": ("date", 45000.0 + (T + JITTER) / 86_400.0, None, DIFFERS),
    "a clock with a unit": ("host", T + JITTER, "s", DIFFERS),
    "a clock by its name": ("t_rx", T + JITTER, None, DIFFERS),
    "a clock at the end of a name": ("host_time", 1000.0 * (T + JITTER), None, DIFFERS),
    "stamps with gaps": ("timestamp", np.cumsum(FRAMES), None, "a clock in uneven steps beside t"),
    "frames": ("frame", FRAMES, None, UNEVEN),
    "frames that are held": ("Frame No.", np.floor(np.arange(20) / 2.3), None, UNEVEN),
    "numbers of messages": ("seq", FRAMES, "1", UNEVEN),
    "a speed": ("n", 1000.0 + FRAMES, None, ""),
    "stages": ("index", np.repeat([0.0, 1.0, 2.0, 3.0], 5), None, ""),
    "pulses": ("count", FRAMES, None, ""),
    "a temperature that rises": ("t_oil", 20.0 + 3.0 * T + JITTER, None, ""),
    "a width that rises": ("Servo 3", 1400.0 + 58.3 * T + JITTER, "µs", ""),
}


@pytest.mark.parametrize("case", RISING)
def test_a_clock_in_uneven_steps_is_no_channel_either(case: str) -> None:
    name, values, unit, said = RISING[case]
    _, second, behind = without_second_clocks(
        a_table(("t", T, None), (name, values, unit), ("y", Y, None)), "t"
    ).columns
    assert (second.aside, behind.aside) == (said, "")


def test_an_even_clock_beside_an_uneven_one_keeps_what_stands_behind_it() -> None:
    """All that stood behind it had been taken for samples of other times."""
    table = a_table(("timestamp", 1.7e9 + T + JITTER, None), ("elapsed", T, None), ("y", Y, None))
    _, second, behind = without_second_clocks(table, "timestamp").columns
    assert second.aside.startswith("a second clock beside timestamp")
    assert behind.aside == ""


def test_a_temperature_that_rises_evenly_is_one() -> None:
    columns = without_second_clocks(
        a_table(("t", T, None), ("t_oil", 20.0 + 3.0 * T, None), ("y", Y, None)), "t"
    ).columns
    assert [column.aside for column in columns] == ["", "", ""]


def test_a_file_that_says_all_has_no_clock_among_its_channels(write: Callable[[str, str], Path]) -> None:
    """It had been the input of the mapping that was asked for."""
    rows = "".join(
        f"{t:.1f},{frame:g},{k % 3},{y:.4f}\n" for k, (t, frame, y) in enumerate(zip(T, FRAMES, Y, strict=True))
    )
    with pytest.warns(GuessedWarning, match=f"left out: frame .{UNEVEN}"):
        traces = sysid.load(write("rig.csv", "time [s],frame [1],u [V],y [m]\n" + rows))
    assert [channel.name for channel in traces.channels] == ["u", "y"]
