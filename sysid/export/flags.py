"""What a surrogate says about each of its steps: a small set of flags, the same in every format.

A flag never changes the numbers: outside the declared range the step still answers, held within the output's bounds
where the model has them. The caller decides what to do.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.export.forms.stage import Side, Stage
from sysid.export.surrogate import Surrogate


class Flag(enum.IntFlag):
    """Bits of the flags of one step; 0 is a step within everything that was declared."""

    OUTSIDE_RANGE = 1
    """An input is outside the range that it is declared for: nothing is known about the accuracy."""
    AT_BOUND = 2
    """An output, or what it is computed from, is held at one of its bounds: it is wrong."""
    NOT_A_NUMBER = 4
    """An input is infinite or not a number, or an output is none: set the state anew before relying on what follows."""
    AT_LIMIT = 8
    """An output is held at a limit, declared or found in the records, as a pressure that cannot be below atmosphere."""
    IN_DOUBT = 16
    """The models of a committee are further apart than they are where their answer is right: it may be wrong."""


MEANING = {
    Flag.OUTSIDE_RANGE: "an input is outside its declared range; the accuracy is unknown",
    Flag.AT_BOUND: "an output is held at one of its bounds; it is wrong",
    Flag.NOT_A_NUMBER: "an input is infinite or not a number, or an output is none; set the state anew",
    Flag.AT_LIMIT: "an output is held at one of its limits, declared or found in the records",
    Flag.IN_DOUBT: "the models of the committee disagree; the answer may be wrong",
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
    lost = ~np.isfinite(inputs).all(axis=1) | np.isnan(computed).any(axis=1)
    n_inputs = inputs.shape[1]
    bound, limited, doubted = (np.zeros(len(inputs), dtype=bool) for _ in range(3))
    for stage in surrogate.stages:
        form, n = stage.form, len(stage.sources)
        for j, (target, told) in enumerate(zip(stage.targets, stage.told, strict=True)):
            output, offset, scale = computed[:, target - n_inputs], form.offset[n + j], form.scale[n + j]
            reached = np.zeros(len(inputs), dtype=bool)
            for _, at_side in _at_sides(stage, j, inputs, computed):
                reached |= at_side
            for value in (form.low, form.high):
                if np.isfinite(value):
                    bound |= ~reached & (output == value * scale + offset)
            limited |= reached & (told and not stage.doubts[j])
            doubted |= reached & stage.doubts[j]
    flags = (
        outside * int(Flag.OUTSIDE_RANGE)
        + bound * int(Flag.AT_BOUND)
        + lost * int(Flag.NOT_A_NUMBER)
        + limited * int(Flag.AT_LIMIT)
        + doubted * int(Flag.IN_DOUBT)
    )
    return np.asarray(flags, dtype=np.int32)


def _at_sides(
    stage: Stage, number: int, inputs: NDArray[np.float64], computed: NDArray[np.float64]
) -> Iterator[tuple[Side, NDArray[np.bool_]]]:
    """Each side of an output's declared limits, and the samples at which the output is there."""
    known = np.column_stack([inputs, computed])
    output = known[:, stage.targets[number]]
    for side in stage.limits[number]:
        yield side, output == (side.value if side.column is None else known[:, side.column])


@dataclass(frozen=True, kw_only=True)
class Held:
    """For how much of a run an output is at one of its declared limits.

    Args:
        output: The output.
        upper: Whether it is its upper limit.
        limit: The limit: a value with its unit, or the name of a channel.
        share: Share of the samples.
    """

    output: str
    upper: bool
    limit: str
    share: float

    @property
    def sentence(self) -> str:
        """In words."""
        side = "upper" if self.upper else "lower"
        return f"{self.output} at its {side} limit {self.limit} in {100.0 * self.share:.3g} %"


def limits_reached(surrogate: Surrogate, inputs: NDArray[np.float64], computed: NDArray[np.float64]) -> list[Held]:
    """Which declared limits hold which outputs of a free run, and for how much of it.

    Args:
        surrogate: What is run.
        inputs: Shape ``(n_samples, n_inputs)``, in their units.
        computed: Shape ``(n_samples, n_computed)``, in their units, as :meth:`Surrogate.compute` gives them.

    Returns:
        Of the outputs that come out, the limits that are reached.
    """
    ports, found = (*surrogate.inputs, *surrogate.computed), []
    for stage in surrogate.stages:
        for j, (target, told) in enumerate(zip(stage.targets, stage.told, strict=True)):
            port = ports[target]
            for side, there in _at_sides(stage, j, inputs, computed) if told and not stage.doubts[j] else ():
                share = float(np.mean(there)) if len(there) else 0.0
                if share:
                    limit = f"{side.value:g} {port.unit}" if side.column is None else ports[side.column].name
                    found.append(Held(output=port.name, upper=side.upper, limit=limit, share=share))
    return found
