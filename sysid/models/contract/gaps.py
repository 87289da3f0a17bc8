"""Samples of an output that are masked: what stands there is a filling, and nothing may depend on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.history import History, bridged
from sysid.models.contract.base import AbstractModel

MOST_ROUNDS, SETTLED = 500, 1e-9
"""Predictions over a record, each of which finds a sample more of every gap; and the change, over the output's range,
that is none."""

Array = NDArray[np.float64]


def predicted(
    model: AbstractModel, inputs: Array, output: Array, history: History, usable: NDArray[np.bool_] | None
) -> Array:
    """One-step prediction over a record, in which masked samples are what the model itself predicts of them.

    Behind a gap it thus knows what the model can know there, and is as many steps ahead as the gap is long.

    Args:
        model: One that predicts.
        inputs: Shape ``(n_samples, n_inputs)``.
        output: Measured output, shape ``(n_samples,)``, or ``(n_samples, n_outputs)``.
        history: The samples before the first.
        usable: Which samples are not masked, shape ``(n_samples,)`` or as the output; ``None`` for all.

    Returns:
        As the output.
    """
    if usable is None or usable.all() or not usable.any():
        return model.predict(inputs, output, history)
    known = bridged(output, usable)
    gaps = np.broadcast_to(~usable.reshape(len(usable), -1), output.reshape(len(output), -1).shape).reshape(
        output.shape
    )
    span = float(np.ptp(output[~gaps]))
    for _ in range(MOST_ROUNDS):
        ahead = model.predict(inputs, known, history)
        with np.errstate(over="ignore", invalid="ignore"):  # of a model that runs away
            change = float(np.abs(ahead[gaps] - known[gaps]).max())
        if not np.isfinite(change) or change <= SETTLED * span:
            break
        known[gaps] = ahead[gaps]
    return ahead
