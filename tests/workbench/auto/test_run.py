"""A search from its YAML, the command line and Python, to report and bundle."""

from __future__ import annotations

import json
import os
import shutil
import signal
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.estimation import fitting
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.ingest import write_csv
from sysid.reporting.results import read_results
from sysid.traces import Role
from sysid.workbench.auto import run
from sysid.workbench.auto.budget import Budget
from sysid.workbench.auto.config import AutoConfig
from sysid.workbench.auto.found import FOUND, LINEAR
from sysid.workbench.auto.refit import ENOUGH, GONE_ON, NO_BETTER, _error
from sysid.workbench.auto.run import Searched, auto_of, hire, run_auto, warned
from sysid.workbench.cli import run_cli
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.fit_steps import GivenFit
from sysid.workbench.runner.events import Event, StepProgress
from sysid.workbench.sweep.store import TRIALS, Clock, TrialStore
from sysid.workbench.sweep.trial import Bench
from sysid.workbench.sweep.workers import AbstractWorkers, InThisProcess
from tests.workbench.auto.conftest import data, record, traces

pytestmark = pytest.mark.usefixtures("small")

FEW = 240
"""Iterations of two linear structures and two networks, four times each, and of one network again."""
SEVERAL = 6 * FEW
"""The same of trials that are ``longer``, with iterations for the best network from other starts."""
FIELDS: dict[str, Any] = {"kind": "auto", "name": "tries", "data": "rig", "mapping": "u -> y", "workers": 1}
FIELDS |= {"export": None, "stability": {"count": 15}}


def searched(folder: Path, known: Data, *, told: list[Event] | None = None, find: Any = hire, **given: Any) -> Searched:
    config = AutoConfig(**{**FIELDS, "iterations": FEW, **given})
    watchers = [] if told is None else [told.append]
    return run_auto(
        auto_of(config, load=lambda: known, page=False),
        folder,
        command="sysid run tries",
        watchers=watchers,
        find_workers=find,
    )


def tried(found: Searched) -> list[tuple[int, str, float]]:
    return [(one.number, one.label, one.selection_free_run_mse) for one in found.record.trials]


@pytest.fixture
def longer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trials of twice as many iterations, where it matters how far they came: that there are none left, or how well."""
    monkeypatch.setattr("sysid.workbench.auto.parts.SEARCH", {"max_iterations": 30, "starts": 4})


@pytest.fixture(scope="module")
def known() -> Data:
    """A record with a curved system, and another to score on."""
    return data(record("a", 150), others={Role.TEST: record("test", 80, seed=1)})


TOLD: list[Event] = []


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory, known: Data, small: None) -> tuple[Path, Searched]:
    """A search with few iterations."""
    folder = tmp_path_factory.mktemp("auto")
    return folder, searched(folder, known, told=TOLD)


def test_a_last_fit_is_judged_by_the_traces_on_which_it_leaves_the_tolerance(known: Data) -> None:
    """Before its mean error, which one trace that fails hardly moves."""
    structure = sysid.ARX(na=1, nb=(1,), nk=(1,))
    config = AutoConfig(**FIELDS).sweep(structure).pipeline([FitConfig(name="lag", structure=structure)])
    judging = [record(f"bent {bend:g}", 80, seed=2, bend=bend) for bend in (0.01, 3.0)]
    fit = fitting.fit([record("a", 150, bend=0.01)], config.mapping, structure, start=config.start)
    free, plain = _error(fit, judging, config, None), _error(fit, judging, config, 0.01)
    assert free == (0, plain[1])
    assert plain[0] == 1
    assert _error(fit, judging, config, 0.9)[0] == 0


def test_a_network_is_found_and_stands_beside_the_best_linear_model(first: tuple[Path, Searched]) -> None:
    folder, found = first
    stored = read_results(folder)
    best, linear = stored.fits
    assert (best.name, linear.name) == (FOUND, LINEAR)
    assert found.record.winning is not None
    assert best.label in {found.record.winning.label, f"{found.record.winning.label}, {best.label.split(', ')[-1]}"}
    assert best.cases["test"].free_run.mse < 0.5 * linear.cases["test"].free_run.mse
    assert stored.best_name == FOUND
    assert stored.best is not None
    assert stored.best.chosen_by == found.record.chosen_by
    assert {one.label.split()[0] for one in found.record.trials} == {"ARX", "SS", "NSS"}


def test_the_chosen_one_is_fitted_once_more_to_all_of_the_record(first: tuple[Path, Searched]) -> None:
    best = first[1].results.fits[0]
    assert any("once more" in note for note in best.notes)


@pytest.mark.usefixtures("longer")
def test_where_its_starts_are_apart_the_last_fit_is_the_mean_of_several(
    tmp_path: Path, known: Data, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of starts that fit a short record alike the one of most evidence was 0.61 V off on another, their mean 0.32 V."""
    for scatter, mean in ((-1.0, True), (10.0, False)):
        monkeypatch.setattr("sysid.workbench.auto.last_fit.SCATTER", scatter)
        if not mean:  # what was tried is the same
            shutil.copytree(tmp_path / "True" / TRIALS, tmp_path / "False" / TRIALS)
        found = searched(tmp_path / str(mean), known, iterations=SEVERAL)
        assert "ensemble" not in found.record.winning.values
        assert ("mean of" in found.results.fits[0].label) is mean
        assert ("the mean of several starts" in found.record.chosen_by) is mean


