"""``sysid advise`` and ``sysid excite``, as people type them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.ingest.writers import write_trace
from sysid.workbench.cli import run_cli


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 60), 5)
    y = np.convolve(u, [0.0, 0.3, 0.2, 0.1])[:300]
    traces = sysid.data((u, y), sample_time=0.1)
    write_trace(traces.traces[0], tmp_path / "rig.csv")
    return "rig.csv"


def test_a_file_is_looked_at_and_drawn(record: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["advise", record]) == 0
    told = capsys.readouterr().out
    assert "rig: u -> y, one sample every 0.1 s" in told
    assert "[fine] u acts after 1 sample" in told
    assert "What to try?" in told
    assert Path("rig.advice.svg").is_file()


def test_what_is_wrong_is_said_in_words(record: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["advise", record, "--mapping", "v -> y"]) == 2
    assert "missing channel v" in capsys.readouterr().err
    assert run_cli(["advise", "nowhere.csv"]) == 2


@pytest.mark.parametrize(
    "words",
    [
        ["prbs", "--samples", "100", "--clock", "3", "--range=-2:5"],
        ["multisine", "--duration", "20", "--band", "0.1:2", "--periods", "2", "--lines", "odd"],
        ["noise", "--samples", "100", "--band", "0:1", "--peak", "2.5", "--seed", "7"],
        ["chirp", "--samples", "100", "--sweep", "logarithmic", "--names", "a,b", "--units", "V,mm"],
        ["staircase", "--samples", "100", "--levels", "4", "--direction", "random"],
        ["aprbs", "--samples", "100", "--hold", "5", "--longest", "9"],
    ],
    ids=lambda words: words[0],
)
def test_signals_are_written(words: list[str], record: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["excite", *words, "--sample-time", "0.1", "--out", "u.csv"]) == 0
    assert "written: u.csv" in capsys.readouterr().out
    assert len(sysid.load("u.csv").traces[0]) in {100, 200}


def test_each_channel_may_have_a_range_and_a_unit_of_its_own(record: str) -> None:
    words = ["--range", "0:100,800:3000", "--names", "valve,speed", "--units", "%,rpm", "--sample-time", "3600"]
    assert run_cli(["excite", "prbs", *words, "--samples", "48", "--out", "u.csv"]) == 0
    (drawn,) = sysid.load("u.csv").traces
    assert [(drawn[name].min(), drawn[name].max()) for name in ("valve", "speed")] == [(0.0, 100.0), (800.0, 3000.0)]


@pytest.mark.parametrize(
    "words",
    [
        ["prbs", "--range", "5"],
        ["prbs", "--range", "0:1,2:3"],
        ["prbs", "--hold", "3"],
        ["sawtooth"],
        ["noise", "--band", "1:x"],
        ["chirp", "--band", "1:99"],
    ],
)
def test_options_that_cannot_be_end_in_words(words: list[str], record: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["excite", *words, "--samples", "50", "--sample-time", "0.1", "--out", "u.csv"]) == 2
    told = capsys.readouterr().err
    assert "expected:" in told
    assert "remedy:" in told
    assert not Path("u.csv").exists()
