"""The state of a nonlinear model that nobody measured: at rest, and before a record that shows it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Derived = tuple[Array, Array, Array]
"""Values, and their derivatives by state and by parameters."""

NOISE = 1e-2
"""Standard deviation of an output's history in scaled numbers, beside a state whose deviation from what is expected is
of order 1: weak enough to matter only where the history does not show a state."""

SHARPENED, LEAST_NOISE = 4, 1e-10
"""Times that the noise is taken from what the state leaves of the history, where that is less; and its least."""

STEPS = 50
"""Steps of a search at most."""

MANY = 6
"""States up to which searches begin on both sides of each."""

SLOWLY, SHORTER, PATIENCE = 1e-2, 0.5, 3
"""Part of what changes by which a step has to lessen it, or part of the step before that it has to be shorter than; and
steps in a row that may be neither before a search ends."""

STOOD = 1e-10
"""What changes where nothing does, in shares of what would: searches from elsewhere are not needed then."""

LARGEST = 1e100
"""Numbers from here on are those of a run that explodes."""

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
    least, x = _stood(standing, level, (free, scale), (output, output_scale), terms)
    for begin in begins[1:]:
        if least <= STOOD:
            break
        left, end = _stood(standing, begin, (free, scale), (output, output_scale), terms)
        if left < least:
            least, x = left, end
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
        if not _usable(J) or not _usable(change):
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


def _usable(values: Array) -> bool:
    """Whether numbers can be squared and summed up: of a run that explodes they cannot."""
    return bool(np.all(np.abs(values) < LARGEST))


def _split(J: Array, change: Array) -> tuple[Array, Array]:
    """A matrix that is safe to invert, and the directions that it leaves open."""
    if not _usable(J) or not _usable(change):
        return np.zeros_like(J), np.zeros((J.shape[1], 0))
    _, sizes, rows = np.linalg.svd(J)
    rank = int(np.count_nonzero(sizes > RANK * max(float(sizes.max(initial=0.0)), 1e-300)))
    return J, rows[rank:].T


@dataclass(frozen=True, kw_only=True, eq=False)
class StateSearch:
    r"""The scaled state :math:`\xi` that minimises :math:`|e(\xi)|^2/\sigma^2 + |\xi - \xi_0|^2` over a history.

    :math:`\sigma` is what is left of the output there: the less the state leaves of it, the less what was expected has
    a say.

    Args:
        misfit: Errors at a state, and their derivatives where those are asked for.
        low: Least state.
        high: Greatest state.
        expected: The state expected.
    """

    misfit: Callable[[Array, bool], tuple[Array, Array]]
    low: Array
    high: Array
    expected: Array

    def found(self) -> Array:
        """The state, from the best of several beginnings."""
        with np.errstate(over="ignore", invalid="ignore"):  # runs from some of them may explode
            return self._found()

    def _found(self) -> Array:
        n = len(self.expected)
        near = np.clip(self.expected, self.low, self.high)
        begins = [near, np.clip(np.zeros(n), self.low, self.high)]
        if n <= MANY:
            begins += [np.clip(sign * row, self.low, self.high) for row in np.eye(n) for sign in (1.0, -1.0)]
        ends = [self._descended(begin, NOISE) for begin in begins]
        xi = min(ends, key=lambda end: self._total(end, NOISE))
        away = self.misfit(xi, False)[0]
        spare, noise = len(away) - n, NOISE
        for _ in range(SHARPENED if spare > 0 else 0):
            level = max(float(np.linalg.norm(self.misfit(xi, False)[0])) / spare**0.5, LEAST_NOISE)
            if not level < noise / 2.0:
                break
            noise = level
            xi = self._descended(xi, noise)
        return xi

    def _total(self, xi: Array, noise: float) -> float:
        away = self.misfit(xi, False)[0]
        total = float(away @ away) / noise**2 + float(np.sum((xi - self.expected) ** 2))
        return total if np.isfinite(total) else np.inf

    def _descended(self, xi: Array, noise: float) -> Array:
        """Levenberg-Marquardt from one state, within the bounds."""
        n, damping, best = len(xi), 1e-3, self._total(xi, noise)
        for _ in range(STEPS):
            away, J = self.misfit(xi, True)
            if not _usable(J) or not _usable(away):
                break
            spread = np.sqrt(damping * ((J**2).sum(axis=0) / noise**2 + 1.0))
            rows = np.concatenate([J / noise, np.eye(n), np.diag(spread)])
            misses = np.concatenate([away / noise, xi - self.expected, np.zeros(n)])
            trial = np.clip(xi - np.linalg.lstsq(rows, misses, rcond=None)[0], self.low, self.high)
            total = self._total(trial, noise)
            if total < best:
                done = best - total < 1e-9 * best
                xi, best, damping = trial, total, damping / 10.0
                if done:
                    break
            else:
                damping *= 10.0
                if damping > 1e12:
                    break
        return xi
