"""A pipeline end to end on a user's own CSV files: what is stored, what a killed run loses, what a change costs."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sysid
from sysid import atomic, code_digest
from sysid.code_digest import look_again
from sysid.errors import ParityError
from sysid.estimation import FitResult, Status
from sysid.models import Start
from sysid.reporting.results import Results, read_results
from sysid.validation import evaluate
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig, Pipeline, PipelineConfig
from sysid.workbench.fits.data import load_data
from sysid.workbench.fits.record import read_fit, read_scores
from sysid.workbench.fits.run import program_of
from sysid.workbench.runner import events
from sysid.workbench.runner.program import carry_out
from sysid.workbench.runner.store import RunFolder

FITS = ("ARX", "open loop", "closed loop")


def run(workspace: Path, *, fresh: bool = False) -> tuple[Results, dict[str, bool]]:
    """Run the workspace's pipeline; also which fits were taken from an earlier run."""
    stored: dict[str, bool] = {}

    def watch(event: events.Event) -> None:
        if isinstance(event, events.FitReady):
            stored[event.config.name] = event.stored

    read = Pipeline.read(PipelineConfig, workspace / "pipelines" / "first.yaml")
    return carry_out(
        program_of(read), workspace / "run", command="sysid run first", fresh=fresh, watchers=[watch]
    ), stored


def rewrite(workspace: Path, old: str, new: str) -> None:
    file = workspace / "pipelines" / "first.yaml"
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


def test_own_data_from_a_yaml(workspace: Path) -> None:
    rewrite(workspace, "neurons: 2", "neurons: 6")
    rewrite(workspace, "max_iterations: 8", "max_iterations: 200")
    rewrite(workspace, "{loop: closed, ", "{loop: closed, starts: 4, ")
    rewrite(workspace, "export: null", "export: {tolerance: 1.0e-9}")
    results, stored = run(workspace)
    assert stored == dict.fromkeys(FITS, False)
    # As text: what was not computed is NaN, and NaN differs from itself as a number.
    assert read_results(workspace / "run").model_dump_json() == results.model_dump_json()
    assert [(fit.name, fit.loop.value, fit.mapping) for fit in results.fits] == [
        ("ARX", "open", "inlet+valve -> outlet"),
        ("open loop", "open", "inlet+valve -> outlet"),
        ("closed loop", "closed", "inlet+valve -> outlet"),
    ]
    closed = results.fits[2]
    assert {name: (case.role.value, case.free_run.unit) for name, case in closed.cases.items()} == {
        "run-1": ("estimation", "kPa"),
        "run-2": ("selection", "kPa"),
        "run-3": ("validation", "kPa"),
    }
    assert results.data.sample_time == 0.05
    # The rig multiplies and saturates: a network that does not beat the linear model has learnt nothing.
    assert closed.cases["run-3"].free_run.mse < 0.1 * results.fits[0].cases["run-3"].free_run.mse
    assert closed.selection_mse == closed.cases["run-2"].free_run.mse
    assert results.best is not None
    assert results.best.name == "closed loop"
    exported = {entry.file: entry for entry in closed.exports}
    assert {entry.format for entry in exported.values()} == {"onnx", "c"}
    assert all(entry.largest_difference <= 1e-9 and entry.unit == "kPa" for entry in exported.values())
    folder = workspace / "run"
    assert all((folder / file).is_file() for file in exported)
    for file in ("results.json", "environment.json", "pipeline.yaml", "report/index.html"):
        assert (folder / file).stat().st_size > 0
    assert (folder / "pipeline.yaml").read_bytes() == (workspace / "pipelines" / "first.yaml").read_bytes()


