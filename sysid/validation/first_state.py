"""What it costs a run that its first state is estimated on a few samples, where the model does not forget it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.models import AbstractModel, Start, StartKind, beginning
from sysid.traces import Trace
from sysid.units import in_unit
from sysid.validation.metrics import Figures, figures, percent
from sysid.validation.resolution import parts_of, tied

REMEMBERED = 0.1
"""Part of a first state that is left after a fifth of a record, from which on it is looked at."""
LONGER, SHARE = 8, 3
"""A window that is so many times longer, and at most the third part of the record, is set beside."""
COSTS = 1.1
"""Times the squared error of the longer window from which on the shorter one is told."""


def first_states(model: AbstractModel, scored: Sequence[Trace], start: Start) -> tuple[str, ...]:
    """Records whose free run is worse for a first state that was estimated on too few samples.

    Args:
        model: The model; of one that is not linear, or not stable, nothing is said.
        scored: The records that are scored.
        start: How each free run begins.

    Returns:
        One sentence for each such record.
    """
    radius = model.pole_radius
    if start.kind is not StartKind.ESTIMATED or radius is None or not 0.0 < radius <= 1.0:
        return ()
    told = []
    for trace in scored:
        n = len(trace)
        if radius ** (n / 5.0) > REMEMBERED and (said := _told(model, trace, start)):
            told.append(said)
    return tuple(told)


def _told(model: AbstractModel, trace: Trace, start: Start) -> str:
    inputs, target = trace.columns(model.mapping.inputs), model.measured(trace)
    usable = trace.usable_of(model.mapping.channels)
    first = beginning(model, inputs, target, start, usable, case=trace.name).first
    longer = min(LONGER * first, len(trace) // SHARE)
    if not 0 < first < longer:
        return ""

    def run_from(samples: int) -> tuple[int, NDArray[np.float64]]:
        begun = beginning(model, inputs, target, replace(start, n_measured=samples), usable, case=trace.name)
        run = model.simulate(inputs[begun.first :], begun.history)
        return begun.first, np.asarray(run.reshape(len(run), -1))

    # Where samples are masked, so many that count reach further than as many samples.
    begun = [run_from(samples) for samples in (first, longer)]
    last = max(at for at, _ in begun)
    runs = [run[last - at :] for at, run in begun]
    counted, aims = usable[last:], target.reshape(len(target), -1)[last:]
    if not counted.any():
        return ""
    for k, output in enumerate(model.mapping.outputs):
        errors = [(run[:, k] - aims[:, k])[counted] for run in runs]
        if not np.isfinite(errors).all() or not np.mean(errors[0] ** 2) > COSTS * np.mean(errors[1] ** 2):
            continue
        if not tied(parts_of(errors[1]), parts_of(errors[0])):
            seen = [figures(aims[:, k], run[:, k], model.ends.units[output], counted) for run in runs]
            what, (short, long) = _figure(seen)
            return (
                f"{trace.name}: {model.structure.label} does not forget how a run begins (its slowest pole is "
                f"{model.pole_radius:.5g}). With the first state estimated on {first} samples the {what} of {output} "
                f"is {short}, on {longer} samples {long}, over the same samples: write start: {{estimated: {longer}}}."
            )
    return ""


def _figure(seen: Sequence[Figures]) -> tuple[str, list[str]]:
    """What is told of runs, and its values: the fit, and of an output that never changes, which has none, the error."""
    if np.isnan(seen[0].nrmse_fit):
        return "rms error", [in_unit(f"{np.sqrt(one.mse):.3g}", one.unit) for one in seen]
    return "fit", [f"{percent(one.nrmse_fit)} %" for one in seen]
