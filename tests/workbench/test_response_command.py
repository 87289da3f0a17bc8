"""``sysid response``: a fit of a run with its intervals, or a bundle."""

from __future__ import annotations

from pathlib import Path

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
    ("words", "says"),
    [
        pytest.param(["runs/first"], "not linear", id="the best is a network"),
        pytest.param(["runs/first", "--fit", "ARY"], "did you mean ARX?", id="no such fit"),
        pytest.param(["runs/first/bundle", "--fit", "ARX"], "a bundle has one model", id="a bundle has no fits"),
        pytest.param(["nothing"], "nothing", id="nothing there"),
        pytest.param(["runs/first", "--fit", "ARX", "--seconds", "nan"], "not a length", id="no length"),
    ],
)
@pytest.mark.usefixtures("done")
def test_what_cannot_be_answered_is_said(words: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli(["response", *words]) == 2
    assert says in capsys.readouterr().err
