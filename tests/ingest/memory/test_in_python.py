"""Errors at the Python door say what to write in Python, and what they say works."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ChannelError, TraceError
from sysid.ingest import inspect_file

U = np.arange(50.0)


def _holed(at: slice) -> np.ndarray:
    y = 2.0 * U
    y[at] = np.nan
    return y


def test_a_repair_is_an_argument() -> None:
    with pytest.raises(TraceError) as refused:
        sysid.data((U, _holed(slice(20, 23))), sample_time=0.1)
    offered = re.findall(r'\{"nan": "\w+"\}', refused.value.remedy or "")
    assert offered == ['{"nan": "interpolate"}', '{"nan": "hold"}', '{"nan": "mask"}']
    assert "repairs={" in (refused.value.remedy or "")
    assert str(refused.value).endswith(refused.value.remedy or "-")
    for kind in ("interpolate", "hold", "mask"):
        assert len(sysid.data((U, _holed(slice(20, 23))), sample_time=0.1, repairs={"nan": kind}).traces[0]) == 50


def test_other_errors_are_as_they_were() -> None:
    with pytest.raises(ChannelError) as refused:
        sysid.data({"u": U, "y": U}, inputs="x", outputs="y", sample_time=0.1)
    assert refused.value.missing == ("x",)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("time [s],u [V],y [m]\n" + "".join(f"{k},{k},{'' if k == 7 else k}\n" for k in range(40)), TraceError),
        ("time,u,y\n" + "".join(f"{k * 0.1},{k},{'' if k == 7 else k}\n" for k in range(40)), TraceError),
    ],
)
def test_a_file_that_needs_options_says_how_it_gets_a_description(
    text: str, error: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sysid.workbench.cli import run_cli

    monkeypatch.chdir(tmp_path)
    Path("mine.csv").write_text(text)
    with pytest.raises(error) as refused:
        sysid.load("mine.csv")
    command = re.search(r"\(sysid (ingest .*?)\)", str(refused.value))
    assert command
    assert run_cli(command[1].split()) == 0  # to the letter
    assert len(sysid.load("mine").traces[0]) == 40


def test_numbers_that_mark_missing_values_are_no_values_unless_it_is_said(tmp_path: Path) -> None:
    y = 2.0 * U
    y[10:13] = -9999.0
    with pytest.raises(TraceError, match=r'repairs=\{"marks": "missing", "nan": "mask"\}'):
        sysid.data((U, y), sample_time=0.1)
    masked = sysid.data((U, y), sample_time=0.1, repairs={"marks": "missing", "nan": "mask"}).traces[0]
    assert np.flatnonzero(~masked.usable_samples).tolist() == [10, 11, 12]
    kept = sysid.data((U, y), sample_time=0.1, repairs={"marks": "accept"}).traces[0]
    assert kept["y"][10] == -9999.0
    path = tmp_path / "run.csv"
    path.write_text(
        "t [s],u [V],y [V]\n" + "".join(f"{k / 10},{u},{v}\n" for k, (u, v) in enumerate(zip(U, y, strict=True)))
    )
    with pytest.raises(TraceError, match=r"y holds -9999"):
        sysid.load(path)
    np.savez(tmp_path / "run.npz", t=U / 10, u=U, y=y)
    assert inspect_file(tmp_path / "run.npz").needed.marks == "missing"
