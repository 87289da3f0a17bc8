"""Simple things that an output may do with its inputs: follow slowly, follow along a curve, follow with play."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.records.informative import STILL
from sysid.kernels.linear import slowed
from sysid.models import AbstractModel

Array = NDArray[np.float64]

LINEAR, CURVES, PLAYS = "linear", "curves", "plays"
SLOWEST = 8
"""Times that the longest memory goes into the record at least."""
STEP = 3.0
"""From one memory to the next."""
ORDERS = 3
"""Times that a linear memory follows itself."""
BENT = 2
"""Of these, those that are bent and multiplied with each other: behind a filter of two poles a curve is another."""
AT = (0.2, 0.4, 0.6, 0.8)
"""Quantiles at which a curve bends."""
LATE = (2, 3, 4, 6, 8, 12, 16, 24)
"""Samples by which an input may act later than the next one: no row of filters makes a dead time."""
WIDTHS = (0.1, 0.2, 0.35)
"""Half the play, in ranges."""
MOST_INPUTS = 4
TINY = float(np.finfo(np.float64).tiny)


def features(inputs: Array, simulated: Array, answered: Sequence[Array] = ()) -> dict[str, list[Array]]:
    """Signals that a model of some inputs may have left out.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``; of many inputs the first are looked at.
        simulated: Free run of one output, shape ``(n_samples,)``, for curves behind it.
        answered: What the model makes of curves of its inputs (:func:`answers`), each of shape ``(n_samples, n)``.

    Returns:
        By kind those of it and of all simpler kinds before it, each of shape ``(n_samples,)``: apart, as a hundred of
        them side by side are more memory in one piece than a process has free.
    """
    u = inputs[:, :MOST_INPUTS]
    u = (u - u.mean(axis=0)) / np.maximum(u.std(axis=0), TINY)
    memories = [1.0]
    while memories[-1] * STEP <= len(u) / SLOWEST:
        memories.append(memories[-1] * STEP)
    # An integrator's output, but for the level from which it integrates.
    linear, curves, plays = [u, _late(u), np.cumsum(_late(u), axis=0) / len(u)], list[Array](), list[Array]()
    linear += [_late(u, lag) for lag in LATE if lag <= memories[-1]]
    bent = np.column_stack([*(_curves(one) for one in u.T), *_products(u)])
    held = np.column_stack([_play(one, width * float(np.ptp(one))) for one in u.T for width in WIDTHS])
    curves += [bent, _curves(simulated), *answered]
    plays += [held]
    for memory in memories:
        slow = u
        for order in range(ORDERS):
            slow = _slowed(slow, memory)
            linear.append(slow)
            if order < BENT:
                curves += [
                    *(_curves(one) for one in slow.T),
                    *([np.column_stack(two)] if (two := _products(slow)) else []),
                ]
        curves += [_slowed(bent, memory)]
        plays += [_slowed(held, memory)]
    found, kinds = list[Array](), dict[str, list[Array]]()
    for kind, parts in ((LINEAR, linear), (CURVES, curves), (PLAYS, plays)):
        found = found + [np.ascontiguousarray(column) for part in parts for column in part.T]
        kinds[kind] = found
    return kinds


def answers(model: AbstractModel, inputs: Array, kept: Sequence[int], output: int) -> list[Array]:
    """What a linear model makes of curves of its inputs: a curve before a resonance is no sum of slow filters.

    Args:
        model: The model; of one that is not linear, or remembers for ever, there are none.
        inputs: Shape ``(n_samples, n_inputs)``.
        kept: Places of those that move; of many the first are looked at.
        output: Place of the output.

    Returns:
        For each of them shape ``(n_samples, n_curves)``.
    """
    if model.pole_radius is None or not model.pole_radius < 1.0:
        return []
    found, held = list[Array](), np.tile(inputs.mean(axis=0), (len(inputs), 1))
    for j in kept[:MOST_INPUTS]:
        moved, size, runs = held.copy(), float(inputs[:, j].std()), list[Array]()
        for bent in _curves((inputs[:, j] - held[:, j]) / size).T:
            moved[:, j] = held[:, j] + (bent - bent.mean()) * size
            runs.append(model.simulate(moved).reshape(len(moved), -1)[:, output])
        # An input without effect gives no curve but rounding.
        found += [np.column_stack([_one_wide(run) for run in runs])]
    return found


def _one_wide(x: Array) -> Array:
    spread = float(x.std())
    return (x - x.mean()) / spread if spread > STILL * float(np.abs(x).max()) else np.zeros(len(x))


def _late(x: Array, lag: int = 1) -> Array:
    return np.concatenate([np.repeat(x[:1], lag, axis=0), x[:-lag]])


def _slowed(x: Array, memory: float) -> Array:
    """What follows a signal with a time constant, from the next sample on, settled at its first value."""
    pole = float(np.exp(-1.0 / memory))
    late = _late(x)
    return np.array([slowed(column, pole, float(column[0])) for column in late.T]).T


def _curves(x: Array) -> Array:
    """A parabola, and what is above each of some quantiles."""
    bends = [np.maximum(x - at, 0.0) for at in np.quantile(x, AT)]
    return np.column_stack([x**2, *bends])


def _products(u: Array) -> list[Array]:
    n = u.shape[1]
    return [u[:, i] * u[:, j] for i in range(n) for j in range(i)]


def _play(x: Array, width: float) -> Array:
    """What follows a signal only when it is pushed by the ends of a gap (backlash)."""
    out = np.empty(len(x))
    at = x[0]
    for k, value in enumerate(x.tolist()):
        at = min(max(at, value - width), value + width)
        out[k] = at
    return out