def test_where_selection_traces_chose_it_is_trained_on_and_they_say_whether_for_the_better(tmp_path: Path) -> None:
    known = data(record("a", 150), others={Role.SELECTION: record("b", 100, seed=2)})
    found = searched(tmp_path, known, iterations=200)
    best, tried_with = found.results.fits[0], found.record.winning
    assert tried_with is not None
    assert any(note in {GONE_ON, ENOUGH.format(NO_BETTER)} for note in best.notes)
    assert best.cases["b"].free_run.mse <= tried_with.selection_free_run_mse
    # The two networks were trained on side by side first; what that came to is found like any trial.
    assert "the 2 best networks trained on side by side" in found.record.chosen_by
    again = searched(tmp_path, known, iterations=200, find=lambda *_: Refusing())
    assert (tried(again), again.record.chosen_by) == (tried(found), found.record.chosen_by)


def test_the_screen_hears_how_much_is_left(first: tuple[Path, Searched]) -> None:
    shares = [one.fraction for one in TOLD if isinstance(one, StepProgress) and "iterations left" in one.detail]
    assert shares == sorted(shares)
    assert shares[-1] > 0.8


def test_no_trial_sees_a_case_that_only_scores(first: tuple[Path, Searched], known: Data, tmp_path: Path) -> None:
    assert all("test" not in one.cases for one in first[1].record.trials)
    test = known.traces["test"]
    other = replace(test, values=np.asarray(test.values) + 5.0)
    again = searched(tmp_path, data(known.traces["a"], others={Role.TEST: other}))
    assert tried(again) == tried(first[1])
    assert again.record.chosen_by == first[1].record.chosen_by


def test_a_second_run_does_nothing_again(first: tuple[Path, Searched], known: Data) -> None:
    folder, found = first
    written = {file: file.stat().st_mtime_ns for file in (folder / "trials").glob("*/*.json")}
    again = searched(folder, known, find=lambda *_: Refusing())
    assert tried(again) == tried(found)
    assert again.record.chosen_by == found.record.chosen_by
    assert {file: file.stat().st_mtime_ns for file in (folder / "trials").glob("*/*.json")} == written


class Refusing(AbstractWorkers):
    """Does no job."""

    free = 1

    def submit(self, job: Any, before: Any) -> None:  # noqa: ARG002 - as all workers
        raise AssertionError("a trial is done again")

    def finished(self) -> list[Any]:
        return []

    def give_up(self) -> None:
        """Nothing is under way."""

    def close(self) -> None:
        """Nothing to let go of."""


class Dying(InThisProcess):
    """Is killed at its tenth job."""

    count = 0

    def submit(self, job: Any, before: Any) -> None:
        self.count += 1
        if self.count == 10:
            raise KeyboardInterrupt
        super().submit(job, before)


def test_a_search_that_was_killed_comes_to_the_same(first: tuple[Path, Searched], known: Data, tmp_path: Path) -> None:
    def dying(bench: Bench, _: int) -> AbstractWorkers:
        return Dying(bench)

    with pytest.raises(KeyboardInterrupt):
        searched(tmp_path, known, find=dying)
    again = searched(tmp_path, known)
    assert tried(again) == tried(first[1])
    ours, theirs = (json.loads((one / "fits" / "best-found" / "fit.json").read_text()) for one in (tmp_path, first[0]))
    assert ours["model"] == theirs["model"]


