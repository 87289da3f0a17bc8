"""A sweep from its YAML to report, bundle, tracking and Optuna study, on a user's own files."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from sysid.errors import ConfigError
from sysid.estimation.linear.order_search import Criterion
from sysid.reporting.results import read_results
from sysid.reporting.sweep_record import read_sweep
from sysid.workbench.cli import run_cli
from sysid.workbench.runner.events import Event, StepProgress, Warned
from sysid.workbench.runner.program import carry_out
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.run import Swept, program_of
from sysid.workbench.sweep.sweep_steps import Sweep
from sysid.workbench.sweep.table import table_of_trials
from sysid.workbench.sweep.trial import Bench
from sysid.workbench.sweep.workers import AbstractWorkers, InThisProcess
from sysid.workbench.tracking.listener import Tracker

SWEEP = """\
kind: sweep
name: tries
data: rig
mapping: inlet+valve -> outlet
rest: {outlet: 100}
structure:
  - {kind: ARX, na: {from: 1, to: 2}, nb: 1, nk: 1}
  - {kind: NARX, input_delays: {among: [1, "0:1"]}, output_delays: 1, neurons: {from: 1, to: 3}}
training: {loop: closed, max_iterations: 8}
pruning: [{iterations: 3, keep: 0.5}]
beside: [{kind: NARX, input_delays: 1, output_delays: 1, neurons: 2}]
export: {formats: [onnx]}
stability: {count: 100}
"""


def here(bench: Bench, _: SweepConfig) -> AbstractWorkers:
    """No processes: these tests are of what surrounds them."""
    return InThisProcess(bench)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, write_rig: Callable[[Path], None]) -> Path:
    """A workspace in which the sweep was run."""
    place = tmp_path_factory.mktemp("sweep")
    write_rig(place)
    return place


def run(place: Path, text: str = SWEEP, *watchers: object) -> Swept:
    file = place / "pipelines" / "tries.yaml"
    file.write_text(text, encoding="utf-8")
    return carry_out(
        program_of(Sweep.read(SweepConfig, file), find_workers=here),
        place / "runs" / "tries",
        command="sysid sweep tries",
        watchers=watchers,
    )


@pytest.fixture(scope="module")
def swept(folder: Path) -> Swept:
    """The finished sweep, and what was told of it."""
    return run(folder, SWEEP, TOLD.append)


TOLD: list[Event] = []


def test_the_winner_is_the_best_stable_one_and_goes_through_the_steps_of_any_fit(folder: Path, swept: Swept) -> None:
    record, results = swept.record, folder / "runs" / "tries"
    assert [trial.number for trial in record.trials] == list(range(1, 9))
    assert record.winning is not None
    better = [trial for trial in record.tried_in_full if record.choice(trial) < record.choice(record.winning)]
    assert {trial.structure["kind"] for trial in better} == {"NARX"}  # after eight iterations they run away
    assert f"{len(better)} that ranked higher were passed over" in record.chosen_by
    first = swept.results.fits[0]
    assert (first.name, first.label) == ("sweep winner", record.winning.label)
    assert first.selection_mse == pytest.approx(record.winning.selection_free_run_mse, rel=1e-9)
    assert first.exports[0].largest_difference < 1e-9
    assert (results / "bundle" / "model.json").is_file()
    stored = read_results(results)
    assert stored.best is not None
    assert read_sweep(results) == record
    assert (stored.kind, stored.sweep) == ("sweep", record.summary)


def test_the_best_may_be_taken_as_it_is_and_says_that_it_is_unstable(workspace: Path, swept: Swept) -> None:
    found = run(
        workspace, SWEEP.replace("{formats: [onnx]}", "null").replace("{count: 100}", "{count: 100, choose: false}")
    )
    assert found.record.winning is not None
    assert found.record.choice(found.record.winning) == min(map(found.record.choice, found.record.tried_in_full))
    first = found.results.fits[0]
    assert first.stability is not None
    assert (first.status, first.stability.stable) == ("UNSTABLE", False)
    assert first.notes[-1] == first.stability.text


def test_a_look_on_the_whole_record_changes_no_trial_that_goes_on(workspace: Path, swept: Swept) -> None:
    text = SWEEP.replace("pruning: [{iterations: 3, keep: 0.5}]\n", "").replace("{formats: [onnx]}", "null")
    full = {trial.number: trial for trial in run(workspace, text).record.trials}
    assert 0 < len(swept.record.tried_in_full) < len(full)
    for trial in swept.record.tried_in_full:
        alone = full[trial.number]
        assert (trial.iterations, trial.status) == (alone.iterations, alone.status)
        errors, theirs = ({n: case.free_run_mse for n, case in one.cases.items()} for one in (trial, alone))
        assert errors == theirs, trial.label


def test_what_was_chosen_by_hand_stands_beside_the_winner(swept: Swept) -> None:
    (hand,) = swept.record.beside
    assert (hand.label, hand.dropped_at) == ("NARX 1/1/2", None)
    assert hand.label in [fit.label for fit in swept.results.fits]


def test_the_report_says_how_the_winner_was_found(folder: Path, swept: Swept) -> None:
    page = (folder / "runs" / "tries" / "report" / "index.html").read_text(encoding="utf-8")
    for words in ("How the model was found", "on the selection traces among 8 trials", "chosen by hand"):
        assert words in page
    assert "neither fitted to nor chosen on" in page


def test_the_screen_hears_of_the_best_so_far_and_the_time_left(swept: Swept) -> None:
    told = [event.detail for event in TOLD if isinstance(event, StepProgress)]
    assert any("best so far" in detail and " left" in detail for detail in told)


def test_a_second_run_tries_nothing_again_and_tracks_each_trial_once(
    folder: Path, swept: Swept, empty_store: Path
) -> None:
    shutil.copy(empty_store, folder / "mlflow.db")
    trials = folder / "runs" / "tries" / "trials"
    written = {file: file.stat().st_mtime_ns for file in trials.glob("*/*.json")}
    tracker = Tracker.of_workspace(folder, pytest.fail)
    for _ in range(2):
        again = run(folder, SWEEP, tracker)
        assert again.record.model_copy(update={"wall_s": 0.0}) == swept.record.model_copy(update={"wall_s": 0.0})
    assert {file: file.stat().st_mtime_ns for file in trials.glob("*/*.json")} == written
    experiment = tracker.client.get_experiment_by_name("inlet+valve -> outlet · sweep tries")
    runs = tracker.client.search_runs([experiment.experiment_id])
    kinds = [found.data.tags["kind"] for found in runs]
    assert (kinds.count("trial"), kinds.count("summary")) == (8, 1)
    assert {found.data.tags["sweep"] for found in runs} == {"tries"}
    assert not any("mlflow.parentRunId" in found.data.tags for found in runs)
    summary = next(found for found in runs if found.data.tags["kind"] == "summary")
    names = [file.path for file in tracker.client.list_artifacts(summary.info.run_id)]
    assert {"images", "sweep.json", "trials.csv"} <= set(names)


def test_a_store_that_cannot_be_reached_costs_a_warning(folder: Path, swept: Swept) -> None:
    told: list[Event] = []
    run(folder, SWEEP + "storage: sqlite:////nowhere/optuna.db\n", told.append)
    assert any("not written to the Optuna store" in event.text for event in told if isinstance(event, Warned))


def test_trials_reach_an_optuna_store_and_the_command_resumes(
    folder: Path, swept: Swept, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import optuna

    url = f"sqlite:///{folder / 'optuna.db'}"
    (folder / "pipelines" / "tries.yaml").write_text(SWEEP + f"storage: {url}\n", encoding="utf-8")
    monkeypatch.chdir(folder)
    assert run_cli(["sweep", "tries", "--resume", "--no-tracking", "--workers", "1"]) == 0
    assert "Best of 8 trials" in capsys.readouterr().out
    assert len(optuna.load_study(study_name="tries", storage=url).trials) == 8


def test_the_command_refuses_what_is_no_sweep_and_what_was_not_begun(
    workspace: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (workspace / "pipelines" / "tries.yaml").write_text(SWEEP, encoding="utf-8")
    assert run_cli(["sweep", "tries", "--resume", "--no-tracking"]) == 2
    assert "there is no sweep to go on with" in capsys.readouterr().err
    assert run_cli(["sweep", "first"]) == 2
    assert "first is not a sweep" in capsys.readouterr().err


def test_without_selection_traces_the_choice_is_refused_before_it_is_made(workspace: Path) -> None:
    described = workspace / "datasets" / "rig" / "dataset.yaml"
    text = described.read_text(encoding="utf-8")
    described.write_text(text.replace("role: selection", "role: test"), encoding="utf-8")
    with pytest.raises(ConfigError, match="no selection traces"):
        run(workspace)


def test_all_cases_choose_in_a_reproduction_and_a_sampler_tries_fewer_points(workspace: Path) -> None:
    text = SWEEP.replace("pruning: [{iterations: 3, keep: 0.5}]", "method: {name: tpe, trials: 4, batch: 2}")
    text = text.replace("export: {formats: [onnx]}", "export: null")
    swept = run(workspace, text + "choose: {by: one_step_mse, on: cases}\nreproduces: an old paper\n")
    assert "repeats an old paper, which chose on the very cases" in swept.record.chosen_by
    assert len(swept.record.trials) == 4
    # The report's verdict is on the sweep's winner and by what chose it, and calls no case unseen that chose.
    best = swept.results.best
    assert best is not None
    assert (best.name, best.chosen_by, best.cases_chose) == ("sweep winner", swept.record.chosen_by, True)
    page = (workspace / "runs" / "tries" / "report" / "index.html").read_text(encoding="utf-8")
    assert "all of them took part in the choice" in page
    assert "neither fitted to nor chosen on" not in page
    assert "stay unseen" not in page


def test_the_states_of_a_state_space_are_swept_without_a_training(workspace: Path) -> None:
    structure, after = SWEEP.split("structure:\n", maxsplit=1)[0], "export: null\nstability: {count: 5}\n"
    found = run(workspace, structure + "structure: {kind: SS, states: {from: 1, to: 3}}\n" + after)
    assert [trial.label for trial in found.record.trials] == ["SS 1", "SS 2", "SS 3"]
    assert found.record.winning is not None
    assert found.results.fits[0].label == found.record.winning.label


def test_orders_of_several_linear_structures_are_one_table_and_bic_chooses(workspace: Path) -> None:
    """BIC, size and largest pole of ARX and state spaces; criteria are those of the search of orders."""
    text = SWEEP.split("structure:", maxsplit=1)[0] + (
        "structure:\n  - {kind: ARX, na: {from: 1, to: 2}, nb: 1, nk: 1}\n  - {kind: SS, states: {from: 1, to: 2}}\n"
        "choose: {by: BIC, on: estimation}\nexport: null\n"
    )
    record = run(workspace, text).record
    assert len(record.trials) == 4
    winner = min(record.trials, key=lambda trial: trial.criterion(Criterion.BIC))
    assert record.winner == winner.number
    for trial in record.trials:
        case = next(case for case in trial.cases.values() if case.role == "estimation")
        expected = case.n_samples * np.log(case.one_step_mse) + trial.parameters * np.log(case.n_samples)
        assert trial.criterion(Criterion.BIC) == pytest.approx(expected)
        assert 0.0 < trial.pole_radius < 1.0
    console = Console(width=200, file=io.StringIO())
    console.print(table_of_trials(record))
    assert "largest pole" in console.file.getvalue()  # type: ignore[attr-defined]
