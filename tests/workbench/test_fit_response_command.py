"""``sysid fit-response``: from a file of a sweep to a model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import signal

import sysid
from sysid.workbench.cli import run_cli

W = np.geomspace(0.5, 200.0, 60)
H = signal.freqs([400.0], [1.0, 4.0, 100.0], W)[1]


@pytest.fixture
def sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    columns = {"f": W, "A": 20 * np.log10(np.abs(H)), "phase": np.degrees(np.angle(H))}
    pd.DataFrame(columns).to_csv("sweep.csv", index=False)
    return tmp_path


SAID = ["--column", "gain=A", "--unit", "frequency=rad/s", "--unit", "gain=dB", "--unit", "phase=deg"]


def test_a_sweep_becomes_a_model(sweep: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["fit-response", "sweep.csv", "--poles", "2", "--zeros", "0", "--dead-time", "0", *SAID, "--no-tracking"]
    assert run_cli([*asked, "--mapping", "torque -> speed", "--out", "arm"]) == 0
    said = capsys.readouterr().out
    assert "Fit of the frequency response: 100.00 %" in said
    assert "damping 0.200" in said
    table = pd.read_csv(sweep / "arm" / "response.csv")
    np.testing.assert_allclose(table["model_gain"], np.abs(H), rtol=1e-6)
    assert sysid.read_bundle(sweep / "arm").inputs[0]["name"] == "torque"


def test_orders_that_nobody_says_are_compared(sweep: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = [
        "fit-response",
        "sweep.csv",
        "--poles",
        "1:3",
        "--dead-time",
        "0",
        "--sample-time",
        "0.001",
        *SAID,
        "--no-tracking",
    ]
    assert run_cli(asked) == 0
    said = capsys.readouterr().out
    assert "Orders by the errors at frequencies left out" in said
    assert "Note: Orders: 2 poles and 0 zeros, of" in said


@pytest.mark.parametrize(
    ("words", "says"),
    [
        pytest.param(["--poles", "two", *SAID], "not a number of poles", id="no number of poles"),
        pytest.param(["--dead-time", "0.02", *SAID], "multiple of the sample time", id="a dead time alone"),
        pytest.param(["--column", "gain"], "--column needs a pair", id="no pair"),
        pytest.param(["--discrete", *SAID], "has a sample time", id="no sample time"),
        pytest.param([], "--column gain=A", id="a column that nothing tells"),
    ],
)
@pytest.mark.usefixtures("sweep")
def test_what_is_missing_is_said(words: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["fit-response", "sweep.csv", "--poles", "2", *words]) == 2
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("command", ["ingest", "advise", "orders", "auto"])
@pytest.mark.usefixtures("sweep")
def test_commands_for_records_name_it(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli([command, "sweep.csv"]) == 2
    assert "sysid fit-response sweep.csv --poles 2" in capsys.readouterr().err