@pytest.mark.parametrize(
    ("at", "by"), [(at, by) for at in ("a trial", "the last fit") for by in (KeyboardInterrupt, SystemExit)]
)
def test_a_search_that_is_stopped_while_it_trains_comes_to_the_same(
    first: tuple[Path, Searched], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: str, by: type[BaseException]
) -> None:
    """At Ctrl-C a fit ends with its best so far; of a trial that was kept as its end, and the search went on."""
    known = data(record("a", 150), others={Role.TEST: record("test", 80, seed=1)})
    if at == "the last fit":  # what was tried before it is the same
        shutil.copytree(first[0] / TRIALS, tmp_path / TRIALS)
    left, step, last = [30 if at == "a trial" else -1], LevenbergMarquardt._step, run.refitted
    sent: list[int] = []

    def stopping(*words: Any) -> Any:
        # The last fit itself trains in threads; what it begins from is made before, and is made anew.
        left[0] -= at == "a trial" or threading.current_thread() is not threading.main_thread()
        if left[0] == 0 and not sent:
            sent.append(signal.SIGINT if by is KeyboardInterrupt else signal.SIGTERM)
            os.kill(os.getpid(), sent[0])
        return step(*words)

    def begun(*words: Any, **more: Any) -> Any:
        left[0] = 5 if at == "the last fit" else left[0]
        return last(*words, **more)

    def end(*_: object) -> None:
        raise by

    usual = signal.signal(signal.SIGTERM, end)
    with monkeypatch.context() as patch:
        patch.setattr(LevenbergMarquardt, "_step", stopping)
        patch.setattr(run, "refitted", begun)
        if at == "the last fit" and by is KeyboardInterrupt:  # what there is of it is used now
            assert searched(tmp_path, known).results.fits[0].status == "INTERRUPTED"
        else:
            with pytest.raises(by):
                searched(tmp_path, known)
    signal.signal(signal.SIGTERM, usual)
    assert sent
    again = searched(tmp_path, known)
    assert tried(again) == tried(first[1])
    ours, theirs = (json.loads((one / "fits" / "best-found" / "fit.json").read_text()) for one in (tmp_path, first[0]))
    assert (ours["model"], ours["status"]) == (theirs["model"], theirs["status"])


def test_another_seed_is_another_search(first: tuple[Path, Searched], known: Data, tmp_path: Path) -> None:
    again = searched(tmp_path, known, seed=1)
    assert tried(again) != tried(first[1])


@pytest.mark.usefixtures("longer")
def test_declared_selection_traces_choose_and_what_they_chose_is_exported_as_it_is(tmp_path: Path) -> None:
    known = data(record("a", 150), others={Role.SELECTION: record("b", 100, seed=2)})
    found = searched(tmp_path, known, iterations=200, export={"formats": ["onnx"]})
    best, winner = found.results.fits[0], found.record.winning
    assert winner is not None
    assert best.selection_mse == pytest.approx(winner.selection_free_run_mse, rel=1e-9)
    assert best.exports[0].largest_difference < 1e-9


@pytest.mark.usefixtures("longer")
def test_several_outputs_are_one_search(tmp_path: Path) -> None:
    found = searched(tmp_path, data(record("a", 150, outputs=2)), mapping="u -> y1+y2", iterations=2 * FEW)
    winner = found.record.winning
    assert winner is not None
    assert found.record.unit == "σ"  # errors count over each output's variance
    assert found.record.choice(winner) < 0.05**2
    assert len([one for one in found.results.fits if FOUND in {one.name, one.system}]) == 2


def test_a_pipeline_and_the_command_search_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_csv(record("a", 150), tmp_path / "rig.csv")
    words = ["auto", "rig.csv", "--iterations", "20", "--workers", "1", "--no-tracking"]
    assert run_cli(words) == 0
    said = capsys.readouterr().out
    assert "Why this one:" in said
    assert "budget is spent" in " ".join(said.split())
    folder = tmp_path / "runs" / "auto-rig"
    assert (folder / "bundle" / "model.json").is_file()
    assert read_results(folder).command == "sysid auto rig.csv --iterations 20 --seed 0 --workers 1"
    # What lies in the run folder makes the same run again.
    (tmp_path / "again.yaml").write_text((folder / "pipeline.yaml").read_text(), encoding="utf-8")
    assert run_cli(["run", "again.yaml", "--out", "runs/again", "--no-tracking"]) == 0
    ours, theirs = (json.loads((tmp_path / "runs" / one / "sweep.json").read_text()) for one in ("again", "auto-rig"))
    assert [one["key"] for one in ours["trials"]] == [one["key"] for one in theirs["trials"]]
    assert run_cli(["run", "again.yaml", "--dry-run"]) == 0


