"""What a run would do: which steps are stored already, and how long each of the others will take.

Times come from the last run in the folder where it did the same, otherwise from a few iterations on the very traces,
measured now on this machine. They are upper limits: a start that converges ends early.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sysid.errors import ConfigError, SysidError
from sysid.estimation import FitProgress, Training
from sysid.estimation.estimators import seedless
from sysid.estimation.networks.multistart import planned_iterations
from sysid.reporting.results import Results, read_results
from sysid.traces import Trace, TraceSet
from sysid.workbench.fields import TrainingConfig, given_options
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig, Pipeline, PipelineConfig, read_pipeline
from sysid.workbench.fits.data import Data, load_data
from sysid.workbench.fits.record import read_fit, read_scores
from sysid.workbench.fits.run import report_key
from sysid.workbench.runner.screen import duration
from sysid.workbench.runner.store import RunFolder

CALIBRATION_ITERATIONS = 6
"""Iterations that are timed: their median leaves out what only the first one does."""

CALIBRATION_LIMIT_S = 10.0
"""Seconds that the timing of one fit may take."""

SHARE = 8
"""A linear fit is timed on this part of the samples: its work is proportional to them."""

TYPICAL_S = {"export": 10.0, "report": 10.0}
"""Seconds for two formats and for the page of three fits, as measured on two cores, where no run tells better."""


@dataclass(frozen=True, kw_only=True)
class PlannedStep:
    """One step of a run.

    Args:
        step: What is done.
        stored: Whether an earlier run's result will be taken.
        seconds: How long it will take at most; 0 where it is stored.
        basis: Where that comes from.
    """

    step: str
    stored: bool
    seconds: float
    basis: str


def plan(pipeline: Pipeline, folder: Path, *, fresh: bool = False) -> tuple[PlannedStep, ...]:
    """Plan a run; nothing is written, except that traces a generator makes are kept as always.

    Args:
        pipeline: What to do.
        folder: The run folder.
        fresh: Whether everything is done again.

    Returns:
        The steps in order.

    Raises:
        UserError: If data or options cannot be used as they are: what a run would say too.
    """
    config, store = pipeline.config, RunFolder(path=folder.resolve())
    began = time.perf_counter()
    data = load_data(config, beside=pipeline.path.parent, progress=lambda _: None)
    loading = PlannedStep(
        step=f"Loading the traces, {len(data.traces)} cases of {data.traces.name}",
        stored=False,
        seconds=time.perf_counter() - began,
        basis="measured now",
    )
    keys: dict[str, str] = {}
    scores: dict[str, str] = {}
    planned = [loading]
    for fit in config.fits:
        keys[fit.name] = steps.fit_key(fit, config, data, keys[fit.initial] if fit.initial else None)
        scores[fit.name] = steps.scores_key(keys[fit.name], fit.structure, data, config)
        step = f"Fitting {fit.name}, {fit.structure.label}"
        if not fresh and store.is_done(f"fit-{fit.slug}", keys[fit.name]):
            planned.append(PlannedStep(step=step, stored=True, seconds=0.0, basis="stored"))
        else:
            planned.append(_fit(step, fit, config, data, store))
    done = all(one.stored for one in planned[1:])
    return (*planned, *_last(config, store, scores, done=done and not fresh))


def _fit(step: str, fit: FitConfig, config: PipelineConfig, data: Data, store: RunFolder) -> PlannedStep:
    seconds = _last_time(fit, data, store)
    if seconds is not None:
        return PlannedStep(step=step, stored=False, seconds=seconds, basis="as last time")
    training = fit.training_options(config.seed)
    if not isinstance(training, Training):
        seconds, basis = _linear(fit, config, data), f"measured now on 1/{SHARE} of the samples"
        return PlannedStep(step=step, stored=False, seconds=seconds, basis=basis)
    around, iteration = _calibrate(fit, config, data)
    iterations = planned_iterations(training)
    side_by_side = min(training.workers, training.starts, os.cpu_count() or 1)
    seconds = around + min(iterations * iteration / side_by_side, training.max_time_s)
    trained = f"{iterations:.0f} iterations of {1e3 * iteration:.1f} ms, {side_by_side} at a time"
    basis = f"at most: {duration(around)}, then {trained}"
    return PlannedStep(step=step, stored=False, seconds=seconds, basis=basis)


def _last_time(fit: FitConfig, data: Data, store: RunFolder) -> float | None:
    """Seconds of the fit of this name, if the folder's last run asked for the same of records as long."""
    try:
        last = read_pipeline(store.path / "pipeline.yaml").config
        results = read_results(store.path)
        seconds = read_fit(store.fit(fit.slug)).train_time_s
    except (SysidError, OSError, ValueError, KeyError, TypeError):
        # Nothing there that can be read: there is no last time.
        return None
    same = next((one for one in last.fits if one.name == fit.name), None)
    if same is None or (same.structure, same.initial) != (fit.structure, fit.initial):
        return None
    asked = [seedless(one.training_options(0)) for one in (same, fit)]
    lengths = {name: case.samples for name, case in results.data.cases.items()}
    if asked[0] != asked[1] or lengths != {trace.name: len(trace) for trace in data.traces}:
        return None
    return float(seconds)


