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
from sysid.workbench.fits.config import read_pipeline
from sysid.workbench.fits.data import load_data
from sysid.workbench.runner.plan import PlannedStep, plan
from tests.workbench.test_bad_inputs import contents

PIPELINE = Path("pipelines/first.yaml")


def planned(*, fresh: bool = False) -> tuple[PlannedStep, ...]:
    return plan(read_pipeline(PIPELINE), Path("runs/first"), fresh=fresh)


def change(old: str, new: str) -> None:
    text = PIPELINE.read_text()
    assert old in text
    PIPELINE.write_text(text.replace(old, new))


def test_what_is_done_is_stored(done: Path) -> None:
    assert [(step.step.split()[0], step.stored) for step in planned()] == [
        ("Loading", False),
        ("Fitting", True),
        ("Fitting", True),
        ("Fitting", True),
        ("Exporting", True),
        ("Writing", True),
    ]
    assert [step.stored for step in planned(fresh=True)] == [False] * 6


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
    assert [step.stored for step in planned()[1:4]] == [True, False, False]
    assert [step.basis for step in planned()[3:]] == ["as last time", "as last time", "as last time"]


def test_other_seeds_take_as_long_as_last_time(done: Path) -> None:
    change("seed: 3", "seed: 4")
    assert {step.basis for step in planned()[2:4]} == {"as last time"}


def test_a_few_iterations_foretell_many(workspace: Path) -> None:
    change("{loop: closed, max_iterations: 8}", "{max_iterations: 300, patience: 300, tolerance: 0}")
    change("neurons: 2", "neurons: 12")
    read = read_pipeline(PIPELINE)
    (step,) = [one for one in planned() if "closed loop" in one.step]
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


def test_another_kind_of_pipeline_is_refused(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change("name: first\n", "name: first\nkind: sweep\n")
    assert run_cli(["run", "first", "--dry-run"]) == 2
    assert "no dry run for pipelines of kind sweep" in capsys.readouterr().err
