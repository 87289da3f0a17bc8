"""A sweep that is killed in the middle of a trial goes on with that trial; what it found is exported by name."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sysid.estimation.least_squares.checkpoints import Checkpoints, Watch
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.state import State
from sysid.export import read_bundle
from sysid.traces import Role, TraceSet
from sysid.workbench.cli import run_cli
from sysid.workbench.runner.program import carry_out
from sysid.workbench.runner.store import RunFolder
from sysid.workbench.sweep import trial
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.run import Swept, program_of
from sysid.workbench.sweep.store import TrialStore
from sysid.workbench.sweep.sweep_steps import Sweep
from sysid.workbench.sweep.trial import Bench, Job, forget_checkpoint
from sysid.workbench.sweep.workers import AbstractWorkers, InThisProcess
from tests.estimation.least_squares.test_checkpoints import beside

SWEEP = """\
kind: sweep
name: tries
data: rig
mapping: inlet+valve -> outlet
rest: {outlet: 100}
structure: {kind: NARX, input_delays: 1, output_delays: 1, neurons: {from: 1, to: 2}}
training: {loop: closed, max_iterations: 5}
pruning: [{iterations: 2, keep: 0.5}]
beside: [{kind: ARX, na: 1, nb: 1, nk: 1}]
stability: {count: 20, choose: false}
export: {formats: [onnx]}
"""

pytestmark = pytest.mark.usefixtures("quick_report")


class KilledError(BaseException):
    """Stands for ``kill -9``: nothing of the program sees it coming."""


def here(bench: Bench, _: SweepConfig) -> AbstractWorkers:
    return InThisProcess(bench)


def run(workspace: Path, folder: str) -> Swept:
    file = workspace / "pipelines" / "tries.yaml"
    file.write_text(SWEEP, encoding="utf-8")
    return carry_out(
        program_of(Sweep.read(SweepConfig, file), find_workers=here),
        workspace / "runs" / folder,
        command="sysid sweep tries",
    )


def found(swept: Swept) -> str:
    """All of the trials but how long they took."""
    trials = [one.model_dump(exclude={"seconds", "cpu_s", "iteration_s"}) for one in swept.record.trials]
    return re.sub(r"'run_time_s': [^,}]+", "", repr(trials))


def test_a_killed_sweep_does_no_iteration_and_no_trial_twice(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kept, written, step = RunFolder.keep_checkpoint, TrialStore.write, LevenbergMarquardt._step
    count = {"iterations": 0, "trials": 0, "left": 10**6}

    def fall() -> None:
        count["left"] -= 1
        if count["left"] == 0:
            raise KilledError

    def keep(self: RunFolder, *values: Any) -> None:
        kept(self, *values)
        fall()

    def iterate(self: LevenbergMarquardt, *given: Any) -> State:
        count["iterations"] += 1
        return step(self, *given)

    def write(self: TrialStore, outcome: dict[str, Any]) -> None:
        fall()  # a trial has ended, and its result is not yet on the disk
        written(self, outcome)
        count["trials"] += 1

    monkeypatch.setattr(RunFolder, "keep_checkpoint", keep)
    monkeypatch.setattr(LevenbergMarquardt, "_step", iterate)
    monkeypatch.setattr(TrialStore, "write", write)
    monkeypatch.setattr(trial, "Checkpoints", partial(Checkpoints, every_s=0.0))
    whole = run(workspace, "whole")
    undisturbed = {**count, "left": 0}
    count |= {"iterations": 0, "trials": 0}
    for kill in range(100):
        count["left"] = 4 + kill
        try:
            swept = run(workspace, "tries")
        except KilledError:
            continue
        break
    assert found(swept) == found(whole)
    assert kill > 1
    assert {**count, "left": 0} == undisturbed
    assert not list((workspace / "runs" / "tries").glob(".steps/checkpoints/trial-*")), "nothing is left over"

    for name, label in (("sweep winner", swept.results.fits[0].label), ("ARX [1; 1 1; 1 1]", "ARX [1; 1 1; 1 1]")):
        assert run_cli(["export", "tries", "--fit", name, "--out", f"out {label}"]) == 0
        assert read_bundle(workspace / f"out {label}").model.structure.label == label
    assert run_cli(["export", "tries", "--fit", "winner"]) == 2
    assert "did you mean sweep winner?" in capsys.readouterr().err


def test_a_killed_trial_of_several_outputs_goes_on_with_the_model_it_was_at(tmp_path: Path) -> None:
    """Of a structure of one output a trial trains one model an output; the first of them is not trained again."""
    traces = TraceSet(name="tanks", traces=(beside(1),), roles={"tank 1": Role.ESTIMATION}, source="")
    pipeline = {"name": "p", "data": "tanks", "mapping": "pump -> level+gauge", "fits": [FIT]}
    bench = Bench(pipeline=pipeline, traces=traces, selection=(), folder=tmp_path)
    job = Job(key="k" * 64, number=0, structure=FIT["structure"], training={"max_iterations": 6, "seed": 1})
    told: list[list[Any]] = [[], [], []]

    def watch(session: int, *, fall: int = 10**6) -> Watch:
        def report(entry: Any) -> None:
            told[session].append(entry.iteration)
            if len(told[session]) == fall:
                raise KilledError

        kept = trial._watch(bench, job).checkpoints
        kept.every_s = 0.0
        return Watch(report=report, checkpoints=kept)

    expected = [fit.model.to_dict() for fit, _ in trial.train(replace(bench, folder=None), job, None, watch(0))]
    forget_checkpoint(bench, job.key)
    with pytest.raises(KilledError):
        trial.train(bench, job, None, watch(1, fall=len(told[0]) - 2))
    assert [fit.model.to_dict() for fit, _ in trial.train(bench, job, None, watch(2))] == expected
    assert [*told[1], *told[2]] == told[0]
    assert len(told[2]) == 2


FIT = {"name": "NARX", "structure": {"kind": "NARX", "input_delays": 1, "output_delays": 1, "neurons": 2}}
