"""Whether the parameters of a fit one step ahead are known well enough for a free run."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.records.experiment import Experiment
from sysid.models import AbstractModel, Start
from sysid.traces import Trace

MOST_SAMPLES = 2_000
"""Samples of the longest record that are looked at: the deviation is one of all of them."""
UNSURE = 0.5
"""Standard deviation that the parameters leave to the free run, over that of the output, from which on it is told: an
interval as wide as the output moves."""


def unsure(
    variance_of: Callable[[Experiment], NDArray[np.float64]],
    model: AbstractModel,
    traces: Sequence[Trace],
    start: Start,
) -> tuple[str, ...]:
    """How far the free run over a record that was fitted is left open by the parameters.

    A fit of the free run keeps it near the record whatever its parameters are; one step ahead parameters that make
    hardly a difference there may move the free run by more than the output itself moves.

    Args:
        variance_of: What of the free run's variance is due to the parameters, of the output's shape.
        model: The model.
        traces: Estimation traces.
        start: What stands before each.

    Returns:
        None, or a sentence with the outputs of which it is so.
    """
    longest = max(traces, key=len)
    experiment = Experiment.for_model(longest[:MOST_SAMPLES], model, start)
    shape = (len(experiment.output), -1)
    counted = np.ones(shape[0], dtype=np.bool_) if experiment.weights is None else experiment.weights > 0.0
    if not counted.any():
        return ()
    variance = variance_of(experiment).reshape(shape)[counted].mean(axis=0)
    moved = experiment.output.reshape(shape)[counted].var(axis=0)
    open_ = [
        f"that of {name} by ±{196 * np.sqrt(left / own):.0f} % of how far {name} moves"
        for name, left, own in zip(model.mapping.outputs, variance, moved, strict=True)
        if left > UNSURE**2 * own > 0.0
    ]
    if not open_:
        return ()
    return (
        f"The parameters are not known well enough for a free run: over what was fitted they leave {', '.join(open_)} "
        "(95 % intervals). Record longer, move the inputs more, take a smaller model, or fit the free run (loop: "
        "closed, noise: false, OE).",
    )
