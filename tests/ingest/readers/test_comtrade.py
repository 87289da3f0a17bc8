"""Records of relays and fault recorders: two files or one, text or binary, one rate or several, lost samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ReaderError
from sysid.ingest import read_table

N = 50
RAW = np.round(1000.0 * np.sin(0.3 * np.arange(N))).astype(np.int16)
STATE = (np.arange(N) % 7 > 3).astype(np.uint16)
CHANNELS = ("1,IA,A,line,A,0.5,2.0,0,-32767,32767,933,1,S", "2,VB,B,line,kV,0.001,0,0,-32767,32767,1,1,P")


def described(form: str, *, rates: tuple[str, ...] = (f"1200,{N}",), stamp: str = "05:55:30.075011") -> str:
    states = [f"{k},trip {k},,line,0" for k in range(1, 19)]
    when = [f"12/01/2011,{stamp}", f"12/01/2011,{stamp}"]
    head = ["Station,relay 7,2013", "20,2A,18D", *CHANNELS, *states, "60"]
    return "\r\n".join([*head, str(len(rates) if rates[0][0] != "0" else 0), *rates, *when, form, "1", ""])


def binary(form: str, raw: np.ndarray = RAW) -> bytes:
    kind = {"BINARY": "<i2", "BINARY32": "<i4", "FLOAT32": "<f4"}[form]
    rows = np.zeros(N, dtype=[("n", "<u4"), ("t", "<u4"), ("a", kind, 2), ("d", "<u2", 2)])
    rows["n"], rows["t"] = np.arange(1, N + 1), np.round(np.arange(N) * 1e6 / 1200)
    rows["a"] = np.column_stack([raw, -raw])
    rows["d"][:, 1] = STATE << 1  # the eighteenth
    return rows.tobytes()


@pytest.mark.parametrize("form", ["BINARY", "BINARY32", "FLOAT32"])
@pytest.mark.parametrize("given", ["rig.cfg", "rig.dat", "rig.CFG"])
def test_samples_are_in_their_units_whichever_of_both_files_is_named(tmp_path: Path, form: str, given: str) -> None:
    suffix = ".DAT" if given.endswith("CFG") else ".dat"
    (tmp_path / ("rig" + (".CFG" if suffix == ".DAT" else ".cfg"))).write_text(described(form), newline="")
    (tmp_path / f"rig{suffix}").write_bytes(binary(form))
    traces = sysid.load(tmp_path / given)
    assert traces.sample_time == 1.0 / 1200.0, "a stamp in whole microseconds would drift away"
    assert [channel.unit for channel in traces.channels[:3]] == ["A", "kV", "1"]
    np.testing.assert_allclose(traces.traces[0]["IA"], 0.5 * RAW + 2.0)
    np.testing.assert_allclose(traces.traces[0]["VB"], -0.001 * RAW)
    np.testing.assert_array_equal(traces.traces[0]["trip 18"], STATE)
    assert not traces.traces[0]["trip 17"].any()


def test_both_in_one_file(tmp_path: Path) -> None:
    parts = [
        "--- file type: CFG ---",
        described("BINARY"),
        "--- file type: INF ---",
        "--- file type: HDR ---",
        "a text",
    ]
    body = binary("BINARY")
    text = "\r\n".join([*parts, f"--- file type: DAT BINARY: {len(body)} ---", ""])
    (tmp_path / "rig.cff").write_bytes(text.encode() + body)
    np.testing.assert_allclose(sysid.load(tmp_path / "rig.cff").traces[0]["IA"], 0.5 * RAW + 2.0)


def test_two_rates_make_one_clock(tmp_path: Path) -> None:
    (tmp_path / "rig.cfg").write_text(described("BINARY", rates=("1200,20", f"100,{N}")), newline="")
    (tmp_path / "rig.dat").write_bytes(binary("BINARY"))
    table = read_table(tmp_path / "rig.cfg")
    steps = np.diff(table.find("time").values)
    np.testing.assert_allclose(steps[:20], 1.0 / 1200.0)
    np.testing.assert_allclose(steps[20:], 0.01)


@pytest.mark.parametrize(("stamp", "tick"), [("05:55:30.075011", 1e-6), ("05:55:30.075011969", 1e-9)])
def test_without_a_rate_the_stamps_tell(tmp_path: Path, stamp: str, tick: float) -> None:
    (tmp_path / "rig.cfg").write_text(described("BINARY", rates=(f"0,{N}",), stamp=stamp), newline="")
    (tmp_path / "rig.dat").write_bytes(binary("BINARY"))
    np.testing.assert_allclose(
        read_table(tmp_path / "rig.cfg").find("time").values, tick * np.round(np.arange(N) * 1e6 / 1200)
    )


def test_lost_samples_are_missing(tmp_path: Path) -> None:
    raw = RAW.copy()
    raw[5] = -(2**15)
    (tmp_path / "rig.cfg").write_text(described("BINARY"), newline="")
    (tmp_path / "rig.dat").write_bytes(binary("BINARY", raw))
    assert np.flatnonzero(np.isnan(read_table(tmp_path / "rig.cfg").find("IA").values)).tolist() == [5]


def test_a_dat_beside_another_cfg_is_a_table_of_text(tmp_path: Path) -> None:
    (tmp_path / "rig.cfg").write_text("[settings]\nrate = 5\n")
    (tmp_path / "rig.dat").write_text("t [s],u [V]\n" + "\n".join(f"{0.1 * k:.1f},{k % 3}" for k in range(20)))
    assert read_table(tmp_path / "rig.dat").reader == "csv"


def test_samples_that_break_off_are_refused(tmp_path: Path) -> None:
    (tmp_path / "rig.cfg").write_text(described("BINARY"), newline="")
    (tmp_path / "rig.dat").write_bytes(binary("BINARY")[:-20])
    with pytest.raises(ReaderError, match=r"50 samples.*\n.*48: cut off"):
        read_table(tmp_path / "rig.cfg")


def test_samples_of_an_unknown_form_are_refused(tmp_path: Path) -> None:
    (tmp_path / "rig.cfg").write_text(described("BINARY64"), newline="")
    (tmp_path / "rig.dat").write_bytes(binary("BINARY"))
    with pytest.raises(ReaderError, match="BINARY64"):
        read_table(tmp_path / "rig.cfg")


def test_a_record_without_its_samples_says_which_file_is_missing(tmp_path: Path) -> None:
    (tmp_path / "rig.cfg").write_text(described("BINARY"), newline="")
    with pytest.raises(ReaderError, match=r"samples of the record are missing.*\n.*\n.*rig\.dat beside it"):
        read_table(tmp_path / "rig.cfg")


@pytest.mark.parametrize("cut", [30, 120, 300, 500])
def test_a_description_that_breaks_off_is_refused(tmp_path: Path, cut: int) -> None:
    (tmp_path / "rig.cfg").write_text(described("BINARY")[:cut], newline="")
    (tmp_path / "rig.dat").write_bytes(binary("BINARY"))
    with pytest.raises(ReaderError, match="remedy"):
        read_table(tmp_path / "rig.cfg")