def test_python_searches_what_is_in_memory() -> None:
    known = traces(record("a", 150))
    found = sysid.auto(known, "u -> y", iterations=20)
    assert found.fit is not None
    assert found.to_frame()["rmse"].is_monotonic_increasing
    assert found.to_frame()["front"].any()
    assert found.why in str(found)
    run = found.fit.simulate(known["a"]["u"])
    assert run.shape == (150,)


def test_python_says_that_what_was_found_explains_next_to_nothing() -> None:
    rng = np.random.default_rng(0)
    found = sysid.auto(sysid.data((rng.normal(size=300), rng.normal(size=300)), sample_time=1.0), iterations=20)
    against = [line for line in str(found).splitlines() if line.startswith(f"Look at {FOUND}")]
    assert any("hardly better than a constant" in line for line in against)
    assert "more in the report" not in str(found)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"minutes": 1.0, "iterations": 5}, "two budgets"),
        ({"minutes": 0.0}, "minutes"),
        ({"iterations": 0}, "iterations"),
    ],
)
def test_a_budget_that_is_none_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        sysid.auto(traces(record("a", 150)), "u -> y", **given)


def test_a_data_set_without_estimation_traces_is_refused() -> None:
    known = traces(record("a", 150))
    with pytest.raises(ConfigError, match="no trace is for estimation"):
        sysid.auto(replace(known, roles={"a": Role.TEST}), "u -> y", iterations=10)


@pytest.mark.parametrize(("a_look", "again"), [(0.3, True), (3.0, False)])
def test_the_last_fits_end_in_time(
    tmp_path: Path, known: Data, monkeypatch: pytest.MonkeyPatch, a_look: float, again: bool
) -> None:
    """By a clock that goes on at each look, as on a machine that does other things."""
    looks, limits = [0], dict[str, float]()

    def session(_: Clock) -> float:
        looks[0] += 1
        return a_look * looks[0]

    def fitted(fit: FitConfig, *given: Any, **named: Any) -> Any:
        limits[fit.name] = getattr(fit.training_options(0), "max_time_s", 0.0)  # ARX has none: it is computed at once
        return whole(fit, *given, **named)

    whole = steps.fit_traces
    monkeypatch.setattr(Clock, "session", property(session))
    monkeypatch.setattr(Budget, "_busy", 1.0)  # what this machine does meanwhile has no place by such a clock
    monkeypatch.setattr("sysid.workbench.auto.finish.pace", lambda: 1.0)
    monkeypatch.setattr(steps, "fit_traces", fitted)
    found = searched(tmp_path, known, iterations=None, minutes=1.0)
    spent = TrialStore(path=tmp_path / "trials").seconds
    assert found.record.trials
    assert (FOUND in limits) is again
    assert sum(limits.values()) <= max(60.0 - spent, 0.0)
    assert any("No time was left" in one and FOUND in one for one in found.told) is not again


def test_what_a_search_warns_of_stands_with_the_fit_however_it_is_given() -> None:
    """Its notes go into the model card, its warnings into the verdict of the report."""
    fit = sysid.fit(traces(record("one", 100)), "u -> y", sysid.ARX(na=1, nb=[1], nk=[1]))
    given = GivenFit(key="one", make=lambda _: fit, bare=lambda: fit)
    searched_for: Any = SimpleNamespace(warning=lambda _: "Look here.", judged_by={"beyond": "models"})
    nothing: Any = SimpleNamespace(warning=lambda _: "", judged_by={})
    assert warned(given, nothing).make(lambda _: None) == fit
    found = warned(given, searched_for)
    assert found.key != given.key
    assert found.bare is not None
    for one in (found.make(lambda _: None), found.bare()):
        assert (one.notes[-1], one.warnings[0]) == ("Look here.", "Look here.")
    assert warned(replace(given, bare=None), searched_for).bare is None
