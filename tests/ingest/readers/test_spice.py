"""Waveforms of circuit simulators: float32, float64 or text, over time or over frequency, several runs in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ReaderError
from sysid.ingest import inspect_file, read_table

STAMPS = np.cumsum(np.random.default_rng(0).uniform(1e-9, 1e-3, 60))
"""Steps of a solver: six decades apart."""
VOLTS = np.sin(200.0 * STAMPS)


def head(
    flags: str, points: int, variables: list[str], *, plot: str = "Transient Analysis", end: str = "Binary:"
) -> str:
    rows = [f"\t{k}\t{one}" for k, one in enumerate(variables)]
    said = ["Title: * C:\\rig.asc", "Date: Sun Mar 22 16:18:46 2026", f"Plotname: {plot}", f"Flags: {flags}"]
    sizes = [f"No. Variables: {len(variables)}", f"No. Points: {points:12d}", "Offset: 0.0"]
    return "\n".join([*said, *sizes, "Variables:", *rows, f"{end}\n"])


OVER_TIME = ["time\ttime", "V(in)\tvoltage", "I(R1)\tdevice_current"]


def ltspice(*, flags: str = "real forward", stamps: np.ndarray = STAMPS) -> bytes:
    rows = np.zeros(len(stamps), dtype=[("t", "<f8"), ("v", "<f4"), ("i", "<f4")])
    rows["t"], rows["v"], rows["i"] = stamps, 1.0, np.resize(VOLTS, len(stamps))
    return head(flags, len(stamps), OVER_TIME).encode("utf-16-le") + rows.tobytes()


def test_ltspice_writes_float32_behind_a_time_whose_sign_is_a_mark(tmp_path: Path) -> None:
    (tmp_path / "rig.raw").write_bytes(ltspice(stamps=np.where(np.arange(60) % 3 == 1, -STAMPS, STAMPS)))
    table = read_table(tmp_path / "rig.raw")
    assert [(column.name, column.unit) for column in table.columns] == [("time", "s"), ("V(in)", "V"), ("I(R1)", "A")]
    np.testing.assert_array_equal(table.find("time").values, STAMPS)
    np.testing.assert_array_equal(table.find("I(R1)").values, VOLTS.astype(np.float32))


def test_a_variable_after_the_other(tmp_path: Path) -> None:
    text = head("real forward fastaccess", len(STAMPS), OVER_TIME[:2]).encode("utf-16-le")
    (tmp_path / "rig.raw").write_bytes(text + STAMPS.tobytes() + VOLTS.astype("<f4").tobytes())
    table = read_table(tmp_path / "rig.raw")
    np.testing.assert_array_equal(table.find("time").values, STAMPS)
    np.testing.assert_array_equal(table.find("V(in)").values, VOLTS.astype(np.float32))


@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["Unix", "Windows"])
def test_numbers_as_text(tmp_path: Path, end: str) -> None:
    lines = [
        f" {k}\t{t!r}\n\t{v!r}\n\t1.5\n" for k, (t, v) in enumerate(zip(STAMPS.tolist(), VOLTS.tolist(), strict=True))
    ]
    text = head("real", len(STAMPS), OVER_TIME, end="Values:") + "".join(lines)
    (tmp_path / "rig.raw").write_text(text.replace("\n", end), newline="")
    table = read_table(tmp_path / "rig.raw")
    np.testing.assert_array_equal(table.find("V(in)").values, VOLTS)
    np.testing.assert_array_equal(table.find("I(R1)").values, 1.5)


def test_none_of_a_solvers_steps_is_a_gap(tmp_path: Path) -> None:
    (tmp_path / "rig.raw").write_bytes(ltspice())
    found = inspect_file(tmp_path / "rig.raw")
    assert (found.needed.gaps, found.needed.jitter) == (None, "resample")
    assert found.sample_time == pytest.approx(np.ptp(STAMPS) / 59, rel=0.05)


def test_the_runs_of_a_stepped_simulation_are_records_on_one_clock(tmp_path: Path) -> None:
    stamps = np.concatenate([[0.0], STAMPS, [0.0], STAMPS[:40], [0.0], STAMPS[:50]])
    (tmp_path / "rig.raw").write_bytes(ltspice(flags="real forward stepped", stamps=stamps))
    found = inspect_file(tmp_path / "rig.raw")
    assert [case.options for case in found.cases] == [{"rows": [1, 61]}, {"rows": [62, 102]}, {"rows": [103, 153]}]


@pytest.mark.parametrize("text", [False, True], ids=["binary", "text"])
def test_an_analysis_over_frequency_is_a_response(tmp_path: Path, *, text: bool) -> None:
    frequencies = np.geomspace(1.0, 1e4, 40)
    gain = 1.0 / (1.0 + 1j * frequencies / 100.0)
    variables = ["frequency\tfrequency grid=3", "V(out)\tvoltage"]
    above = head("complex", 40, variables, plot="AC Analysis", end="Values:" if text else "Binary:")
    cells = zip(frequencies.tolist(), gain.tolist(), strict=True)
    lines = "".join(f"{k}\t{f!r},0.0\n\t{g.real!r},{g.imag!r}\n" for k, (f, g) in enumerate(cells))
    numbers = lines.encode() if text else np.column_stack([frequencies + 0j, gain]).tobytes()
    (tmp_path / "rig.raw").write_bytes(above.encode() + numbers)
    with pytest.raises(ReaderError, match="sysid fit-response"):
        sysid.load(tmp_path / "rig.raw")
    response = sysid.response_data(tmp_path / "rig.raw")
    np.testing.assert_allclose(response.values, gain, rtol=1e-12)
    np.testing.assert_allclose(response.frequency, 2.0 * np.pi * frequencies, rtol=1e-12)


@pytest.mark.parametrize("plot", ["Operating Point", "DC transfer characteristic"])
def test_an_analysis_over_neither_is_refused(tmp_path: Path, plot: str) -> None:
    (tmp_path / "rig.raw").write_bytes(head("real", 1, ["V(in)\tvoltage"], plot=plot).encode() + bytes(8))
    with pytest.raises(ReaderError, match=f"no record over time.*\n.*\n.*\n.*{plot}"):
        read_table(tmp_path / "rig.raw")


@pytest.mark.parametrize("cut", [40, 200, 500, 900])
def test_what_was_cut_off_is_refused(tmp_path: Path, cut: int) -> None:
    (tmp_path / "rig.raw").write_bytes(ltspice()[:cut])
    with pytest.raises(ReaderError, match="remedy"):
        read_table(tmp_path / "rig.raw")


def test_more_points_than_memory_are_refused(tmp_path: Path) -> None:
    (tmp_path / "rig.raw").write_bytes(head("real", 10**9, OVER_TIME).encode() + bytes(64))
    with pytest.raises(ReaderError, match="MB with the points"):
        read_table(tmp_path / "rig.raw")
