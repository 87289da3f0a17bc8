"""A dry run: it runs nothing, tells what is stored, and its times hold."""

from __future__ import annotations

import itertools
import re
import statistics
import time
from pathlib import Path

import pytest

from sysid.workbench.cli import run_cli
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import Pipeline, PipelineConfig
from sysid.workbench.fits.data import load_data
from sysid.workbench.fits.run import program_of
from sysid.workbench.runner import dry_run
from sysid.workbench.runner.dry_run import PlannedStep, together
from sysid.workbench.runner.program import foretell
from sysid.workbench.runner.store import RunFolder
from tests.workbench.test_bad_inputs import contents

PIPELINE = Path("pipelines/first.yaml")


def planned(*, fresh: bool = False) -> tuple[PlannedStep, ...]:
    program = program_of(Pipeline.read(PipelineConfig, PIPELINE))
    return foretell(program, Path("runs/first"), command="sysid run first", fresh=fresh)


def change(old: str, new: str) -> None:
    text = PIPELINE.read_text()
    assert old in text
    PIPELINE.write_text(text.replace(old, new))


def of(kind: str, *, fresh: bool = False) -> list[PlannedStep]:
    return [step for step in planned(fresh=fresh) if step.step.startswith(kind)]


def test_what_is_done_is_stored(done: Path) -> None:
    assert [(step.name, step.stored) for step in planned()] == [
        ("data", False),
        ("fit-arx", True),
        ("scores-arx", True),
        ("fit-open-loop", True),
        ("scores-open-loop", True),
        ("fit-closed-loop", True),
        ("scores-closed-loop", True),
        ("export", True),
        ("advice", True),
        ("report", True),
    ]
    assert not any(step.stored for step in planned(fresh=True))


def test_nothing_is_written(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change("max_iterations: 8", "max_iterations: 9")
    before = contents(done)
    assert run_cli(["run", "first", "--dry-run"]) == 0
    told = capsys.readouterr().out
    assert contents(done) == before
    assert "Nothing was run." in told
    for words in (
        "Fitting ARX, ARX [1; 1 1; 1 1]",
        "stored",
        "then 9 iterations of",
        "Exporting closed loop as onnx",
    ):
        assert words in told


def test_a_changed_fit_and_what_starts_from_it_are_done_again(done: Path) -> None:
    change("{loop: open, max_iterations: 8}", "{loop: open, max_iterations: 9}")
    assert [step.stored for step in of("Fitting")] == [True, False, False]
    assert [step.stored for step in of("Scoring")] == [True, False, False]
    assert [step.basis for step in planned()[5:]] == ["as last time"] * 5


def test_other_seeds_take_as_long_as_last_time(done: Path) -> None:
    change("seed: 3", "seed: 4")
    assert {step.basis for step in of("Fitting")[1:]} == {"as last time"}


def test_what_is_not_known_is_said_and_not_counted(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dry_run, "PATIENCE_S", -1.0)  # it times nothing
    fits = of("Fitting")
    assert [(step.seconds, step.basis) for step in fits] == [(None, "not known before it is run")] * 3
    assert together(planned()).basis == "3 steps whose time is not known"


def test_a_fit_that_was_cut_off_has_less_to_go(done: Path) -> None:
    change("{loop: closed, max_iterations: 8}", "{loop: closed, max_iterations: 9}")
    store = RunFolder(path=Path("runs/first").resolve())
    (before,) = [step for step in of("Fitting") if not step.stored]
    assert before.seconds
    read = Pipeline.read(PipelineConfig, PIPELINE)
    data = load_data(read.config, beside=PIPELINE.resolve().parent, progress=lambda _: None)
    closed, opened = read.config.fits[2], read.config.fits[1]
    key = steps.fit_key(closed, read.config, data, steps.fit_key(opened, read.config, data, None))
    store.keep_checkpoint("fit-closed-loop", key, {"spent_s": 0.5 * before.seconds, "runs": {}})
    (after,) = [step for step in of("Fitting") if not step.stored]
    assert after.basis.endswith("it goes on where it was cut off")


def test_a_few_iterations_foretell_many(workspace: Path) -> None:
    change("{loop: closed, max_iterations: 8}", "{max_iterations: 300, patience: 300, tolerance: 0}")
    change("neurons: 2", "neurons: 12")
    read = Pipeline.read(PipelineConfig, PIPELINE)
    (step,) = [one for one in of("Fitting") if "closed loop" in one.step]
    found = re.fullmatch(r"at most: .+, then 300 iterations of (.+) ms, 1 at a time", step.basis)
    assert found
    moments: list[float] = []
    data = load_data(read.config, beside=PIPELINE.resolve().parent, progress=lambda _: None)
    fit = read.config.fits[2].model_copy(update={"initial": None})
    steps.fit_traces(fit, read.config, data, None, lambda _: moments.append(time.perf_counter()))
    taken = 1e3 * statistics.median(after - before for before, after in itertools.pairwise(moments))
    # Machines are busy in bursts: a factor of five tells a wrong estimate from a noisy one.
    assert taken / 5.0 < float(found[1]) < taken * 5.0
    assert step.seconds > 300 * 1e-3 * float(found[1]) * 0.9