def _calibrate(fit: FitConfig, config: PipelineConfig, data: Data) -> tuple[float, float]:
    """Seconds around the iterations, which are spent once, and seconds of one iteration of one start."""
    few = {"max_iterations": CALIBRATION_ITERATIONS, "starts": 1, "max_time_s": CALIBRATION_LIMIT_S}
    moments: list[float] = []

    def note(_: FitProgress) -> None:
        moments.append(time.perf_counter())

    began = time.perf_counter()
    short = fit.model_copy(update={"training": _with(fit, few), "initial": None})
    steps.fit_traces(short, config, data, None, note)
    total = time.perf_counter() - began
    taken = [after - before for before, after in itertools.pairwise(moments)] or [total]
    iteration = statistics.median(taken)
    return max(total - len(moments) * iteration, 0.0), iteration


def _with(fit: FitConfig, changes: dict[str, Any]) -> TrainingConfig:
    return TrainingConfig(**{**(given_options(fit.training) or {}), **changes})


def _linear(fit: FitConfig, config: PipelineConfig, data: Data) -> float:
    few = Data(traces=_shortened(data.traces), selection=())
    seconds = 0.0
    for _ in range(2):  # the first one compiles
        began = time.perf_counter()
        try:
            steps.fit_traces(fit, config, few, None, lambda _: None)
        except ConfigError:
            # Too few samples left for its parameters: the whole record is short, and so is the fit.
            return 1.0
        seconds = SHARE * (time.perf_counter() - began)
    return seconds


def _shortened(traces: TraceSet) -> TraceSet:
    return dataclasses.replace(traces, traces=tuple(_part(trace) for trace in traces))


def _part(trace: Trace) -> Trace:
    n = max(len(trace) // SHARE, min(len(trace), 50))
    usable = None if trace.usable is None else trace.usable[:n]
    weights = None if trace.weights is None else trace.weights[:n]
    return dataclasses.replace(trace, values=trace.values[:n], usable=usable, weights=weights)


def _last(config: PipelineConfig, store: RunFolder, scores: dict[str, str], *, done: bool) -> Sequence[PlannedStep]:
    """Export and report."""
    found = _results(store) if done else None
    planned = []
    if config.export is not None:
        best = _best(config, store) if done else config.export.fit
        key = steps.export_key(scores[best], config) if best in scores else ""
        stored = done and best in scores and store.is_done("export", key)
        name = best if best in scores else "the best fit"
        planned.append(_closing(f"Exporting {name} as {', '.join(config.export.formats)}", "export", store, stored))
        done = done and stored
    stored = False
    if done and found is not None:
        stored = store.is_done("report", report_key(found))
    planned.append(_closing("Writing the report", "report", store, stored))
    return planned


def _closing(step: str, stamp: str, store: RunFolder, stored: bool) -> PlannedStep:
    if stored:
        return PlannedStep(step=step, stored=True, seconds=0.0, basis="stored")
    try:
        return PlannedStep(step=step, stored=False, seconds=store.facts(stamp)["seconds"], basis="as last time")
    except (OSError, ValueError, KeyError, TypeError):
        # Never done here, or by a release that kept no times.
        return PlannedStep(step=step, stored=False, seconds=TYPICAL_S[stamp], basis="typical")


def _best(config: PipelineConfig, store: RunFolder) -> str:
    try:
        fits = {fit.name: (read_fit(store.fit(fit.slug)), read_scores(store.fit(fit.slug))) for fit in config.fits}
    except (OSError, ValueError, KeyError):
        # Figures that cannot be read are made again, and may choose another.
        return "best"
    return steps.choose(fits, config.export.fit if config.export else "best").name


def _results(store: RunFolder) -> Results | None:
    try:
        return read_results(store.path)
    except ConfigError:
        return None
