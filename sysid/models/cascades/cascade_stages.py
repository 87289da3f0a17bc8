"""The passes in which a cascade runs: recursions together, models with a state of their own between them."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from sysid.kernels import cascade as kernel
from sysid.kernels.cascade_layout import FREE, HIGH, HIGH_CHANNEL, LOW, LOW_CHANNEL, Program
from sysid.kernels.cascade_plan import planned
from sysid.models.cascades.wiring import Member
from sysid.models.channels.ends import Ends
from sysid.models.channels.history import History
from sysid.models.contract.base import AbstractModel
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.lagged.cascade_program import Limit, program_of

_NOTHING = np.empty((0, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class CompiledStage:
    """Recursions that run in one compiled pass over the samples.

    Args:
        n_outputs: How many channels it writes.
        depth: Past samples that it reads.
        program: Its members.
    """

    n_outputs: int
    depth: int
    program: Program

    @cached_property
    def planned(self) -> tuple[NDArray[np.uintp], NDArray[np.float64], NDArray[np.float64]]:
        """What the pass is given of them: their plan, and their numbers."""
        return planned(self.program)

    def run(self, levels: NDArray[np.float64], values: NDArray[np.float64], held: NDArray[np.int8]) -> None:
        """Run over one record.

        Args:
            levels: Every channel before the first sample, shape ``(n_channels,)``.
            values: Every channel, shape ``(n_samples, n_channels)``; the stage's outputs are written.
            held: What held its outputs, shape ``(n_samples, n_outputs)``, written.
        """
        own = np.ascontiguousarray(held)  # some columns of an array are another type, of which all is compiled again
        kernel.run(*self.planned, self.depth, levels, values, _NOTHING, own)
        held[:] = own


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelStage:
    """A model with a state of its own; a limit holds its output and leaves its state.

    Args:
        model: The model.
        channels: Columns of the arrays that it reads and writes.
        limits: Of each of its outputs.
    """

    model: AbstractModel
    channels: tuple[str, ...]
    limits: tuple[Limit, ...]

    @property
    def n_outputs(self) -> int:
        """How many channels it writes."""
        return len(self.limits)

    def run(self, levels: NDArray[np.float64], values: NDArray[np.float64], held: NDArray[np.int8]) -> None:
        """Run over one record; as for :class:`CompiledStage`."""
        sources = [self.channels.index(name) for name in self.model.mapping.inputs]
        columns = [self.channels.index(name) for name in self.model.mapping.outputs]
        resting = levels[columns] if self.model.structure.several_outputs else float(levels[columns[0]])
        output = self.model.recursion.simulate(
            values[:, sources], History.at_rest(inputs=levels[sources], output=resting)
        )
        for j, (column, limit) in enumerate(zip(columns, self.limits, strict=True)):
            values[:, column] = output.reshape(len(values), -1)[:, j]
            self._hold(values, column, limit, held[:, j])

    def _hold(self, values: NDArray[np.float64], column: int, limit: Limit, held: NDArray[np.int8]) -> None:
        """Hold an output within its limits."""
        held[:] = FREE
        for side, constant, channel, sign in (
            (limit.high, HIGH, HIGH_CHANNEL, 1.0),
            (limit.low, LOW, LOW_CHANNEL, -1.0),
        ):
            if side is not None:
                named = isinstance(side, str)
                bound = values[:, self.channels.index(side)] if isinstance(side, str) else np.full(len(values), side)
                beyond = sign * values[:, column] > sign * bound
                values[:, column] = np.where(beyond, bound, values[:, column])
                held[beyond] = channel if named else constant


def stages_of(
    models: Sequence[Member], channels: tuple[str, ...], limits: Dict[str, Limit]
) -> tuple[CompiledStage | ModelStage, ...]:
    """The stages of some members.

    Args:
        models: In the order in which they run.
        channels: Columns of the arrays that they read and write.
        limits: Limits by output.

    Returns:
        As few stages as there can be.
    """
    stages: list[CompiledStage | ModelStage] = []
    lowered = [(model, ColumnRecursion.of(model)) for model in models]
    for compiled, together in groupby(lowered, key=lambda entry: entry[1] is not None):
        run = list(together)
        if compiled:
            members, ends = [one for _, one in run if one is not None], [Ends.of(model) for model, _ in run]
            stages.append(
                CompiledStage(
                    n_outputs=sum(len(end.outputs) for end in ends),
                    depth=max(member.lags.depth for member in members),
                    program=program_of(members, ends, channels, limits),
                )
            )
        else:
            for model, _ in run:
                own = tuple(limits.get(name, Limit()) for name in model.mapping.outputs)
                stages.append(ModelStage(model=model, channels=channels, limits=own))
    return tuple(stages)
