"""The free run of a fitted model over a record that it was fitted to."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.models import AbstractModel, History, Start, beginning
from sysid.traces import Trace

MOST_SAMPLES = 20_000
"""Samples of a record that are looked at: more would not make the finding any surer."""
MOST_BESIDE = 8
"""Channels that a model does not read that are looked at."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeRun:
    """The free run over a record that was fitted, from where it is scored on.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        output: As measured, shape ``(n_samples, n_outputs)``.
        simulated: Likewise.
        usable: Which samples are not masked, shape ``(n_samples,)``.
        history: What the run began with.
        first: The sample of the record at which the run begins.
        beside: Channels of the record that the model does not read, by name, each of shape ``(n_samples,)``; the first
            so many that are never missing.
    """

    inputs: NDArray[np.float64]
    output: NDArray[np.float64]
    simulated: NDArray[np.float64]
    usable: NDArray[np.bool_]
    history: History
    first: int = 0
    beside: Dict[str, NDArray[np.float64]] = field(default_factory=dict)

    @classmethod
    def of(cls, model: AbstractModel, trace: Trace, start: Start) -> FreeRun:
        """The run over a record, or over its beginning where that is long.

        Args:
            model: The fitted model.
            trace: The record.
            start: What stands before it.

        Returns:
            The run.
        """
        inputs, output, usable = (
            trace.columns(model.mapping.inputs),
            model.measured(trace),
            trace.usable_of(model.mapping.channels),
        )
        begun = beginning(model, inputs, output, start, usable, case=trace.name)
        window = slice(begun.first, begun.first + MOST_SAMPLES)
        shape = (-1, len(model.mapping.outputs))
        return cls(
            inputs=inputs[window].copy(),  # the rest of a long record is not kept for it
            output=output[window].reshape(shape).copy(),
            simulated=model.simulate(inputs[window], begun.history).reshape(shape),
            usable=usable[window],
            history=begun.history,
            first=begun.first,
            beside=_beside(model, trace, window),
        )

    def held(self, model: AbstractModel) -> NDArray[np.float64]:
        """The run with every input held at its mean, from the same beginning: what of it no input does.

        Args:
            model: The model that ran.

        Returns:
            Shape ``(n_samples, n_outputs)``.
        """
        means = self.inputs[self.usable].mean(axis=0)
        inputs = np.broadcast_to(means, self.inputs.shape).copy()
        return model.simulate(inputs, self.history).reshape(self.output.shape)


def _beside(model: AbstractModel, trace: Trace, window: slice) -> dict[str, NDArray[np.float64]]:
    """What else was recorded, where it is known throughout."""
    names = [name for name in trace.channel_names if name not in model.mapping.channels]
    known = [name for name in names if trace.usable_of([name])[window].all()]
    return {name: trace[name][window].copy() for name in known[:MOST_BESIDE]}
