"""What a trial is worth: its errors on every case and on what chooses, and the work and time of its runs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sysid.estimation.results.tolerance import spans_of
from sysid.models import AbstractModel, Start, beginning
from sysid.models.contract import gaps
from sysid.traces import Trace, TraceSet
from sysid.validation.resolution import parts_of
from sysid.workbench.fits.data import Data
from sysid.workbench.fits.steps import output_sizes

REPEATS = 3
"""Free runs that are timed; the least counts, for whatever else the machine does only adds to it."""


def operations(model: AbstractModel) -> int:
    """Multiplications of one step: what its speed depends on, the same on every machine.

    Args:
        model: The model.

    Returns:
        For a network one a weight; for a linear model one a number of its recursion.
    """
    return int(np.count_nonzero(model.recursion.numbers))


def scores(
    models: Sequence[AbstractModel], traces: TraceSet, selection: tuple[Trace, ...], start: Start
) -> dict[str, Any]:
    """Figures on every case and on the selection traces.

    Args:
        models: Of each output one, or one of all.
        traces: Every case.
        selection: The traces that choose.
        start: How each free run begins.

    Returns:
        JSON values.
    """
    outputs = [output for model in models for output in model.mapping.outputs]
    sizes = dict(zip(outputs, output_sizes(Data(traces=traces, selection=selection), outputs), strict=True))
    spans = spans_of([*traces, *selection], outputs)
    cases = {
        trace.name: {
            "role": traces.roles[trace.name].value,
            **_means(*_case(models, trace, start, sizes, REPEATS)),
        }
        for trace in traces
    }
    runs = [_case(models, trace, start, sizes, 0) for trace in selection]
    chosen = [_means(*run) for run in runs]
    shares = [np.sqrt(np.array(errors["free_run_mse"]) * list(sizes.values())) / spans for errors, _ in runs]
    means = {
        f"selection_{name}": float(np.mean([one[name] for one in chosen])) if chosen else math.nan
        for name in ("free_run_mse", "one_step_mse")
    }
    parts = [error for errors, _ in runs for error in np.mean(errors["parts"], axis=0)]
    return {
        "cases": cases,
        "selection_rms_shares": [float(share.max()) for share in shares],
        "selection_errors": [float(error) for error in parts],
        **means,
    }


def _case(
    models: Sequence[AbstractModel], trace: Trace, start: Start, sizes: Mapping[str, float], repeats: int
) -> tuple[dict[str, list[Any]], dict[str, float]]:
    """Errors of each output over the squared error that counts as one, by part too; and the time, where measured."""
    errors: dict[str, list[Any]] = {"free_run_mse": [], "one_step_mse": [], "parts": []}
    seconds, n_samples = 0.0, 0
    for model in models:
        inputs, target = trace.columns(model.mapping.inputs), model.measured(trace)
        usable = trace.usable_of(model.mapping.channels)
        begun = beginning(model, inputs, target, start, usable, case=trace.name)
        history, n = begun.history, begun.first
        inputs, target, counted = inputs[n:], target[n:], usable[n:]
        runs = {"free_run_mse": model.simulate(inputs, history), "one_step_mse": np.full(target.shape, np.nan)}
        if model.recursion.predicts:
            runs["one_step_mse"] = gaps.predicted(model, inputs, target, history, counted)
        size = np.array([sizes[output] for output in model.mapping.outputs])
        n_samples += int(np.count_nonzero(counted)) * len(size)
        with np.errstate(over="ignore", invalid="ignore"):  # of a run that has left
            for name, run in runs.items():
                squared = ((run - target)[counted] ** 2).reshape(-1, len(size))
                errors[name] += list(np.mean(squared, axis=0) / size)
            left = ((runs["free_run_mse"] - target)[counted]).reshape(-1, len(size)) / np.sqrt(size)
        errors["parts"] += [parts_of(one) for one in left.T]
        seconds += _seconds(lambda m=model, u=inputs, h=history: m.simulate(u, h), repeats)  # type: ignore[misc]
    return errors, {"run_time_s": seconds, "n_samples": n_samples} if repeats else {}


def _means(errors: Mapping[str, list[Any]], more: Mapping[str, float]) -> dict[str, float]:
    return {**{name: float(np.mean(values)) for name, values in errors.items() if name != "parts"}, **more}


def _seconds(run: Callable[[], object], repeats: int) -> float:
    """The least time of some runs; whatever else the machine does only adds to it."""
    taken = []
    for _ in range(repeats):
        began = time.perf_counter()
        run()
        taken.append(time.perf_counter() - began)
    return min(taken, default=0.0)
