"""The state of a nonlinear model before a record that shows it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NOISE = 1e-2
"""Standard deviation of an output's history in scaled numbers, beside a state whose deviation from what is expected is
of order 1: weak enough to matter only where the history does not show a state."""

SHARPENED, LEAST_NOISE = 4, 1e-10
"""Times that the noise is taken from what the state leaves of the history, where that is less; and its least."""

STEPS = 50
"""Steps of a search at most."""

MANY = 6
"""States up to which searches begin on both sides of each."""

LARGEST = 1e100
"""Numbers from here on are those of a run that explodes."""


def usable(values: Array) -> bool:
    """Whether numbers can be squared and summed up: of a run that explodes they cannot."""
    return bool(np.abs(values).max(initial=0.0) < LARGEST)


@dataclass(frozen=True, kw_only=True, eq=False)
class StateSearch:
    r"""The scaled state :math:`\xi` that minimises :math:`|e(\xi)|^2/\sigma^2 + |\xi - \xi_0|^2` over a history.

    :math:`\sigma` is what is left of the output there: the less the state leaves of it, the less what was expected has
    a say.

    Args:
        misfit: Errors at a state, and their derivatives where those are asked for (else anything in their place).
        low: Least state.
        high: Greatest state.
        expected: The state expected.
    """

    misfit: Callable[[Array, bool], tuple[Array, Array]]
    low: Array
    high: Array
    expected: Array

    def found(self, begins: Sequence[Array] = ()) -> Array:
        """The state, from the best of several beginnings.

        Args:
            begins: Where searches begin; what is expected, the middle and, of few states, both sides of each by
                default.

        Returns:
            Shape ``(n_states,)``.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # runs from some of them may explode
            # Two of them are one as a rule: what is expected lies within the bounds, or in the middle.
            distinct = {begin.tobytes(): begin for begin in begins or self._around()}.values()
            ends = [self.descended(begin, NOISE) for begin in distinct]
            return self._sharpened(min(ends, key=lambda end: self.total(end, NOISE)))

    def _around(self) -> list[Array]:
        n = len(self.expected)
        near = np.clip(self.expected, self.low, self.high)
        begins = [near, np.clip(np.zeros(n), self.low, self.high)]
        if n <= MANY:
            begins += [np.clip(sign * row, self.low, self.high) for row in np.eye(n) for sign in (1.0, -1.0)]
        return begins

    def _sharpened(self, xi: Array) -> Array:
        """A state found again, the less it leaves of the output with the less noise."""
        spare, noise = len(self.misfit(xi, False)[0]) - len(self.expected), NOISE
        for _ in range(SHARPENED if spare > 0 else 0):
            level = max(float(np.linalg.norm(self.misfit(xi, False)[0])) / spare**0.5, LEAST_NOISE)
            if not level < noise / 2.0:
                break
            noise = level
            xi = self.descended(xi, noise)
        return xi

    def total(self, xi: Array, noise: float = NOISE) -> float:
        """What is minimised, at a state."""
        away = self.misfit(xi, False)[0]
        total = float(away @ away) / noise**2 + float(np.sum((xi - self.expected) ** 2))
        return total if np.isfinite(total) else np.inf

    def descended(self, xi: Array, noise: float = NOISE) -> Array:
        """Levenberg-Marquardt from one state, within the bounds."""
        n, damping, best = len(xi), 1e-3, self.total(xi, noise)
        for _ in range(STEPS):
            away, J = self.misfit(xi, True)
            if not usable(J) or not usable(away):
                break
            # By orthogonal factors: squared, the precision of a state that is seen well leaves no digit to the others.
            spread = np.sqrt(damping * ((J**2).sum(axis=0) / noise**2 + 1.0))
            rows = np.concatenate([J / noise, np.eye(n), np.diag(spread)])
            misses = np.concatenate([away / noise, xi - self.expected, np.zeros(n)])
            trial = np.clip(xi - np.linalg.lstsq(rows, misses, rcond=None)[0], self.low, self.high)
            total = self.total(trial, noise)
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
