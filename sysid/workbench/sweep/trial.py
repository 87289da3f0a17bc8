"""One trial: train, score, and say all of it in JSON values. A function of its job alone, in whatever process."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import Any, cast

import numpy as np
from threadpoolctl import threadpool_limits

from sysid.errors import SysidError
from sysid.estimation import FitProgress, FitResult, StabilityOptions, Training, fitting
from sysid.estimation.clock import processor_time
from sysid.estimation.estimator import Estimator, Options
from sysid.estimation.estimators import ESTIMATORS, estimator_of
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.least_squares.checkpoints import Checkpoints, Watch, part_of
from sysid.models import Start
from sysid.models.store import structure_from_dict
from sysid.traces import Role, Trace, TraceSet
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.outputs import models_of
from sysid.workbench.runner.store import RunFolder
from sysid.workbench.sweep.scores import operations, scores

FAILED = "FAILED"
"""Status of a trial whose fit raised an error."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Bench:
    """What all trials of a sweep share; sent to each worker once.

    Args:
        pipeline: The pipeline that the winner will go through, as JSON values.
        traces: Every case.
        selection: The traces that choose.
        sequences: Traces over which a free run has to stay stable, where a data set of them is declared.
        folder: The run folder, where the workers can write there: a trial that is cut off then goes on where it was.
        folds: Other ways to part what is fitted from what chooses, where trials are told which one they are of.
        processor_time: Whether limits of time count the processor time of a trial, so that each comes as far beside
            whatever else the machine does; else the wall's.
    """

    pipeline: Mapping[str, Any]
    traces: TraceSet
    selection: tuple[Trace, ...]
    sequences: tuple[Trace, ...] = ()
    folder: Path | None = None
    folds: tuple[tuple[TraceSet, tuple[Trace, ...]], ...] = ()
    processor_time: bool = False

    def fold(self, number: int) -> Bench:
        """The bench with the traces of a fold.

        Args:
            number: Which one; where there are no folds, all is one.

        Returns:
            The bench.
        """
        if not self.folds:
            return self
        traces, selection = self.folds[number]
        return replace(self, traces=traces, selection=selection, folds=())

    @property
    def start(self) -> Start:
        """How each free run begins."""
        return PipelineConfig.model_validate(dict(self.pipeline)).start

    @property
    def seed(self) -> int:
        """Of what has none of its own."""
        return PipelineConfig.model_validate(dict(self.pipeline)).seed

    @property
    def stability(self) -> StabilityOptions:
        """How the free run is checked."""
        return PipelineConfig.model_validate(dict(self.pipeline)).stability.options(self.sequences)


@dataclass(frozen=True, kw_only=True)
class Job:
    """One piece of training.

    Args:
        key: Digest of everything it depends on.
        number: The point's place in the grid.
        structure: What is fitted, as JSON values.
        training: Options of the training, its seed among them; empty for a linear model.
        iterations: Where this piece ends; ``None`` for where the training ends.
        record: Share of each estimation trace that it sees.
        after: Key of the job whose result it needs.
        resume: Whether it goes on with that fit as if it had not been put aside, or only begins at its parameters.
        cost: Work, in units of its own, for the order of jobs and the time left.
        fold: Which of the bench's folds it is trained and scored on.
    """

    key: str
    number: int
    structure: Mapping[str, Any]
    training: Mapping[str, Any]
    iterations: int | None = None
    record: float = 1.0
    after: str | None = None
    resume: bool = False
    cost: float = 1.0
    fold: int = 0

    @property
    def label(self) -> str:
        """The structure, and how many members an ensemble of it has at most."""
        members = int(self.training.get("ensemble", 1))
        return structure_from_dict(self.structure).label + (f", ensemble of {members}" if members > 1 else "")


