"""Which outputs' levels before the first sample a surrogate heeds: its state at rest is another for another level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.export.surrogate import Surrogate

AWAY = (1e-3, -1e-3)
"""Shares of a level's size, and of its unit, by which it is moved: at a bound the state follows one way alone."""


def heeded(surrogate: Surrogate) -> tuple[bool, ...]:
    """Of each output whether its level at rest says something.

    Args:
        surrogate: What is exported.

    Returns:
        One truth value an output; false of states that rest where the inputs alone say.
    """
    first = np.array([port.start for port in surrogate.inputs])
    declared = surrogate.chosen(surrogate.rest(first)[np.newaxis])[0]

    def state(levels: NDArray[np.float64]) -> NDArray[np.float64]:
        return surrogate.at_rest(first, surrogate.rest(first, levels))

    steps = np.diag(1.0 + np.abs(declared))
    return tuple(
        any(not np.array_equal(state(declared + by * step), state(declared), equal_nan=True) for by in AWAY)
        for step in steps
    )
