"""What it costs a run that its first state is estimated, where the model does not forget it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.models import AbstractModel, Start, StartKind, beginning
from sysid.traces import Role, Trace, TraceSet
from sysid.units import in_unit
from sysid.validation.metrics import Figures, figures, percent
from sysid.validation.resolution import parts_of, tied

REMEMBERED = 0.1
"""Part of a first state that is left after a fifth of a record, from which on it is looked at."""
LONGER, SHARE = 8, 3
"""A window that is so many times longer, and at most the third part of the record, is set beside."""
COSTS = 1.1
"""Times the squared error of the longer window from which on the shorter one is told."""
HANGS = 4.0
"""Times the squared error from the first measured samples from which on a run from an estimated state is told."""


def first_states(model: AbstractModel, traces: TraceSet, start: Start) -> tuple[str, ...]:
    """Records whose free run is worse for a first state that was estimated.

    Args:
        model: The model; of one that is linear and not stable nothing is said.
        traces: The records; those that a linear model was fitted to are left out.
        start: How each free run begins.

    Returns:
        One sentence for each such record.
    """
    radius = model.pole_radius
    if start.kind is not StartKind.ESTIMATED or (radius is not None and not 0.0 < radius <= 1.0):
        return ()
    told = []
    for trace in traces:
        if radius is None:
            told.append(_hanging(model, trace, start))
        elif traces.roles[trace.name] is not Role.ESTIMATION and radius ** (len(trace) / 5.0) > REMEMBERED:
            told.append(_told(model, trace, start))
    return tuple(said for said in told if said)


def _told(model: AbstractModel, trace: Trace, start: Start) -> str:
    """What a longer window brings a linear model."""
    first = _run_from(model, trace, start)[0]
    longer = min(LONGER * first, len(trace) // SHARE)
    if not 0 < first < longer:
        return ""
    found = _worse(model, trace, (start, replace(start, n_measured=longer)), COSTS)
    if found is None:
        return ""
    output, what, short, long = found
    return (
        f"{trace.name}: {model.structure.label} does not forget how a run begins (its slowest pole is "
        f"{model.pole_radius:.5g}). With the first state estimated on {first} samples the {what} of {output} "
        f"is {short}, on {longer} samples {long}, over the same samples: write start: {{estimated: {longer}}}."
    )


def _hanging(model: AbstractModel, trace: Trace, start: Start) -> str:
    """What the first measured samples bring a model that is not linear, in place of what is estimated on more."""
    few, first = model.recursion.memory, _run_from(model, trace, start)[0]
    if not 0 < few < first:
        return ""
    found = _worse(model, trace, (start, Start(kind=StartKind.MEASURED, n_measured=few)), HANGS)
    if found is None:
        return ""
    output, what, long, short = found
    return (
        f"{trace.name}: the free run of {model.structure.label} hangs on where it began. From the first state that is "
        f"estimated on {first} samples the {what} of {output} is {long}, from the first {few} as measured {short}, "
        f"over the same samples. Another beginning may be as far off: take another seed, fewer lags or more data; or "
        f"judge it from there, start: {{measured: {few}}}."
    )


def _run_from(model: AbstractModel, trace: Trace, start: Start) -> tuple[int, NDArray[np.float64]]:
    """The first sample that is run, and the free run from there, one column an output."""
    inputs, usable = trace.columns(model.mapping.inputs), trace.usable_of(model.mapping.channels)
    begun = beginning(model, inputs, model.measured(trace), start, usable, case=trace.name)
    run = model.simulate(inputs[begun.first :], begun.history)
    return begun.first, np.asarray(run.reshape(len(run), -1))


def _worse(
    model: AbstractModel, trace: Trace, starts: tuple[Start, Start], times: float
) -> tuple[str, str, str, str] | None:
    """The first output whose run is worse from one start than from another, what is told of both, and its values."""
    begun = [_run_from(model, trace, start) for start in starts]
    # Where samples are masked, so many that count reach further than as many samples.
    last = max(at for at, _ in begun)
    runs = [run[last - at :] for at, run in begun]
    target = model.measured(trace)
    counted, aims = trace.usable_of(model.mapping.channels)[last:], target.reshape(len(target), -1)[last:]
    if not counted.any():
        return None
    for k, output in enumerate(model.mapping.outputs):
        errors = [(run[:, k] - aims[:, k])[counted] for run in runs]
        if not np.isfinite(errors).all() or not np.mean(errors[0] ** 2) > times * np.mean(errors[1] ** 2):
            continue
        if not tied(parts_of(errors[1]), parts_of(errors[0])):
            seen = [figures(aims[:, k], run[:, k], model.ends.units[output], counted) for run in runs]
            what, (one, other) = _figure(seen)
            return output, what, one, other
    return None


def _figure(seen: Sequence[Figures]) -> tuple[str, list[str]]:
    """What is told of runs, and its values: the fit, and of an output that never changes, which has none, the error."""
    if np.isnan(seen[0].nrmse_fit):
        return "rms error", [in_unit(f"{np.sqrt(one.mse):.3g}", one.unit) for one in seen]
    return "fit", [f"{percent(one.nrmse_fit)} %" for one in seen]