def run_job(bench: Bench, job: Job, before: Mapping[str, Any] | None) -> dict[str, Any]:
    """Train and score one point.

    Args:
        bench: Traces and conditions.
        job: What to do.
        before: The result of the job that it needs.

    Returns:
        JSON values: status, figures, the fit and where it can go on. An error of the fit is a result too.
    """
    began, cpu = time.perf_counter(), time.process_time()
    bench = bench.fold(job.fold)
    outcome = _named(job)
    try:
        with threadpool_limits(1), processor_time() if bench.processor_time else nullcontext():
            watch = _watch(bench, job)
            trained_models = _trained(bench, job, before, watch)
            trained = watch.checkpoints.earlier_s + time.perf_counter() - began
            fits = [fit for fit, _ in trained_models]
            worst = next((fit for fit in fits if not fit.status.usable), fits[0])
            first, *further = [
                {"fit": fit.to_dict(), "checkpoint": None if checkpoint is None else dict(checkpoint.fields)}
                for fit, checkpoint in trained_models
            ]
            evidences = [fit.evidence.log_evidence for fit in fits if fit.evidence is not None]
            outcome |= {
                "status": worst.status.name,
                "usable": worst.status.usable,
                "iterations": sum(_iterations(fit) for fit in fits),
                "iteration_s": max((s for s in map(_iteration_s, fits) if math.isfinite(s)), default=None),
                "parameters": sum(fit.model.n_parameters for fit in fits),
                "operations": sum(operations(fit.model) for fit in fits),
                "pole_radius": max((r for fit in fits if (r := fit.model.pole_radius) is not None), default=None),
                "log_evidence": sum(evidences) if len(evidences) == len(fits) else None,
                **first,
                "further": further,
                **scores([fit.model for fit in fits], bench.traces, bench.selection, bench.start),
            }
    except (SysidError, ArithmeticError, np.linalg.LinAlgError) as error:
        # A structure that cannot be fitted to these traces is a finding; the other trials go on.
        trained = time.perf_counter() - began
        outcome |= {"status": FAILED, "usable": False, "reason": str(error)}
    return outcome | {"seconds": trained, "cpu_s": time.process_time() - cpu}


def _trained(
    bench: Bench, job: Job, before: Mapping[str, Any] | None, watch: Watch
) -> list[tuple[FitResult, Checkpoint | None]]:
    """Train one point; however it is stopped, where it stands is kept, and what was stopped is no result.

    At Ctrl-C a fit ends with the best so far, for who wants that. A trial that is cut short is stored and never trained
    again, and would be chosen or not by how soon somebody pressed a key.
    """
    try:
        with _pressed() as pressed:
            found = train(bench, job, before, watch)
        if pressed:
            raise KeyboardInterrupt
    except (KeyboardInterrupt, SystemExit):
        watch.checkpoints.flush()
        raise
    return found


@contextmanager
def _pressed() -> Iterator[list[int]]:
    """Each Ctrl-C meanwhile, whatever part of a fit took it for the end of its own work."""
    pressed: list[int] = []
    if threading.current_thread() is not threading.main_thread() or (
        signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield pressed
        return

    def note(number: int, frame: FrameType | None) -> None:
        pressed.append(number)
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, note)
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


NOT_DONE = "it was not done when the time of the search was up"
"""The reason of a trial that was not waited for."""


def gave_up(job: Job) -> dict[str, Any]:
    """The result of a job that was not waited for any longer.

    Args:
        job: The job.

    Returns:
        JSON values.
    """
    return _named(job) | {"status": FAILED, "usable": False, "reason": NOT_DONE, "seconds": 0.0, "cpu_s": 0.0}


def _named(job: Job) -> dict[str, Any]:
    return {"key": job.key, "number": job.number, "structure": dict(job.structure), "label": job.label}


def _watch(bench: Bench, job: Job) -> Watch:
    """Where a trial's training stands, kept until its result is stored."""
    if bench.folder is None:
        return Watch(report=lambda _: None, checkpoints=Checkpoints())
    store, name = RunFolder(path=bench.folder), _checkpoint(job.key)
    checkpoints = Checkpoints(
        kept=store.checkpoint(name, job.key), save=lambda values: store.keep_checkpoint(name, job.key, values)
    )
    return Watch(report=lambda _: None, checkpoints=checkpoints)


def forget_checkpoint(bench: Bench, key: str) -> None:
    """A job's result is stored: where its training stood is of no use any more.

    Args:
        bench: Traces and conditions.
        key: The job's key.
    """
    if bench.folder is not None:
        RunFolder(path=bench.folder).drop_checkpoint(_checkpoint(key))