def test_a_file_that_is_refused_costs_nobody_the_report(workspace: Path) -> None:
    rewrite(workspace, "export: null", "export: {formats: [onnx], tolerance: 1.0e-6}")
    run(workspace)
    rewrite(workspace, "tolerance: 1.0e-6", "tolerance: 1.0e-30")
    with pytest.raises(ParityError, match=r"does not reproduce its model"):
        run(workspace)
    results = read_results(workspace / "run")
    assert results.best is not None
    assert not any(fit.exports for fit in results.fits)
    assert ".onnx does not reproduce its model (" in results.best.chosen_by
    assert results.best.chosen_by in (workspace / "run" / "report" / "index.html").read_text(encoding="utf-8")
    # What an earlier run exported is not what the results are of.
    assert not (workspace / "run" / "bundle").exists()
    assert (workspace / "run" / "bundle-before" / "model.json").is_file()


@pytest.fixture
def no_report(quick_report: None) -> None:
    """The report costs two seconds, and most of what follows is not about it."""


@pytest.fixture(scope="module")
def first_run(
    tmp_path_factory: pytest.TempPathFactory,
    write_rig: Callable[[Path], None],
    report_stub: Callable[[Path], Path],
) -> tuple[Path, Results]:
    """The workspace's pipeline, run once for all tests of what a second run does, and its results."""
    folder = tmp_path_factory.mktemp("first")
    write_rig(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sysid.reporting.report.write_report", report_stub)
        patch.chdir(folder)
        results, stored = run(folder)
    assert stored == dict.fromkeys(FITS, False)
    return folder, results


@pytest.fixture
def first(first_run: tuple[Path, Results], workspace: Path, no_report: None) -> Results:
    """Results of a first run, which stands in the workspace."""
    shutil.copytree(first_run[0] / "run", workspace / "run")
    return first_run[1]


def test_a_report_is_written_again_only_if_something_changed(workspace: Path, first: Results) -> None:
    page = workspace / "run" / "report" / "index.html"
    written = page.stat().st_mtime_ns
    again, _ = run(workspace)
    assert page.stat().st_mtime_ns == written
    assert again.created == first.created
    rewrite(workspace, "name: ARX", "name: linear")
    run(workspace)
    assert page.stat().st_mtime_ns > written


@pytest.mark.usefixtures("first")
def test_stored_results_are_the_computed_ones(workspace: Path) -> None:
    folder = RunFolder(path=workspace / "run").fit("closed-loop")
    fit, scores = read_fit(folder), read_scores(folder)
    read = Pipeline.read(PipelineConfig, workspace / "pipelines" / "first.yaml")
    data = load_data(read.config, beside=read.path.parent, progress=lambda _: None)
    again = evaluate(fit.model, data.traces, Start())
    for name, case in again.cases.items():
        np.testing.assert_array_equal(scores.evaluation.cases[name].simulated, case.simulated)
        np.testing.assert_array_equal(scores.evaluation.cases[name].predicted, case.predicted)
        assert scores.evaluation.cases[name].free_run == case.free_run


def test_a_second_run_fits_nothing(workspace: Path, first: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(steps, "fit_traces", lambda *_: pytest.fail("fitted again"))
    monkeypatch.setattr(steps, "score", lambda *_: pytest.fail("scored again"))
    second, stored = run(workspace)
    assert stored == dict.fromkeys(FITS, True)
    assert [fit.model_dump_json() for fit in second.fits] == [fit.model_dump_json() for fit in first.fits]


def test_fresh_does_everything_again_with_the_same_result(workspace: Path, first: Results) -> None:
    second, stored = run(workspace, fresh=True)
    assert stored == dict.fromkeys(FITS, False)
    for before, after in zip(first.fits, second.fits, strict=True):
        assert {n: c.free_run for n, c in after.cases.items()} == {n: c.free_run for n, c in before.cases.items()}


@pytest.mark.usefixtures("first")
def test_a_changed_fit_does_not_concern_the_others(workspace: Path) -> None:
    rewrite(workspace, "loop: closed, max_iterations: 8", "loop: closed, max_iterations: 9")
    _, stored = run(workspace)
    assert stored == {"ARX": True, "open loop": True, "closed loop": False}


@pytest.mark.usefixtures("first")
def test_a_changed_initial_fit_concerns_what_starts_from_it(workspace: Path) -> None:
    rewrite(workspace, "loop: open, max_iterations: 8", "loop: open, max_iterations: 7")
    _, stored = run(workspace)
    assert stored == {"ARX": True, "open loop": False, "closed loop": False}


def test_a_damaged_result_is_done_again(workspace: Path, first: Results) -> None:
    damaged = workspace / "run" / "fits" / "open-loop" / "fit.json"
    damaged.write_text(damaged.read_text()[:-20], encoding="utf-8")
    second, stored = run(workspace)
    assert stored == {"ARX": True, "open loop": False, "closed loop": True}
    assert second.fits[1].cases["run-3"].free_run == first.fits[1].cases["run-3"].free_run


@pytest.fixture
def own_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the package, which stands for its code wherever that is looked at."""
    copy = tmp_path / "code" / "sysid"
    shutil.copytree(Path(sysid.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(code_digest, "_home", lambda _: copy)
    look_again()
    yield copy
    look_again()


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    look_again()


def fit_keys(workspace: Path) -> dict[str, str]:
    """What each stored fit depends on, by its stamp."""
    stamps = (workspace / "run" / ".steps").glob("fit-*.json")
    return {file.stem: json.loads(file.read_text(encoding="utf-8"))["key"] for file in stamps}


@pytest.mark.usefixtures("no_report")
def test_results_outlive_words_and_no_change_of_what_made_them(workspace: Path, own_code: Path) -> None:
    _, stored = run(workspace)
    assert stored == dict.fromkeys(FITS, False)
    change(own_code / "estimation" / "linear" / "arx.py", '"""', '"""Said better: ')
    change(own_code / "estimation" / "networks" / "narx.py", "import numpy", "# A comment.\nimport numpy")
    (own_code / "export" / "modelica.py").write_text("def export_modelica():\n    return 1\n", encoding="utf-8")
    look_again()
    _, stored = run(workspace)
    assert stored == dict.fromkeys(FITS, True)
    before = fit_keys(workspace)
    change(own_code / "kernels" / "cascade.py", "range(past, len(values))", "range(0 + past, len(values))")
    _, stored = run(workspace)
    assert stored == dict.fromkeys(FITS, False)
    # The figures of all are made with it, but the least squares of an ARX are not.
    assert {name: key == before[name] for name, key in fit_keys(workspace).items()} == {
        "fit-arx": True,
        "fit-open-loop": False,
        "fit-closed-loop": False,
    }


KILLER = """
import os, signal, sys
from pathlib import Path
import sysid.reporting.report
from sysid import atomic
from sysid.workbench.fits.config import Pipeline, PipelineConfig
from sysid.workbench.fits.run import program_of
from sysid.workbench.runner.program import carry_out

replacing = atomic.replacing
def dying(path):
    if path.as_posix().endswith(sys.argv[1]):
        os.kill(os.getpid(), signal.SIGKILL)
    return replacing(path)
atomic.replacing = dying
pipeline = Pipeline.read(PipelineConfig, Path("pipelines/first.yaml"))
carry_out(program_of(pipeline), Path("run"), command="sysid run first")
"""


class KilledError(BaseException):
    """Ends a run where it is; starting an interpreter to kill it takes ten times as long."""


def killed(workspace: Path, about_to_write: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that ended when it was about to write a file."""
    replacing = atomic.replacing

    def dying(path: Path) -> AbstractContextManager[Path]:
        if path.as_posix().endswith(about_to_write):
            raise KilledError
        return replacing(path)

    with monkeypatch.context() as patch, pytest.raises(KilledError):
        patch.setattr(atomic, "replacing", dying)
        run(workspace)


@pytest.mark.usefixtures("no_report")
@pytest.mark.parametrize(
    ("about_to_write", "kept", "really"),
    [
        pytest.param("fits/arx/fit.json", (), False, id="before the first fit is written"),
        pytest.param(".steps/fit-arx.json", (), False, id="before the first fit is stamped"),
        pytest.param("fits/open-loop/signals.npz", ("ARX",), True, id="before a fit's signals are written, by SIGKILL"),
        pytest.param(".steps/scores-open-loop.json", ("ARX",), False, id="before a fit's figures are stamped"),
        pytest.param("fits/closed-loop/fit.json", ("ARX", "open loop"), False, id="after a fit, before it is written"),
        pytest.param(".steps/report.json", FITS, False, id="after everything but the report's stamp"),
    ],
)
def test_a_killed_run_goes_on_where_it_was(
    workspace: Path, about_to_write: str, kept: tuple[str, ...], *, really: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if really:
        done = subprocess.run([sys.executable, "-c", KILLER, about_to_write], check=False)
        assert done.returncode == -signal.SIGKILL
        # Both runs shall see the same code, also while somebody is working on it.
        look_again()
    else:
        killed(workspace, about_to_write, monkeypatch)
    results, stored = run(workspace)
    assert stored == {name: name in kept for name in FITS}
    assert [fit.name for fit in results.fits] == list(FITS)
    assert (workspace / "run" / "report" / "index.html").is_file()


@pytest.mark.usefixtures("no_report")
def test_an_interrupted_fit_is_used_now_and_done_again_next_time(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = steps.fit_traces

    def interrupted(fit: FitConfig, *arguments: Any) -> FitResult:
        result = whole(fit, *arguments)
        if fit.name != "open loop":
            return result
        return FitResult(
            model=result.model, status=Status.INTERRUPTED, loop=result.loop, history=result.history, train_time_s=0.1
        )

    with monkeypatch.context() as patch:
        patch.setattr(steps, "fit_traces", interrupted)
        results, _ = run(workspace)
    assert [fit.status for fit in results.fits][1] == "INTERRUPTED"
    results, stored = run(workspace)
    # What started from the interrupted fit is done again with it.
    assert stored == {"ARX": True, "open loop": False, "closed loop": False}
    assert "INTERRUPTED" not in [fit.status for fit in results.fits]


@pytest.mark.usefixtures("no_report")
def test_a_run_that_is_killed_early_leaves_results_of_what_is_finished(workspace: Path) -> None:
    def stop(event: events.Event) -> None:
        if isinstance(event, events.FitReady) and event.config.name == "closed loop":
            raise KeyboardInterrupt

    read = Pipeline.read(PipelineConfig, workspace / "pipelines" / "first.yaml")
    with pytest.raises(KeyboardInterrupt):
        carry_out(program_of(read), workspace / "run", command="sysid run first", watchers=[stop])
    left = read_results(workspace / "run")
    assert [fit.name for fit in left.fits] == ["ARX", "open loop"]
    assert left.best is None


@pytest.mark.usefixtures("no_report")
def test_progress_of_several_starts_never_falls(workspace: Path) -> None:
    rewrite(
        workspace,
        "loop: closed, max_iterations: 8}\n    initial: open loop",
        "loop: closed, max_iterations: 8, starts: 3}",
    )
    shares: list[float] = []

    def watch(event: events.Event) -> None:
        if isinstance(event, events.StepProgress) and "closed loop" in event.step and event.fraction is not None:
            shares.append(event.fraction)

    read = Pipeline.read(PipelineConfig, workspace / "pipelines" / "first.yaml")
    carry_out(program_of(read), workspace / "run", command="", watchers=[watch])
    assert len(shares) > 10
    assert (np.diff(shares) >= 0.0).all()
    assert 0.0 <= shares[0] < shares[-1] <= 1.0


def test_results_are_strict_json(workspace: Path) -> None:
    run(workspace)
    for file in (workspace / "run").rglob("*.json"):
        json.loads(file.read_text(encoding="utf-8"), parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
