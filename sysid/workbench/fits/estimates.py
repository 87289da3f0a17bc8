"""How long a fit will take, from a few iterations on the very traces, measured now on this machine.

These are upper limits: a start that converges ends early.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import statistics
import time
from typing import Any

from sysid.errors import ConfigError
from sysid.estimation import FitProgress, Training
from sysid.estimation.networks.multistart import planned_iterations
from sysid.traces import Trace, TraceSet
from sysid.workbench.fields import TrainingConfig, given_options
from sysid.workbench.fits import steps
from sysid.workbench.fits.config import FitConfig, PipelineConfig
from sysid.workbench.fits.data import Data
from sysid.workbench.runner.screen import duration
from sysid.workbench.runner.steps import Estimate

CALIBRATION_ITERATIONS = 6
"""Iterations that are timed: their median leaves out what only the first one does."""

CALIBRATION_LIMIT_S = 10.0
"""Seconds that the timing of one fit may take."""

SHARE = 8
"""A linear fit is timed on this part of the samples: its work is proportional to them."""


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
    around, iteration = _calibrate(fit, config, data)
    iterations = planned_iterations(training)
    side_by_side = min(training.workers, training.starts, os.cpu_count() or 1)
    seconds = around + min(iterations * iteration / side_by_side, training.max_time_s)
    trained = f"{iterations:.0f} iterations of {1e3 * iteration:.1f} ms, {side_by_side} at a time"
    return Estimate(seconds=seconds, basis=f"at most: {duration(around)}, then {trained}")


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
