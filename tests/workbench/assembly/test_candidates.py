"""Candidates: structures and seeds among which the whole chooses, in free run and one step ahead."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.ingest import load_dataset
from sysid.reporting.judging.results import read_judgement_results
from sysid.reporting.judging.tables import TableRecord
from sysid.reporting.sweep.record import SweepRecord
from sysid.workbench.assembly.runner import run_assembly
from sysid.workbench.fits.record import read_fit
from sysid.workbench.kinds import RunRequest
from sysid.workbench.sweep.run import read_sweep_file, run_sweep
from tests.workbench.assembly.conftest import PIPELINE

BASE = (
    PIPELINE.replace("    candidates: 2\n", "")
    .replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    .replace(
        "together:\n  targets: {upper: 0.1, lower: 0.1}\n  training: {max_iterations: 4, stride: 2, looks: 2}\n", ""
    )
)
LOWER = "structure: {kind: NARX, input_delays: [0], output_delays: 1, neurons: 3}\n"
SEVERAL = BASE.replace(
    LOWER,
    "structure: {kind: NARX, input_delays: 1, output_delays: 1, neurons: 3}\n"
    "    alternatives: [{kind: NARX, input_delays: 2, output_delays: 2, neurons: 2}]\n    candidates: 2\n",
)
ONE_STEP = "one_step: {max_iterations: 20, starts: 1}\n"
PUBLISHED = """\
title: Tanks
author: A. Nobody
year: 2020
kind: Report
part: all
cases: those
computer: none
comparability: none
figures: tanks.csv
"""
FIGURES = """\
source,mapping,structure,variant,loop,run,case,signal,quantity,value,unit,yardstick,note
Table 2,upper -> lower,NARX 2/2/2,,closed,free_run,V,,mse,0.25,cm^2,,
Table 3,upper -> lower,NARX 2/2/2,,open,one_step,V,,mse,0.001,cm^2,,
Table 4,upper -> lower,NARX 2/2/2,,open,free_run,V,,mse,7.5,cm^2,,
Table 6,pump -> upper -> lower,,first,closed,free_run,V,lower,mse,0.75,cm^2,,
Table 6,pump -> upper -> lower,,second,closed,free_run,V,lower,mse,0.5,cm^2,,
Table 5,upper -> lower,NARX 2/2/2,,closed,free_run,V,,run_time,0.5,s,,
"""


def run(workspace: Path, text: str) -> Path:
    """The run folder."""
    file = workspace / "pipelines" / "tanks.yaml"
    file.write_text(text, encoding="utf-8")
    assert run_assembly(RunRequest(path=file, typed="tanks", tracking=False)) == 0
    return workspace / "runs" / "tanks"


def tables(folder: Path) -> dict[str, TableRecord]:
    """The report's tables by what they begin with."""
    results = read_judgement_results(folder)
    assert results is not None
    return {" ".join(one.caption.split(":")[:1]): one for one in results.judgement.tables}


def test_every_structure_is_fitted_from_every_seed(workspace: Path) -> None:
    folder = run(workspace, SEVERAL)
    rows = tables(folder)["upper -> lower by itself, behind measured inputs"].rows
    names = [str(row[0]).split(" (")[0] for row in rows]
    assert names == ["NARX 1/1/3, seed 3", "NARX 1/1/3, seed 1003", "NARX 2/2/2, seed 3", "NARX 2/2/2, seed 1003"]
    best = min(rows, key=lambda row: float(row[-1] or 0.0))
    assert "(best alone" in str(best[0])
    assert sum("best alone" in str(row[0]) for row in rows) == sum("chosen" in str(row[0]) for row in rows) == 1
    # What stands in the table is what the stored fit does by itself.
    fit = read_fit(folder / "fits" / "upper-lower-2")
    trace = load_dataset("tanks", search=(workspace / "datasets",))["V"]
    error = np.mean((fit.model.simulate(trace.columns(["upper"])) - trace["lower"]) ** 2)
    assert rows[2][4] == pytest.approx(error, rel=1e-9)


