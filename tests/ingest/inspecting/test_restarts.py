"""Files whose clock, or whose numbers, mean something else than they say: nothing of a record is lost or mixed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.ingest import inspect_file, load_dataset, propose_dataset
from sysid.ingest.tables.rates import said_step
from sysid.traces import TraceSet

RNG = np.random.default_rng(5)
U, Y = np.round(RNG.normal(size=(2, 60)), 3)


def proposed(folder: Path, text: str) -> TraceSet:
    """What the proposal for a file of this text loads."""
    file = folder / "rig.csv"
    file.write_text(text, encoding="utf-8")
    (folder / "dataset.yaml").write_text(propose_dataset(inspect_file(file), folder=folder), encoding="utf-8")
    return load_dataset(folder)


def rows(times: list[str], y: list[str] | None = None) -> str:
    cells = zip(times, U, y or [str(value) for value in Y], strict=True)
    return "".join(f"{t},{u},{v}\n" for t, u, v in cells)


def test_a_clock_that_begins_anew_makes_a_case_of_each_record(tmp_path: Path) -> None:
    """Sorted by time, as backward stamps are, every second sample would be of the other experiment."""
    times = [f"{0.1 * k + 0.001 * (k >= 25):.3f}" for k in [*range(25), *range(35)]]
    traces = proposed(tmp_path, "t [s],u [V],y [m]\n" + rows(times))
    assert [len(trace) for trace in traces.traces] == [25, 35]
    assert np.array_equal(traces.traces[1]["y"], Y[25:])


@pytest.mark.parametrize(
    ("at", "by", "lengths"),
    [
        pytest.param(30, -1.37, [30, 30], id="set back"),
        pytest.param(30, 3600.0, [30, 30], id="set on by more than was recorded"),
        pytest.param(30, 1.0, [70], id="a gap"),
    ],
)
def test_a_clock_that_was_set_parts_the_record(tmp_path: Path, at: int, by: float, lengths: list[int]) -> None:
    """Sorted, what came after stood between what was before, and the sample time was another one."""
    times = [f"{0.1 * k + by * (k >= at):.2f}" for k in range(60)]
    traces = proposed(tmp_path, "t [s],u [V],y [m]\n" + rows(times))
    assert [len(trace) for trace in traces.traces] == lengths
    assert {trace.sample_time for trace in traces.traces} == {0.1}
    assert np.array_equal(traces.traces[-1]["y"][-30:], Y[30:])


def test_blocks_that_were_only_written_in_another_order_are_sorted(tmp_path: Path) -> None:
    order = [*range(20), *range(40, 60), *range(20, 40)]
    (trace,) = proposed(tmp_path, "t [s],u [V],y [m]\n" + rows([f"{0.1 * k:.1f}" for k in order])).traces
    assert len(trace) == 60
    assert np.array_equal(trace["y"][20:40], Y[40:])


def test_a_counter_that_wraps_parts_the_record_in_its_order(tmp_path: Path) -> None:
    """Sorted, the second part had come first, and a minute was missing between them; no clock is full at 65,600."""
    times = [str((63000 + 100 * k) % 65600) for k in range(60)]
    traces = proposed(tmp_path, "t [ms],u [V],y [m]\n" + rows(times))
    assert [len(trace) for trace in traces.traces] == [26, 34]
    assert np.array_equal(traces.traces[1]["y"], Y[26:])


def test_one_stamp_that_steps_back_is_no_new_record(tmp_path: Path) -> None:
    times = [f"{0.1 * k:.1f}" for k in range(60)]
    times[30], times[31] = times[31], times[30]
    traces = proposed(tmp_path, "t [s],u [V],y [m]\n" + rows(times))
    assert [len(trace) for trace in traces.traces] == [60]


def test_samples_that_share_a_stamp_of_whole_seconds_are_all_kept(tmp_path: Path) -> None:
    times = [f"2024-03-12 08:15:{(k + 3) // 10:02d}" for k in range(60)]
    traces = proposed(tmp_path, "time,u [V],y [m]\n" + rows(times))
    (trace,) = traces.traces
    assert (len(trace), trace.sample_time) == (60, 0.1)
    assert np.array_equal(trace["y"], Y)


def test_a_stamp_that_stands_twice_now_and_then_is_still_a_duplicate(tmp_path: Path) -> None:
    times = [f"{0.1 * (k - (k > 30)):.1f}" for k in range(60)]
    (trace,) = proposed(tmp_path, "t [s],u [V],y [m]\n" + rows(times)).traces
    assert len(trace) == 59


@pytest.mark.parametrize("mark", ["-9999", "-9999.00", "1e30"])
def test_a_number_that_stands_for_none_is_masked(tmp_path: Path, mark: str) -> None:
    y = [mark if k in {20, 21} else str(value) for k, value in enumerate(Y)]
    y[22] = "n/a"  # beside words that stand for none
    (trace,) = proposed(tmp_path, "t [s],u [V],y [m]\n" + rows([f"{0.1 * k:.1f}" for k in range(60)], y)).traces
    assert np.flatnonzero(~trace.usable_samples).tolist() == [20, 21, 22]
    assert np.abs(trace["y"]).max() < 5.0


def test_a_large_number_among_others_like_it_is_one(tmp_path: Path) -> None:
    y = [str(9999 - 100 * (k % 50)) for k in range(60)]
    (trace,) = proposed(tmp_path, "t [s],u [V],y [m]\n" + rows([f"{0.1 * k:.1f}" for k in range(60)], y)).traces
    assert trace.usable is None
    assert trace["y"].max() == 9999.0


def test_a_minus_as_word_processors_write_it_is_one(tmp_path: Path) -> None:
    text = "t [s];u [V];y [m]\n" + rows([f"{0.1 * k:.1f}" for k in range(60)]).replace(",", ";")
    (trace,) = proposed(tmp_path, text.replace("-", "\N{MINUS SIGN}").replace(".", ",")).traces
    assert np.array_equal(trace["y"], Y)
    assert trace.channel_names == ("u", "y")


@pytest.mark.parametrize(
    ("line", "step"),
    [
        ("% Fs = 200 Hz", 0.005),
        ("Sampling rate: 2 kHz", 0.0005),
        ("Sample interval (ms);0,5;", 0.0005),
        ("# dt: 0.02", 0.02),
        ("Abtastzeit [ms]\t10", 0.01),
        ("Sample Rate,1000,Hz", 0.001),
        ("Fs = 0", None),
        ("Sample rate: 10 rpm", None),
        ("Tests: 12", None),
        ("Date: 12.03.2024", None),
    ],
)
def test_a_line_above_the_table_may_say_the_sample_time(line: str, step: float | None) -> None:
    assert said_step([line]) == step


def test_the_sample_time_above_a_table_without_time_is_taken_and_told(tmp_path: Path) -> None:
    text = "% Fs = 50 Hz\nu [V],y [m]\n" + "".join(f"{u},{v}\n" for u, v in zip(U, Y, strict=True))
    (trace,) = proposed(tmp_path, text).traces
    assert trace.sample_time == 0.02
    assert "sample time 0.02 s, from the lines above the table" in trace.provenance


def test_two_lines_that_say_different_sample_times_say_none() -> None:
    assert said_step(["Fs = 10 Hz", "dt = 0.2 s"]) is None
    assert said_step(["Fs = 10 Hz", "dt = 0.1 s"]) == 0.1