def _checkpoint(key: str) -> str:
    return f"trial-{key[:16]}"


def train(
    bench: Bench,
    job: Job,
    before: Mapping[str, Any] | None,
    on_progress: Callable[[FitProgress], None] = lambda _: None,
) -> list[tuple[FitResult, Checkpoint | None]]:
    """Train one point.

    Args:
        bench: Traces and conditions.
        job: What to do.
        before: The result of the job that it needs.
        on_progress: Told after every iteration; a ``Watch`` keeps where the training stands.

    Returns:
        For each of its models, of which there is one where the structure has all outputs, the fit, and where it can go
        on if it is a network's.

    Raises:
        SysidError: If it cannot be fitted.
    """
    fit = fit_of(job)
    config = PipelineConfig.model_validate(dict(bench.pipeline))
    data = Data(traces=_shortened(bench.traces, job.record), selection=bench.selection)
    training = fit.training_options(config.seed)
    if job.iterations is not None:
        training = replace(cast("Training", training), max_iterations=job.iterations)
    usable = before is not None and before["status"] != FAILED
    stood = stored_models(before) if before and usable else []
    models = models_of(fit, config)
    found: list[tuple[FitResult, Checkpoint | None]] = []
    for number, model in enumerate(models):
        kept: list[Checkpoint] = []
        result = fitting.fit(
            data.estimation,
            model.config.mapping,
            model.fit.structure,
            training,
            start=config.start,
            rest_output=model.config.rest_output,
            selection=data.selection,
            initial=FitResult.from_dict(stood[number]["fit"]) if stood and not job.resume else None,
            stability=_checked(bench, estimator_of(model.fit.structure), training),
            resume=Checkpoint(fields=stood[number]["checkpoint"]) if stood and job.resume else None,
            remarks=False,  # who is chosen gets them
            on_checkpoint=kept.append,
            on_progress=on_progress if len(models) == 1 else part_of(on_progress, str(model.config.mapping)),
        )
        found.append((result, kept[-1] if kept else None))
    return found


def fit_of(job: Job) -> FitConfig:
    """What a job fits.

    Args:
        job: The job.

    Returns:
        The fields of a fit.
    """
    return FitConfig.model_validate({"name": "trial", "structure": dict(job.structure), "training": _options(job)})


def stored_models(outcome: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Of each model of a trial, one an output or one of all, its ``fit`` and its ``checkpoint``.

    Args:
        outcome: What :func:`run_job` gave.

    Returns:
        JSON values.
    """
    return [outcome, *outcome.get("further", ())]


def _checked(bench: Bench, row: Estimator, training: Options | None) -> StabilityOptions | None:
    """How a trial is checked: where it costs nothing, or chooses between starts; else it is done for the best alone."""
    return bench.stability if row.stability.by_poles or row.chooses(training) else None


def _options(job: Job) -> dict[str, Any] | None:
    # One start at a time in one thread: processes are what runs side by side.
    side_by_side = hasattr(ESTIMATORS[job.structure["kind"]].training, "workers")
    return {**job.training, **({"workers": 1} if side_by_side else {})} if job.training else None


def _shortened(traces: TraceSet, share: float) -> TraceSet:
    """The set with the beginning of each estimation trace only."""
    if share >= 1.0:
        return traces

    def cut(trace: Trace) -> Trace:
        if traces.roles[trace.name] is not Role.ESTIMATION:
            return trace
        n = max(2, round(share * len(trace)))
        return replace(
            trace,
            values=trace.values[:n],
            usable=None if trace.usable is None else trace.usable[:n],
            weights=None if trace.weights is None else trace.weights[:n],
        )

    return replace(traces, traces=tuple(cut(trace) for trace in traces))


def _iterations(fit: FitResult) -> int:
    return int(fit.history["iteration"][-1]) if len(fit.history.get("iteration", ())) else 0


def _iteration_s(fit: FitResult) -> float:
    """Seconds of one iteration, on the clock that limits count by; NaN where none was made."""
    made = _iterations(fit)
    return float(fit.history["elapsed_s"][-1]) / made if made and "elapsed_s" in fit.history else math.nan
