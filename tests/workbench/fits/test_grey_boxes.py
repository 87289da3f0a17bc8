"""A pipeline of equations: the best of them is exported like any model, and the bundle runs from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sysid.workbench.cli import run_cli

pytestmark = pytest.mark.usefixtures("undrawn")

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
stability: {count: 10}
export: {fit: equations, formats: [c]}
"""


def test_the_best_equations_are_exported_and_run(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (workspace / "pipelines" / "grey.yaml").write_text(GREY, encoding="utf-8")
    assert run_cli(["run", "grey", "--no-tracking"]) == 0
    assert "Exporting equations as c" in " ".join(capsys.readouterr().out.split())
    bundle = workspace / "runs" / "grey" / "bundle"
    manifest = json.loads((bundle / "model.json").read_text(encoding="utf-8"))
    assert [file["format"] for file in manifest["files"]] == ["c"]
    assert manifest["state"]["equations"][0]["names"] == ["outlet"]
    record = bundle / "verify" / "record1.csv"
    assert (
        run_cli(
            [
                "simulate",
                str(bundle),
                str(record),
                "--references",
                "inlet=gauge",
                "--references",
                "outlet=gauge",
                "--out",
                str(workspace / "out.csv"),
            ]
        )
        == 0
    )
    assert (workspace / "out.csv").is_file()


BY_CASE = """\
name: cases
data: rig
mapping: inlet+valve -> outlet
seed: 3
start: estimated
fits:
  - name: equations
    structure:
      kind: GreyBox
      equations: doutlet/dt = a*valve*(inlet - outlet) - b*(outlet - 100)
      parameters: {a: {start: 0.1, low: 0, per: case}, b: {start: 0.4, low: 0}}
    training: {max_iterations: 10, starts: 1}
stability: {count: 10}
export: {fit: equations, formats: [c], case: run-1}
"""


def test_parameters_by_case_are_told_in_the_report_and_a_case_is_exported(workspace: Path) -> None:
    (workspace / "pipelines" / "cases.yaml").write_text(BY_CASE, encoding="utf-8")
    assert run_cli(["run", "cases", "--no-tracking"]) == 0
    run = workspace / "runs" / "cases"
    cases = json.loads((run / "results.json").read_text(encoding="utf-8"))["fits"][0]["cases"]
    assert all(set(case["constants"]) == {"a"} for case in cases.values())
    page = (run / "report" / "index.html").read_text(encoding="utf-8")
    assert "a of run-1" in page
    assert "parameters by case of records of cases that were not fitted" in page
    manifest = json.loads((run / "bundle" / "model.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in manifest["inputs"]] == ["inlet", "valve"]
    assert manifest["n_parameters"] == 2


def test_a_case_of_a_model_that_has_none_is_refused_before_anything_is_fitted(workspace: Path) -> None:
    text = GREY.replace("formats: [c]", "formats: [c], case: run-1")
    (workspace / "pipelines" / "grey.yaml").write_text(text, encoding="utf-8")
    assert run_cli(["run", "grey", "--no-tracking"]) != 0
    assert not (workspace / "runs" / "grey" / "fits").exists()
