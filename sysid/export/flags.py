"""What a surrogate says about each of its steps: a small set of flags, the same in every format.

A flag never changes the numbers: outside the declared range the step still answers, held within the output's bounds
where the model has them. The caller decides what to do.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import NDArray

from sysid.export.surrogate import Surrogate


class Flag(enum.IntFlag):
    """Bits of the flags of one step; 0 is a step within everything that was declared."""

    OUTSIDE_RANGE = 1
    """An input is outside the range that it is declared for: nothing is known about the accuracy."""
    AT_BOUND = 2
    """An output, or what it is computed from, is held at one of its bounds: it is wrong."""
    NOT_A_NUMBER = 4
    """An input or an output is not a number: set the state anew before relying on what follows."""
    AT_LIMIT = 8
    """An output is held at a limit that was declared for it, such as a pressure that cannot be below atmosphere."""


MEANING = {
    Flag.OUTSIDE_RANGE: "an input is outside its declared range; the accuracy is unknown",
    Flag.AT_BOUND: "an output is held at one of its bounds; it is wrong",
    Flag.NOT_A_NUMBER: "an input or an output is not a number; set the state anew",
    Flag.AT_LIMIT: "an output is held at a limit that was declared for it",
}
"""Each flag as a sentence, for the files and the model card."""


def expected_flags(
    surrogate: Surrogate, inputs: NDArray[np.float64], computed: NDArray[np.float64]
) -> NDArray[np.int32]:
    """The flags that a free run has to raise, from its inputs and what it computes alone.

    Args:
        surrogate: What is run.
        inputs: Shape ``(n_samples, n_inputs)``, in their units.
        computed: Shape ``(n_samples, n_computed)``, in their units, as :meth:`Surrogate.compute` gives them.

    Returns:
        Shape ``(n_samples,)``.
    """
    low, high = (np.array([getattr(port, side) for port in surrogate.inputs]) for side in ("low", "high"))
    outside = ((inputs < low) | (inputs > high)).any(axis=1)
    lost = np.isnan(inputs).any(axis=1) | np.isnan(computed).any(axis=1)
    known, n_inputs = np.column_stack([inputs, computed]), inputs.shape[1]
    bound, limited = (np.zeros(len(inputs), dtype=bool) for _ in range(2))
    for stage in surrogate.stages:
        cell, n = stage.cell, len(stage.sources)
        for j, (target, sides, told) in enumerate(zip(stage.targets, stage.limits, stage.told, strict=True)):
            output, offset, scale = computed[:, target - n_inputs], cell.offset[n + j], cell.scale[n + j]
            reached = np.zeros(len(inputs), dtype=bool)
            for side in sides:
                reached |= output == (side.value if side.column is None else known[:, side.column])
            for value in (cell.low, cell.high):
                if np.isfinite(value):
                    bound |= ~reached & (output == value * scale + offset)
            limited |= reached & told
    flags = (
        outside * int(Flag.OUTSIDE_RANGE)
        + bound * int(Flag.AT_BOUND)
        + lost * int(Flag.NOT_A_NUMBER)
        + limited * int(Flag.AT_LIMIT)
    )
    return np.asarray(flags, dtype=np.int32)
