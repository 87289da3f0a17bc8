"""How long a fit will take, from a few iterations on the very traces, measured now on this machine.

These are upper limits: a start that converges ends early.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

from sysid.compilation import compiled_s
from sysid.errors import ConfigError
from sysid.estimation import FitProgress, FitResult, Training
from sysid.estimation.estimators import estimator_of
from sysid.estimation.fitting import seedless
from sysid.estimation.networks.middle import most_iterations
from sysid.estimation.networks.starts.halving import planned_iterations
from sysid.estimation.stability.check import LEAST_S
from sysid.traces import Trace, TraceSet
from sysid.workbench.fields import given_options, options_of
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.runner.screen import duration
from sysid.workbench.runner.steps import Estimate

EXPORT_TIME = Estimate(seconds=10.0, basis="typical")
"""Of two formats, as measured on two cores."""

SCORING_TIME = Estimate(seconds=1.0, basis="typical")

CALIBRATION_ITERATIONS = 6
"""Iterations that are timed: their median leaves out what only the first one does."""

CALIBRATION_LIMIT_S = 10.0
"""Seconds that the timing of one fit may take."""

FEW = ("max_iterations", "pretraining_iterations", "starts", "ensemble", "input_subsets", "max_time_s")
"""Options that make a training short."""

FEW_SEQUENCES = 20
"""Sequences over which the check of a free run is timed; of slow equations all of them take a minute."""

SHARE = 8
"""A linear fit is timed on this part of the samples: its work is proportional to them."""


def amount(fit: FitConfig, data: Data) -> dict[str, Any]:
    """How much work a fit is: another seed is as much.

    Args:
        fit: The fit.
        data: The traces.

    Returns:
        What is the same for as much work, as JSON values.
    """
    return {
        "structure": fit.structure.to_dict(),
        "initial": fit.initial,
        "training": str(seedless(fit.training_options(0))),
        "samples": {trace.name: len(trace) for trace in data.traces},
    }


def how_long(fit: FitConfig, config: PipelineConfig, data: Data) -> Estimate:
    """Time a few iterations of a fit.

    Args:
        fit: The fit.
        config: Its pipeline.
        data: The traces.

    Returns:
        At most so long.
    """
    training = fit.training_options(config.seed)
    if not isinstance(training, Training):
        return Estimate(seconds=_linear(fit, config, data), basis=f"measured now on 1/{SHARE} of the samples")
    fits, row = list[FitResult](), estimator_of(fit.structure)
    training = training.with_starts(row.starts)

    def iterations() -> float:
        return most_iterations(
            training, n_samples=sum(map(len, data.estimation)), n_parameters=fits[-1].model.n_parameters,
            selects=bool(data.selection), unites=row.unites, twice=row.twice and fit.initial is None,
        )  # fmt: skip

    trained = network_time(
        training, lambda few, note: fits.append(_fitted(fit, config, data, few, note)), iterations=iterations
    )
    seconds = trained.seconds or 0.0
    checked = min(_checked(fits[-1], fit, config, data), max(LEAST_S, config.stability.time_share * seconds))
    if checked < 1.0:
        return trained
    return Estimate(seconds=seconds + checked, basis=f"{trained.basis}, and {duration(checked)} for its check")


def _checked(found: FitResult, fit: FitConfig, config: PipelineConfig, data: Data) -> float:
    """How long the check of a free run takes, from a few of its sequences."""
    asked = config.stability.options(data.sequences)
    count, seconds = min(asked.count, FEW_SEQUENCES), 0.0
    for few in (min(count, 1), count):  # the first one compiles
        began = time.perf_counter()
        options = dataclasses.replace(asked, count=few)
        estimator_of(fit.structure).stability.of(options, found.model.mapping, data.estimation).applied(found)
        seconds = time.perf_counter() - began
    return seconds * asked.count / max(count, 1)


def network_time(
    training: Training,
    fit: Callable[[Training, Callable[[FitProgress], None]], object],
    *,
    share: float = 1.0,
    iterations: Callable[[], float] | None = None,
) -> Estimate:
    """How long the training of a network takes, from a few iterations of it.

    Args:
        training: The training.
        fit: Fits with other options, those that take few iterations; given whom to tell of each.
        share: Part of the samples that this fit is on.
        iterations: How many all starts make together, asked after that fit; those of the training by default.

    Returns:
        At most so long.
    """
    few = dataclasses.replace(
        training,
        max_iterations=CALIBRATION_ITERATIONS,
        pretraining_iterations=min(training.pretraining_iterations, CALIBRATION_ITERATIONS),
        starts=1,
        ensemble=1,
        input_subsets=(),
        max_time_s=CALIBRATION_LIMIT_S,
    )
    stamps: list[tuple[str, float]] = []
    compiled, total = -1.0, 0.0
    while compiled < (compiled := compiled_s()):  # once more where the first time has compiled what it runs on
        stamps.clear()
        began = time.perf_counter()
        fit(few, lambda entry: stamps.append((entry.stage, time.perf_counter())))
        total = time.perf_counter() - began
    # What is trained last is the free run, or one step ahead; what comes before it has stages of its own.
    last = stamps[-1][0] if stamps else ""
    each = {main: _median([when for stage, when in stamps if (stage == last) is main]) for main in (True, False)}
    iteration, earlier = (each[True] or total) / share, each[False] or 0.0
    around = max(total - sum((each[stage == last] or 0.0) for stage, _ in stamps), 0.0)
    made = planned_iterations(training) if iterations is None else iterations()
    side_by_side = min(training.workers, training.n_starts, os.cpu_count() or 1)
    before = earlier * training.pretraining_iterations * training.n_starts if training.pretraining else 0.0
    seconds = around + min((before + made * iteration) / side_by_side, training.max_time_s)
    trained = f"{made:.0f} iterations of {1e3 * iteration:.1f} ms, {side_by_side} at a time"
    ahead = f", {duration(before / side_by_side)} one step ahead" if before else ""
    return Estimate(seconds=seconds, basis=f"at most: {duration(around)}{ahead}, then {trained}")


def _median(stamps: Sequence[float]) -> float | None:
    """Seconds from one moment to the next; ``None`` of fewer than two."""
    taken = [after - before for before, after in itertools.pairwise(stamps)]
    return statistics.median(taken) if taken else None


def _fitted(
    fit: FitConfig,
    config: PipelineConfig,
    data: Data,
    training: Training,
    note: Callable[[FitProgress], None],
) -> FitResult:
    few = {name: getattr(training, name) for name in FEW if hasattr(training, name)}
    given = options_of(estimator_of(fit.structure))(**{**(given_options(fit.training) or {}), **few})
    config = config.model_copy(update={"stability": config.stability.model_copy(update={"count": 0})})
    return steps.fit_traces(fit.model_copy(update={"training": given, "initial": None}), config, data, None, note)


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
