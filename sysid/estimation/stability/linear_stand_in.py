"""Linear models of records, which say where the recorded system would go on a sequence that asks more of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.estimation.linear.arx import fit_arx
from sysid.estimation.stability.free_run import Run
from sysid.estimation.stability.sequences import InputSequence
from sysid.models import ARX, AbstractModel, Mapping, Start, StartKind, beginning
from sysid.traces import Trace

GROWTH = 1e-6
"""By how much a pole's magnitude may exceed 1: an integrator that is estimated has a pole at 1 but for rounding and
noise, and a free run of 100,000 samples is then off by a tenth at most."""

FOLLOWS = 0.1
"""Share of an output that a linear model may leave and still say where the recorded system would go."""


def linear_stand_in(estimation: Sequence[Trace], mapping: Mapping) -> Run | None:
    """Stable linear models that follow records, one an output, as one run over a sequence.

    Args:
        estimation: The records.
        mapping: Inputs and outputs.

    Returns:
        The run; ``None`` where an output has no such model.
    """
    found = [_linear(estimation, one) for one in mapping.each]
    models = [one for one in found if one is not None]
    if not models or len(models) < len(found):
        return None

    def run(sequence: InputSequence) -> NDArray[np.float64]:
        past = (sequence.history(several=False, output=j) for j in range(len(models)))
        return np.column_stack([m.simulate(sequence.inputs, h) for m, h in zip(models, past, strict=True)])

    return run


def _linear(estimation: Sequence[Trace], mapping: Mapping) -> AbstractModel | None:
    """A stable linear model of one output that follows the records; ``None`` where there is none."""
    m = len(mapping.inputs)
    start = Start(kind=StartKind.ESTIMATED)
    try:
        found = fit_arx(estimation, mapping, ARX(na=2, nb=(2,) * m, nk=(0,) * m), start=start).model
    except TraceError:
        return None
    if found.pole_radius is None or found.pole_radius > 1.0 + GROWTH:
        return None
    return found if all(_follows(found, trace, start) for trace in estimation) else None


def _follows(model: AbstractModel, trace: Trace, start: Start) -> bool:
    """Whether the free run of a model leaves no more than :data:`FOLLOWS` of a record's output."""
    inputs, output, usable = (
        trace.columns(model.mapping.inputs),
        trace[model.mapping.output],
        trace.usable_of(model.mapping.channels),
    )
    begun = beginning(model, inputs, output, start, usable)
    run, counted = model.simulate(inputs[begun.first :], begun.history), usable[begun.first :]
    if not counted.any():
        return False
    target = output[begun.first :][counted]
    error = float(np.linalg.norm(run[counted] - target))
    return error <= FOLLOWS * float(np.linalg.norm(target - target.mean()))
