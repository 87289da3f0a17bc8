"""What strangers hand over is read as what it is, or refused with what helps: never as something else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sysid
from sysid.errors import ConfigError, ReaderError, TraceError

N = 120
U, Y = np.arange(N) % 7.0, np.arange(N) % 5.0


@pytest.mark.parametrize(("bad", "unit"), [("ERR", " [V]"), ("ERR", ""), ("off", " [V]")])
def test_a_column_that_was_measured_is_not_lost(tmp_path: Path, bad: str, unit: str) -> None:
    rows = [f"{0.1 * k:.1f},{U[k]},{bad if k == 50 or bad == 'off' else Y[k]}" for k in range(N)]
    (tmp_path / "rig.csv").write_text("\n".join([f"t [s],u [V],y{unit}", *rows]))
    with pytest.raises(ReaderError, match="column y"):
        sysid.load(tmp_path / "rig.csv")


def test_remarks_beside_it_do_no_harm(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f},{U[k]},{'on' if k % 3 else 'off'},{Y[k]}" for k in range(N)]
    (tmp_path / "rig.csv").write_text("\n".join(["t [s],u [V],state,y [V]", *rows]))
    assert sysid.load(tmp_path / "rig.csv").traces[0].channel_names == ("u", "y")


@pytest.mark.parametrize("row", [list, tuple])
def test_a_list_of_rows_is_no_list_of_experiments(row: type) -> None:
    with pytest.raises(ConfigError, match="120 rows of 2 numbers") as refused:
        sysid.data([row(pair) for pair in zip(U, Y, strict=True)], sample_time=1.0)
    assert "np.array(rows)" in str(refused.value.remedy)


def test_stamps_of_32_bit_are_not_dropped() -> None:
    with pytest.raises(TraceError, match="duplicates") as refused:
        sysid.data({"t": (1e6 + 0.01 * np.arange(N)).astype(np.float32), "u": U, "y": Y})
    assert "0.0625 s" in str(refused.value.remedy)


def test_an_hour_that_comes_twice_is_not_sorted_into_itself() -> None:
    clock = pd.date_range("2024-10-27 01:30", periods=N, freq="90s", tz="Europe/Berlin")
    frame = pd.DataFrame({"u": U, "y": Y}, index=clock.tz_localize(None))
    with pytest.raises(TraceError, match="step back") as refused:
        sysid.data(frame)
    assert "tz_localize" in str(refused.value.remedy)
    assert sysid.data(frame.tz_localize("Europe/Berlin", ambiguous="infer")).sample_time == 90.0
    with pytest.raises(TraceError, match="step back") as refused:
        sysid.data({"t": np.r_[np.arange(N // 2), np.arange(N // 2)], "u": U, "y": Y})
    assert "a new recording starts" in str(refused.value.remedy)


@pytest.mark.parametrize(("name", "said"), [("run.wav", "scipy.io.wavfile"), ("run.bin", "export the traces")])
def test_a_file_of_another_kind_is_no_broken_yaml(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / name).write_bytes((b"RIFF" if name.endswith("wav") else b"") + bytes(range(256)))
    with pytest.raises(ReaderError, match="no reader knows") as refused:
        sysid.load(tmp_path / name)
    assert said in str(refused.value.remedy)