def test_a_single_fit_has_no_table_of_candidates(workspace: Path) -> None:
    assert not any("by itself" in caption for caption in tables(run(workspace, BASE)))


def test_one_step_ahead_is_a_stage_and_a_table(workspace: Path) -> None:
    folder = run(workspace, SEVERAL + ONE_STEP)
    results = read_judgement_results(folder)
    assert results is not None
    stages = [one.name for one in results.subjects]
    assert stages == ["each alone, one step ahead", "each alone", "chosen together"]
    found = tables(folder)
    rows = found["upper -> lower by itself, fitted one step ahead"].rows
    assert [row[0] for row in rows[:2]] == ["NARX 1/1/3, seed 3: one step ahead", "NARX 1/1/3, seed 3: in free run"]
    assert len(rows) == 8
    assert len(found["pump+lower -> upper by itself, fitted one step ahead"].rows) == 2
    fit = read_fit(folder / "fits" / "upper-lower-0-one-step")
    assert fit.loop.value == "open"
    trace = load_dataset("tanks", search=(workspace / "datasets",))["V"]
    ahead = fit.model.predict(trace.columns(["upper"]), trace["lower"])
    assert rows[0][4] == pytest.approx(np.mean((ahead - trace["lower"]) ** 2), rel=1e-9)
    assert float(rows[0][4] or 0.0) < float(rows[1][4] or 0.0), (
        "the past output is measured in one, its own in the other"
    )
    (lesson, *_) = [row for row in found["The lessons, and whether each held"].rows if row[0]]
    assert lesson[0] == "A network that was fitted one step ahead fails once its loop is closed"


def test_published_models_stand_beside_candidates_of_their_structure(workspace: Path) -> None:
    (workspace / "reports" / "published").mkdir(parents=True)
    (workspace / "reports" / "published" / "tanks.yaml").write_text(PUBLISHED, encoding="utf-8")
    (workspace / "reports" / "published" / "tanks.csv").write_text(FIGURES, encoding="utf-8")
    whole = "published_models: tanks\npublished_whole: pump -> upper->lower\n"
    found = tables(run(workspace, f"{SEVERAL}{ONE_STEP}{whole}"))
    assert found["upper -> lower by itself, behind measured inputs"].rows[-1] == [
        "Table 2: NARX 2/2/2", None, None, None, 0.25, None,
    ]  # fmt: skip
    rows = found["upper -> lower by itself, fitted one step ahead"].rows
    assert [row[0] for row in rows if "Table" in str(row[0])] == ["Table 3: NARX 2/2/2", "Table 4: NARX 2/2/2"]
    assert found["lower"].rows[-2:] == [
        ["Table 6: first", None, None, None, 0.75, None],
        ["Table 6: second", None, None, None, 0.5, None],
    ]
    structures = found["upper -> lower by itself"].rows
    assert [row[0] for row in structures] == ["NARX 1/1/3", "NARX 2/2/2", "Table 5: NARX 2/2/2"]
    assert structures[-1][4] == 500.0, "in milliseconds, as ours"
    assert not any("pump+lower -> upper by itself: run time" in name for name in found), "none is published of it"


def test_a_wrong_name_of_published_models_is_said_before_anything_is_fitted(workspace: Path) -> None:
    with pytest.raises(ConfigError, match="no table of published figures is called nobodys"):
        run(workspace, f"{SEVERAL}published_models: nobodys\n")
    assert not (workspace / "runs" / "tanks" / "fits").exists()


def test_a_published_whole_needs_the_table_that_has_it(workspace: Path) -> None:
    with pytest.raises(ConfigError, match="no table is named"):
        run(workspace, f"{SEVERAL}published_whole: pump -> upper -> lower\n")


