"""A kind of model that has no files to run elsewhere: the run says so, and goes on."""

from __future__ import annotations

from pathlib import Path

import pytest

from sysid.workbench.cli import run_cli

GREY = """\
name: grey
data: rig
mapping: inlet+valve -> outlet
seed: 3
fits:
  - name: equations
    structure:
      kind: GreyBox
      equations: doutlet/dt = a*valve*(inlet - outlet) - b*(outlet - 100)
      parameters: {a: {start: 0.01, low: 0}, b: {start: 0.1, low: 0}}
    training: {max_iterations: 3, starts: 1}
"""


def test_the_run_goes_on_without_a_bundle(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (workspace / "pipelines" / "grey.yaml").write_text(GREY, encoding="utf-8")
    assert run_cli(["run", "grey", "--no-tracking"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "nothing is exported: equations is best, and models of kind GreyBox have no files yet" in told
    assert (workspace / "runs" / "grey" / "results.json").is_file()
    assert not (workspace / "runs" / "grey" / "bundle").exists()


def test_a_fit_that_is_named_is_refused_before_anything_is_fitted(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = GREY + "export: {fit: equations}\n"
    (workspace / "pipelines" / "grey.yaml").write_text(text, encoding="utf-8")
    assert run_cli(["run", "grey", "--no-tracking"]) == 2
    assert "models of kind GreyBox cannot be exported yet" in capsys.readouterr().err
    assert not (workspace / "runs" / "grey" / "fits").exists()
