"""Which outputs' levels before the first sample a surrogate heeds: its state at rest is another for another level."""

from __future__ import annotations

import itertools

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
    found = np.zeros(len(surrogate.outputs), dtype=bool)
    for first in _inputs(surrogate):
        declared = surrogate.chosen(surrogate.rest(first)[np.newaxis])[0]
        state = surrogate.at_rest(first, surrogate.rest(first, declared))
        for k, by in itertools.product(range(len(found)), AWAY):
            moved = declared + np.where(np.arange(len(found)) == k, by * (1.0 + np.abs(declared)), 0.0)
            there = surrogate.at_rest(first, surrogate.rest(first, moved))
            found[k] |= not np.array_equal(there, state, equal_nan=True)
    return tuple(map(bool, found))


def _inputs(surrogate: Surrogate) -> list[NDArray[np.float64]]:
    """Where inputs start, and the ends of their ranges: equations may rest anywhere at some inputs alone."""
    ends = [port.range or (port.start, port.start) for port in surrogate.inputs]
    return [np.array([port.start for port in surrogate.inputs]), *np.array(ends, dtype=np.float64).reshape(-1, 2).T]
