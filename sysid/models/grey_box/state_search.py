"""The state of a nonlinear model at rest, which nobody measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sysid.models.contract.state_descent import STEPS, usable

Array = NDArray[np.float64]
Derived = tuple[Array, Array, Array]
"""Values, and their derivatives by state and by parameters."""

SLOWLY, SHORTER, PATIENCE = 1e-2, 0.5, 3
"""Part of what changes by which a step has to lessen it, or part of the step before that it has to be shorter than; and
steps in a row that may be neither before a search ends."""

STOOD = 1e-10
"""What changes where nothing does, in shares of what would: searches from elsewhere are not needed then."""

RANK = 1e-9
"""Share of the largest singular value below which an equilibrium leaves a direction open."""


class Bounded(Protocol):
    """What is known of states: their ordinary levels and scales, bounds, and whether the level is declared."""

    @property
    def level(self) -> Array: ...  # noqa: D102 - see StateTerms
    @property
    def scale(self) -> Array: ...  # noqa: D102
    @property
    def declared(self) -> NDArray[np.bool_]: ...  # noqa: D102
    def held(self, x: Array) -> Array: ...  # noqa: D102


class Standing(Protocol):
    """A system whose inputs stand."""

    def change(self, x: Array) -> Array:
        """What changes at a state.

        Args:
            x: The state, shape ``(n_states,)``.

        Returns:
            The same shape.
        """
        ...

    def leaves(self, x: Array, free: NDArray[np.int64]) -> bool:
        """Whether a system that stands leaves a state as soon as it is moved a little.

        Args:
            x: The state, shape ``(n_states,)``.
            free: Places of the states that are not held.

        Returns:
            Whether it does.
        """
        ...

    def __call__(self, x: Array) -> tuple[Derived, Derived]:
        """What changes at a state, and the outputs there, with derivatives.

        Args:
            x: The state, shape ``(n_states,)``.

        Returns:
            Both.
        """
        ...


def at_rest(standing: Standing, output: Array, output_scale: Array, terms: Bounded) -> tuple[Array, Array]:
    """The state at which nothing changes; where that leaves directions open, the one with these outputs.

    Of several the first is taken that a system returns to: none has stood for ever where the slightest move leads away.

    Args:
        standing: What changes at a state, and the outputs there.
        output: Outputs, in their units, shape ``(n_outputs,)``.
        output_scale: Of each, in its unit.
        terms: What is known of the states; those that are declared stay at their level.

    Returns:
        The state, shape ``(n_states,)``, and its derivatives by the parameters, shape ``(n_states, p)``.
    """
    free = np.flatnonzero(~terms.declared)
    level = terms.held(terms.level)
    if not len(free):
        return level.copy(), np.zeros((len(level), standing(level)[0][2].shape[1]))
    scale = terms.scale[free]
    begins = [level]
    for step in (1.0, -1.0, 0.1, 3.0):
        moved = level.copy()
        moved[free] += step * scale
        begins.append(terms.held(moved))
    x = _found(standing, begins, (free, scale), (output, output_scale), terms)
    (change, by_state, by_parameter), (_, out_state, out_parameter) = standing(x)
    J, open_ = _split(by_state[:, free] * scale, change)
    move = -np.linalg.pinv(J, rcond=RANK) @ by_parameter
    if open_.shape[1]:
        C = out_state[:, free] * scale / output_scale[:, None]
        away = out_parameter / output_scale[:, None] + C @ move
        move -= open_ @ np.linalg.pinv(C @ open_, rcond=RANK) @ away
    moves = np.zeros((len(x), by_parameter.shape[1]))
    moves[free] = np.where(np.isfinite(move), move, 0.0) * scale[:, None]
    return x, moves


def _found(
    standing: Standing,
    begins: Sequence[Array],
    free: tuple[NDArray[np.int64], Array],
    outputs: tuple[Array, Array],
    terms: Bounded,
) -> Array:
    """Where the searches from some states end: where it stands and stays, or stands, or changes least."""
    best, x = (2, np.inf), begins[0]
    for begin in begins:
        left, end = _stood(standing, begin, free, outputs, terms)
        rank = (2, left) if left > STOOD else (int(standing.leaves(end, free[0])), 0.0)
        if rank < best:
            best, x = rank, end
        if rank[0] == 0:
            break
    return x


def _stood(
    standing: Standing,
    x: Array,
    free: tuple[NDArray[np.int64], Array],
    outputs: tuple[Array, Array],
    terms: Bounded,
) -> tuple[float, Array]:
    """How far from rest a search ends, and where."""
    places, scale = free
    (change, by_state, _), _ = standing(x)
    rows = np.abs(by_state[:, places] * scale).max(axis=1, initial=0.0)
    rows = np.where((rows > 0.0) & np.isfinite(rows), rows, 1.0)

    def left(at: Array) -> float:
        found = float(np.linalg.norm(standing.change(at) / rows))
        return found if np.isfinite(found) else np.inf

    now, slow, before = left(x), 0, np.inf
    for _ in range(STEPS):
        (change, by_state, _), (y, out_state, _) = standing(x)
        J = by_state[:, places] * scale / rows[:, None]
        if not usable(J) or not usable(change):
            return np.inf, x
        J, open_ = _split(J, change)
        step = -np.linalg.pinv(J, rcond=RANK) @ (change / rows)
        if open_.shape[1]:
            C = out_state[:, places] * scale / outputs[1][:, None]
            step -= open_ @ np.linalg.pinv(C @ open_, rcond=RANK) @ ((y - outputs[0]) / outputs[1] + C @ step)
        if not np.isfinite(step).all() or np.abs(step).max() < 1e-13:
            break
        share, moved, then = 1.0, x, now
        while share > 1e-6:
            moved = x.copy()
            moved[places] += share * scale * step
            moved = terms.held(moved)
            then = left(moved)
            if then <= max(now, 1e-12):
                break
            share /= 2.0
        if then > max(now, 1e-12) or np.array_equal(moved, x):
            break
        # Where nothing ever stands, further steps gain as little; where all stands, they turn in a rounding. What a
        # declared state changes by is always left, and hides what the others gain: their steps become shorter.
        size = share * float(np.abs(step).max())
        slow = slow + 1 if then > (1.0 - SLOWLY) * now and size > SHORTER * before else 0
        x, now, before = moved, then, size
        if slow == PATIENCE:
            break
    return now, x


def _split(J: Array, change: Array) -> tuple[Array, Array]:
    """A matrix that is safe to invert, and the directions that it leaves open."""
    if not usable(J) or not usable(change):
        return np.zeros_like(J), np.zeros((J.shape[1], 0))
    _, sizes, rows = np.linalg.svd(J)
    rank = int(np.count_nonzero(sizes > RANK * max(float(sizes.max(initial=0.0)), 1e-300)))
    return J, rows[rank:].T