def test_a_member_of_another_structure_than_its_first_is_retrained_as_it_is(workspace: Path) -> None:
    """The larger one is so much better that the whole has it."""
    better = SEVERAL.replace(
        "{kind: NARX, input_delays: 1, output_delays: 1, neurons: 3}",
        "{kind: NARX, input_delays: [900], output_delays: 1, neurons: 1}",
    )
    folder = run(workspace, f"{better}retrain: {{members: [lower], max_iterations: 3}}\n")
    results = read_judgement_results(folder)
    assert results is not None
    chosen = next(one for one in results.subjects if one.name == "chosen together")
    assert any("lower: NARX 2/2/2" in part for part in chosen.parts) or "all as before" in chosen.parts
    assert read_fit(folder / "fits" / "upper-lower-retrained-0").model.structure.label == "NARX 2/2/2"


def test_an_alternative_that_is_no_network_is_refused(workspace: Path) -> None:
    text = SEVERAL.replace(
        "{kind: NARX, input_delays: 2, output_delays: 2, neurons: 2}", "{kind: ARX, na: 1, nb: [1], nk: [1]}"
    )
    with pytest.raises(ConfigError, match="is ARX"):
        run(workspace, text)


SWEEP = """\
kind: sweep
name: few
data: tanks
mapping: upper -> lower
start: rest
rest: {lower: 0}
structure: {kind: NARX, input_delays: 1, output_delays: {from: 1, to: 2}, neurons: {from: 1, to: 2}}
training: {loop: closed, max_iterations: 10}
method: grid
objectives: [free_run_mse]
choose: {by: free_run_mse, on: estimation}
workers: 1
export: null
"""
FROM_SWEEP = BASE.replace(LOWER, f"{LOWER}    candidates: 0\n    sweep: {{run: ../runs/few, keep: 3}}\n")


def sweep(workspace: Path, text: str) -> SweepRecord:
    """The record of a sweep that was run."""
    file = workspace / "pipelines" / "few.yaml"
    file.write_text(text, encoding="utf-8")
    return run_sweep(read_sweep_file(file), workspace / "runs" / "few", command="sysid sweep few").record


def test_candidates_are_the_best_of_a_sweep(workspace: Path) -> None:
    record = sweep(workspace, SWEEP)
    best = sorted(record.tried_in_full, key=record.choice)[:3]
    folder = run(workspace, FROM_SWEEP + ONE_STEP)
    rows = tables(folder)["upper -> lower by itself, behind measured inputs"].rows
    assert [str(row[0]).split(",")[0] for row in rows] == [one.label for one in best]
    # They are taken as they are: the same error on the same case.
    for row, trial in zip(rows, best, strict=True):
        assert row[4] == pytest.approx(trial.cases["V"].free_run_mse, rel=1e-9)
    assert not (folder / "fits" / "upper-lower-0" / "fit.json").exists()
    assert (folder / "fits" / "upper-lower-2-one-step" / "fit.json").is_file()


def test_a_sweep_that_cannot_be_used_is_refused(workspace: Path) -> None:
    with pytest.raises(ConfigError, match="the record of the sweep cannot be read"):
        run(workspace, FROM_SWEEP)
    sweep(workspace, SWEEP.replace("upper -> lower", "pump -> lower"))
    with pytest.raises(ConfigError, match="of another mapping than the member"):
        run(workspace, FROM_SWEEP)
    shutil.rmtree(workspace / "runs" / "few" / "trials")
    with pytest.raises(ConfigError, match="has no network to take"):
        run(workspace, FROM_SWEEP.replace("upper -> lower", "pump -> lower"))
    assert not (workspace / "runs" / "tanks" / "fits").exists(), "it is said before anything is fitted"


def test_a_member_without_any_candidate_is_refused(workspace: Path) -> None:
    with pytest.raises(ConfigError, match="has no candidates"):
        run(workspace, BASE.replace(LOWER, f"{LOWER}    candidates: 0\n"))
