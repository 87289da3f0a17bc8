"""A map from sample to sample that is linear until an output reaches a level, and set anew there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ratio = tuple[int | None, int]
"""A quotient of two inputs, by their numbers; ``None`` over an input is its inverse."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Armed:
    """Where an event counts: while an output that has two values is at one of them.

    Args:
        output: Its number.
        sign: 1 where it is at the lower one, -1 where at the higher.
        level: Half-way between both.
    """

    output: int
    sign: int
    level: float

    def __call__(self, outputs: Array) -> NDArray[np.bool_]:
        """Whether it counts; outputs of shape ``(n_outputs, ...)``."""
        return np.asarray(self.sign * outputs[self.output] <= self.sign * self.level)


@dataclass(frozen=True, kw_only=True, eq=False)
class Guard:
    """An event, and what it does.

    Args:
        row: Of what the level is: factors of the outputs and of the inputs, shape ``(n_outputs + n_inputs,)``.
        sign: 1 where the event is at the level or below it, -1 where at the level or above.
        level: In the unit of that.
        reset: What the outputs are then, from :func:`features` of what they were; shape ``(n_features, n_outputs)``.
        armed: Where it counts; ``None`` for everywhere.
    """

    row: Array
    sign: int
    level: float
    reset: Array
    armed: Armed | None = None

    def reached(self, outputs: Array, inputs: Array) -> NDArray[np.bool_]:
        """Whether it is the event.

        Args:
            outputs: Shape ``(n_outputs, ...)``.
            inputs: Shape ``(n_inputs, ...)``, as far as they go.

        Returns:
            Shape ``(...)``.
        """
        there = self.sign * quantity(self.row, outputs, inputs) <= self.sign * self.level
        return np.asarray(there if self.armed is None else there & self.armed(outputs))


@dataclass(frozen=True, kw_only=True, eq=False)
class Rest:
    """Where events come to an end: what would be set to less than that stands still.

    Args:
        output: Number of the output by which it is told.
        below: Magnitude below which all outputs are set to :attr:`values` in place of what the event says.
        values: Of each output, shape ``(n_outputs,)``.
    """

    output: int
    below: float
    values: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class ResetMap:
    """The map.

    Args:
        flow: From outputs, inputs and 1 to the outputs a step later; shape ``(n_outputs, n_outputs + n_inputs + 1)``.
            Inputs are those of the records and their :attr:`ratios`, here and in the guards.
        steps: From sample to sample: the reference looks for events so often.
        ratios: Quotients of inputs that count as inputs.
        looks_first: Whether it looks before it moves, as what switches by what it has measured; else behind.
        guards: The events; the first that is reached counts.
        rest: Where they end; ``None`` where they do not.
        begin: Outputs before the first sample, shape ``(n_outputs,)``.
    """

    flow: Array
    steps: int
    guards: Sequence[Guard]
    rest: Rest | None
    begin: Array
    ratios: tuple[Ratio, ...] = ()
    looks_first: bool = False

    @cached_property
    def n_outputs(self) -> int:
        """Outputs."""
        return len(self.flow)

    def run(self, inputs: Array) -> Array:
        """The free run from the beginning.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``.

        Returns:
            Outputs, shape ``(n_samples, n_outputs)``.
        """
        found = np.empty((len(inputs), self.n_outputs))
        with np.errstate(all="ignore"):
            at = self.begin
            for k, u in enumerate(with_ratios(inputs, self.ratios)):
                for _ in range(self.steps):
                    at = self.step(at, u)
                found[k] = at
        return found

    def step(self, outputs: Array, inputs: Array) -> Array:
        """One step.

        Args:
            outputs: Shape ``(n_outputs,)``.
            inputs: With the quotients, shape ``(n_inputs,)``.

        Returns:
            Shape ``(n_outputs,)``.
        """
        if self.looks_first:
            return self._flown(self._looked(outputs, inputs), inputs)
        return self._looked(self._flown(outputs, inputs), inputs)

    def _flown(self, outputs: Array, inputs: Array) -> Array:
        return np.asarray(self.flow @ np.concatenate([outputs, inputs, [1.0]]))

    def _looked(self, at: Array, inputs: Array) -> Array:
        for guard in self.guards:
            if guard.reached(at, inputs):
                at = features(at[:, np.newaxis], inputs[:, np.newaxis])[0] @ guard.reset
                return at if self.rest is None or abs(at[self.rest.output]) >= self.rest.below else self.rest.values
        return at


def with_ratios(inputs: Array, ratios: Sequence[Ratio]) -> Array:
    """Inputs and their quotients.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        ratios: Which.

    Returns:
        Shape ``(n_samples, n_inputs + n_ratios)``.
    """
    if not ratios:
        return inputs
    with np.errstate(all="ignore"):
        more = [(1.0 if above is None else inputs[:, above]) / inputs[:, below] for above, below in ratios]
    return np.column_stack([inputs, *more])


def quantity(row: Array, outputs: Array, inputs: Array) -> Array:
    """A sum of outputs and inputs.

    Args:
        row: Its factors, shape ``(n_outputs + n_inputs,)``.
        outputs: Shape ``(n_outputs, ...)``.
        inputs: Shape ``(n_inputs, ...)``.

    Returns:
        Shape ``(...)``.
    """
    p = len(outputs)
    return np.asarray(_summed(row[:p], outputs) + _summed(row[p:], inputs))


def _summed(row: Array, columns: Array) -> Array:
    """What ``np.tensordot`` gives, which takes ten times as long for a single sample, of which runs ask for each."""
    if columns.ndim == 1:
        return np.asarray(np.dot(row[np.newaxis], columns[:, np.newaxis])[0, 0])
    return np.asarray(np.tensordot(row, columns, axes=1))


def features(outputs: Array, inputs: Array) -> Array:
    """What a reset is linear in: outputs, 1, and both times every input.

    Args:
        outputs: Shape ``(n_outputs, n)``.
        inputs: Shape ``(n_inputs, n)``.

    Returns:
        Shape ``(n, (n_outputs + 1)*(n_inputs + 1))``.
    """
    own = np.vstack([outputs, np.ones((1, outputs.shape[1]))])
    return np.concatenate([own, *(own * one for one in inputs)]).T
