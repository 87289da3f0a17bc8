"""Lines that name their values, and tables in tables: read as the table that they are."""

from __future__ import annotations

import datetime
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ReaderError, UserError
from sysid.ingest import inspect_file
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.traces import Trace

N = 30
U = np.repeat([1.0, 3.0, 2.0], 10)
Y = np.round(np.convolve(U, 0.2 * 0.8 ** np.arange(N))[:N], 4)
BEGAN = datetime.datetime(2024, 3, 12, 8, 15)
STAMPS = [BEGAN + datetime.timedelta(seconds=0.1 * k) for k in range(N)]


def loaded(path: Path, lines: list[str]) -> Trace:
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GuessedWarning)
        (trace,) = sysid.load(path).traces
    return trace


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("a.log", lambda k: f"{STAMPS[k]:%H:%M:%S.%f} -> u:{U[k]},y:{Y[k]}"),
        ("a.txt", lambda k: f"t: {100 * k} ms u: {U[k]} V y: {Y[k]} V"),
        ("a.lp", lambda k: f"rig,site=a u={U[k]},y={Y[k]} {1_710_231_300_000_000_000 + 100_000_000 * k}"),
        ("b.lp", lambda k: f"rig u={U[k]} {1_710_231_300_000 + 100 * k}\nrig y={Y[k]} {1_710_231_300_000 + 100 * k}"),
        ("b.log", lambda k: f'ts={STAMPS[k].isoformat()}Z level=info msg="one tick" u={U[k]} y={Y[k]}'),
        ("a.ltsv", lambda k: f"time:{STAMPS[k].isoformat()}\tu:{U[k]}\ty:{Y[k]}"),
        ("c.log", lambda k: f"[{k / 10:12.6f}] u={U[k]}, y={Y[k]}"),
    ],
    ids=["serial monitor", "units", "line protocol", "fields apart", "logfmt", "LTSV", "clock in brackets"],
)
def test_lines_that_name_their_values_are_a_table(tmp_path: Path, name: str, line: Callable[[int], str]) -> None:
    trace = loaded(tmp_path / name, ["Board 4, v1.2", *map(line, range(N))][name.endswith("lp") :])
    assert trace.sample_time == pytest.approx(0.1)
    np.testing.assert_array_equal(trace["u"], U)
    np.testing.assert_array_equal(trace["y"], Y)


def test_values_that_come_in_turn_are_one_row(tmp_path: Path) -> None:
    trace = loaded(
        tmp_path / "a.txt", [line for k in range(N) for line in (f"Room temp: {Y[k]} C", f"power: {U[k]} W")]
    )
    assert [(channel.name, channel.unit) for channel in trace.channels] == [("Room temp", "degC"), ("power", "W")]
    np.testing.assert_array_equal(trace["power"], U)


def test_the_log_of_a_printer_has_temperatures_and_what_was_asked_for(tmp_path: Path) -> None:
    def line(k: int) -> str:
        at = f"{BEGAN + datetime.timedelta(seconds=2 * k):%Y-%m-%d %H:%M:%S},123"
        return f"{at} - Recv:  T:{Y[k]} /{U[k]} B:60.1 /60.0 @:0" + f"\n{at} - Send: N{k} G1 X{k}.5" * (k % 3 == 0)

    trace = loaded(tmp_path / "serial.log", [line(k) for k in range(N)])
    assert trace.sample_time == 2.0
    np.testing.assert_array_equal(trace["T"], Y)
    np.testing.assert_array_equal(trace["T_target"], U)


def test_settings_are_no_samples(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("a: 1\nb: 2\nc: 3\nd: 4\nseed: 5\nmode: 6\n")
    with pytest.raises(UserError):
        sysid.load(tmp_path / "a.txt")


ALONE = np.round(np.random.default_rng(1).normal(size=N - 1), 4)
WRAPPED = ["\t".join(f"{value:+.4e}" for value in ALONE[at : at + 6]) for at in range(0, N - 1, 6)]


@pytest.mark.parametrize(
    ("name", "head", "step"),
    [
        (
            "a.ascii",
            "TIMESERIES XX_A__BHZ_R, 29 samples, 40 sps, 2008-01-15T00:00:00.025000, SLIST, FLOAT, Counts",
            0.025,
        ),
        ("a.at2", "RECORD 12\nACCELERATION IN UNITS OF G\nNPTS=     29, DT=   .0050 SEC", 0.005),
    ],
)
def test_one_signal_over_many_lines_is_one_channel(tmp_path: Path, name: str, head: str, step: float) -> None:
    trace = loaded(tmp_path / name, [head, *WRAPPED])
    assert trace.sample_time == step
    np.testing.assert_array_equal(trace["signal"], ALONE)


def test_several_such_signals_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ReaderError, match="one below the other"):
        loaded(
            tmp_path / "a.ascii", ["SERIES A, 29 samples, 40 sps", *WRAPPED, "SERIES B, 29 samples, 40 sps", *WRAPPED]
        )


def test_a_table_whose_head_has_a_number_stays_one(tmp_path: Path) -> None:
    trace = loaded(tmp_path / "a.txt", ["N = 90", "t u y", *(f"{k / 10:.1f} {U[k]} {Y[k]}" for k in range(N))])
    np.testing.assert_array_equal(trace["y"], Y)


def test_names_stand_above_what_a_program_of_amplifiers_says_of_each_channel(tmp_path: Path) -> None:
    """The last of those lines says the same of all."""
    about = [
        ["time A", "F1", "F2"],
        ["s", "N", "N"],
        ["dt = 20 ms"] * 3,
        ["CH 0", "CH 1", "CH 2"],
        ["Sensor: None"] * 3,
    ]
    rows = [[f"{0.02 * k:.3f}", f"{U[k]}", f"{Y[k]}"] for k in range(N)]
    trace = loaded(tmp_path / "a.asc", ["DATAFILE", "CHANNELS: 3", "", *("\t".join(row) for row in [*about, *rows])])
    assert [(channel.name, channel.unit) for channel in trace.channels] == [("F1", "N"), ("F2", "N")]
    assert trace.sample_time == pytest.approx(0.02)


@pytest.mark.parametrize("mark", [",", "\t", ";"])
def test_the_innermost_of_nested_tables_has_the_samples(tmp_path: Path, mark: str) -> None:
    lines = [
        "Cycle ID,Cap_Chg(mAh)",
        ",Step ID,Step Name,Step Time(h:min:s)",
        ",,Record ID,Voltage(V),Current(mA),Realtime",
    ]
    for step in range(3):
        lines += [f"{step + 1},100.5"] * (step != 1) + [f",{step + 1},Rest,0:01:40"]
        for k in range(10 * step, 10 * step + 10):
            lines.append(f",,{k + 1},{Y[k]},{U[k]},{BEGAN + datetime.timedelta(seconds=10 * k)}")
    trace = loaded(tmp_path / "a.csv", [line.replace(",", mark) for line in lines])
    assert trace.sample_time == 10.0
    np.testing.assert_array_equal(trace["Voltage"], Y)
    np.testing.assert_array_equal(trace["Current"], U)
    assert any("innermost of 3 levels" in note for note in inspect_file(tmp_path / "a.csv").notes)
