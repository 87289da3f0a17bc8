"""A map from sample to sample that is linear until an output reaches a level, and set anew there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Guard:
    """An event, and what it does.

    Args:
        output: Number of the output whose level it is.
        sign: 1 where the event is at the level or below it, -1 where at the level or above.
        level: In the output's unit.
        reset: What the outputs are then, from :func:`features` of what they were; shape ``(n_features, n_outputs)``.
    """

    output: int
    sign: int
    level: float
    reset: Array

    def reached(self, outputs: Array) -> NDArray[np.bool_]:
        """Whether it is the event.

        Args:
            outputs: Shape ``(n_outputs, ...)``.

        Returns:
            Shape ``(...)``.
        """
        return np.asarray(self.sign * outputs[self.output] <= self.sign * self.level)


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
        steps: From sample to sample: the reference looks for events so often.
        guards: The events; the first that is reached counts.
        rest: Where they end; ``None`` where they do not.
        begin: Outputs before the first sample, shape ``(n_outputs,)``.
    """

    flow: Array
    steps: int
    guards: Sequence[Guard]
    rest: Rest | None
    begin: Array

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
            for k, u in enumerate(inputs):
                for _ in range(self.steps):
                    at = self.step(at, u)
                found[k] = at
        return found

    def step(self, outputs: Array, inputs: Array) -> Array:
        """One step.

        Args:
            outputs: Shape ``(n_outputs,)``.
            inputs: Shape ``(n_inputs,)``.

        Returns:
            Shape ``(n_outputs,)``.
        """
        at = self.flow @ np.concatenate([outputs, inputs, [1.0]])
        for guard in self.guards:
            if guard.reached(at):
                at = features(at[:, np.newaxis], inputs[:, np.newaxis])[0] @ guard.reset
                return at if self.rest is None or abs(at[self.rest.output]) >= self.rest.below else self.rest.values
        return np.asarray(at)


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
