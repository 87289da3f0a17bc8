"""``sysid response``: a fit of a run with its intervals, or a bundle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sysid.workbench.cli import run_cli


def test_a_fit_of_a_run_is_told_and_written(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["response", "first", "--fit", "ARX", "--seconds", "30", "--out", "there"]) == 0
    said = capsys.readouterr().out
    assert "time constant" in said
    assert "inlet: gain" in said
    steps = pd.read_csv(done / "there" / "arx.step.csv")
    assert set(steps["input"]) == {"inlet", "valve"}
    assert ((steps["low"] <= steps["value"]) & (steps["value"] <= steps["high"])).all()
    assert (done / "there" / "arx.bode.svg").read_text().startswith("<svg")


@pytest.mark.parametrize(
    ("unit", "words", "expected"),
    [
        pytest.param("rad/s", "0.01,0.02,0.5", [0.01, 0.02, 0.5], id="numbers"),
        pytest.param("rad/s", "0.001:0.1:3", [0.001, 0.01, 0.1], id="a range"),
        pytest.param("Hz", "0.001:0.1:3", [0.002 * np.pi, 0.02 * np.pi, 0.2 * np.pi], id="in the unit that is drawn"),
    ],
)
def test_a_bode_diagram_is_at_the_frequencies_that_are_asked_for(
    done: Path, unit: str, words: str, expected: list[float]
) -> None:
    asked = ["--frequency", unit, "--frequencies", words, "--out", "asked"]
    assert run_cli(["response", "first", "--fit", "ARX", *asked]) == 0
    table = pd.read_csv(done / "asked" / "arx.bode.csv")
    np.testing.assert_allclose(np.unique(table["frequency"]), expected)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        pytest.param(["runs/first"], "not linear", id="the best is a network"),
        pytest.param(["runs/first", "--fit", "ARY"], "did you mean ARX?", id="no such fit"),
        pytest.param(["runs/first/bundle", "--fit", "ARX"], "a bundle has one model", id="a bundle has no fits"),
        pytest.param(["nothing"], "nothing", id="nothing there"),
        pytest.param(["runs/first", "--fit", "ARX", "--seconds", "nan"], "not a length", id="no length"),
        pytest.param(["runs/first", "--fit", "ARX", "--frequencies", "1:x"], "no frequencies", id="no frequencies"),
        pytest.param(["runs/first", "--fit", "ARX", "--frequencies", "-1,2"], "no frequencies", id="below zero"),
    ],
)
@pytest.mark.usefixtures("done")
def test_what_cannot_be_answered_is_said(words: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["response", *words]) == 2
    assert says in capsys.readouterr().err
