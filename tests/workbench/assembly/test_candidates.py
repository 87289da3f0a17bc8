"""Candidates: structures and seeds among which the whole chooses, in free run and one step ahead."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.ingest import load_dataset
from sysid.reporting.assembly.member_tables import member_tables
from sysid.reporting.assembly.results import MemberRecord
from sysid.reporting.assembly.tables import stage_table
from sysid.reporting.published.tables import read_published
from sysid.reporting.sweep_record import SweepRecord
from sysid.workbench.commands.run import run_request
from sysid.workbench.fits.record import read_fit
from sysid.workbench.kinds import RunRequest
from sysid.workbench.runner.program import carry_out
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.run import program_of
from sysid.workbench.sweep.sweep_steps import Sweep
from tests.workbench.assembly.conftest import PIPELINE, assembly_results

BASE = (
    PIPELINE.replace("    candidates: 2\n", "")
    .replace("retrain: {members: [lower], max_iterations: 5}\n", "")
    .replace(
        "together:\n  targets: {upper: 0.1, lower: 0.1}\n  training: {max_iterations: 4, stride: 2, checkpoints: 2}\n",
        "",
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
    assert run_request(RunRequest(path=file, typed="tanks", tracking=False)) == 0
    return workspace / "runs" / "tanks"


def members(folder: Path) -> dict[str, MemberRecord]:
    """The members that had a choice, by their mapping."""
    return {one.mapping: one for one in assembly_results(folder).members}


def test_every_structure_is_fitted_from_every_seed(workspace: Path) -> None:
    folder = run(workspace, SEVERAL)
    found = members(folder)["upper -> lower"].candidates
    assert [(one.structure, one.seed) for one in found] == [
        (structure, seed) for structure in ("NARX 1/1/3", "NARX 2/2/2") for seed in (3, 1003)
    ]
    assert min(found, key=lambda one: one.selection).best_alone
    assert sum(one.best_alone for one in found) == sum(one.chosen for one in found) == 1
    # What is stored is what the stored fit does by itself.
    fit = read_fit(folder / "fits" / "upper-lower-2")
    trace = load_dataset("tanks", search=(workspace / "datasets",))["V"]
    error = np.mean((fit.model.simulate(trace.columns(["upper"])) - trace["lower"]) ** 2)
    assert found[2].free_run_mse["V"] == pytest.approx(error, rel=1e-9)


def test_a_single_fit_had_no_choice(workspace: Path) -> None:
    assert members(run(workspace, BASE)) == {}


def test_one_step_ahead_is_a_stage_and_a_table(workspace: Path) -> None:
    folder = run(workspace, SEVERAL + ONE_STEP)
    results = assembly_results(folder)
    stages = [one.name for one in results.stages]
    assert stages == ["each alone, one step ahead", "each alone", "chosen together"]
    found = {mapping: [one.one_step for one in member.candidates] for mapping, member in members(folder).items()}
    assert {mapping: len(fits) for mapping, fits in found.items()} == {"pump+lower -> upper": 1, "upper -> lower": 4}
    assert None not in [one for fits in found.values() for one in fits]
    first = found["upper -> lower"][0]
    assert first is not None
    fit = read_fit(folder / "fits" / "upper-lower-0-one-step")
    assert fit.loop.value == "open"
    trace = load_dataset("tanks", search=(workspace / "datasets",))["V"]
    ahead = fit.model.predict(trace.columns(["upper"]), trace["lower"])
    assert first.one_step_mse["V"] == pytest.approx(np.mean((ahead - trace["lower"]) ** 2), rel=1e-9)
    assert first.one_step_mse["V"] < first.free_run_mse["V"], "the past output is measured in one, its own in the other"
    assert results.ablation[0].step == "close_loop"


def test_published_models_stand_beside_candidates_of_their_structure(workspace: Path) -> None:
    (workspace / "reports" / "published").mkdir(parents=True)
    (workspace / "reports" / "published" / "tanks.yaml").write_text(PUBLISHED, encoding="utf-8")
    (workspace / "reports" / "published" / "tanks.csv").write_text(FIGURES, encoding="utf-8")
    whole = "published_models: tanks\npublished_whole: pump -> upper->lower\n"
    folder = run(workspace, f"{SEVERAL}{ONE_STEP}{whole}")
    results, published = assembly_results(folder), read_published("tanks", workspace=workspace)
    upper, lower = (member_tables(one, published) for one in results.members)
    free, ahead, times = (
        [[cell.text for cell in row[:1]] + [cell.value for cell in row[1:]] for row in t.rows] for t in lower
    )
    assert free[-1] == ["Table 2: NARX 2/2/2", None, None, None, 0.25, None]
    assert [row[0] for row in ahead if "Table" in str(row[0])] == ["Table 3: NARX 2/2/2", "Table 4: NARX 2/2/2"]
    assert [row[0] for row in times] == ["NARX 1/1/3", "NARX 2/2/2", "Table 5: NARX 2/2/2"]
    assert times[-1][4] == 500.0, "in milliseconds, as ours"
    assert len(upper) == 2, "no run time is published of it"
    first, second = stage_table(results, "lower", published).rows[-2:]
    assert [(row[0].text, row[4].value) for row in (first, second)] == [
        ("Table 6: first", 0.75),
        ("Table 6: second", 0.5),
    ]


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
    (lower,) = [one for one in assembly_results(folder).members if one.mapping == "upper -> lower"]
    assert [one.structure for one in lower.candidates if one.chosen] == ["NARX 2/2/2"]
    assert read_fit(folder / "fits" / "upper-lower-retrained-0").model.structure.label == "NARX 2/2/2"


def test_an_alternative_that_is_no_network_is_refused(workspace: Path) -> None:
    text = SEVERAL.replace(
        "{kind: NARX, input_delays: 2, output_delays: 2, neurons: 2}", "{kind: ARX, na: 1, nb: [1], nk: [1]}"
    )
    with pytest.raises(ConfigError, match="an ARX model cannot be a member"):
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
    return carry_out(
        program_of(Sweep.read(SweepConfig, file)), workspace / "runs" / "few", command="sysid sweep few"
    ).record


def test_candidates_are_the_best_of_a_sweep(workspace: Path) -> None:
    record = sweep(workspace, SWEEP)
    best = sorted(record.tried_in_full, key=record.choice)[:3]
    folder = run(workspace, FROM_SWEEP + ONE_STEP)
    found = members(folder)["upper -> lower"].candidates
    assert [one.structure for one in found] == [one.label for one in best]
    # They are taken as they are: the same error on the same case.
    for one, trial in zip(found, best, strict=True):
        assert one.free_run_mse["V"] == pytest.approx(trial.cases["V"].free_run_mse, rel=1e-9)
    assert not (folder / "fits" / "upper-lower-0" / "fit.json").exists()
    assert (folder / "fits" / "upper-lower-2-one-step" / "fit.json").is_file()


def test_a_sweep_that_cannot_be_used_is_refused(workspace: Path) -> None:
    with pytest.raises(ConfigError, match=r"(?s)holds no results.*sweep.json"):
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
