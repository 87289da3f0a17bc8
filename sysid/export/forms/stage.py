"""A stage: one model of what is exported, where its channels stand, and what holds its outputs."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sysid.errors import ConfigError
from sysid.export.forms.lagged import LaggedForm, lowered_form
from sysid.export.forms.layout import EquationState, HiddenState, StateLayout, layout_of
from sysid.export.forms.programs import ProgramForm
from sysid.export.forms.state_space import StateSpaceForm
from sysid.kernels.neurons import NEURONS, Neuron
from sysid.models import Limit
from sysid.models.cascades.wiring import Member, Wiring

Range = tuple[float, float]
"""Least and greatest value, in the channel's unit."""
Level = float | str
"""A value at rest, or the input whose first sample it is."""


@dataclass(frozen=True, kw_only=True)
class Port:
    """An input or output of a surrogate.

    Args:
        name: Name of the channel.
        unit: Its unit.
        identifier: The name as a lower-case C identifier.
        level: Its value before the first sample, or the name of the input whose first sample it is; an input's own
            name is the usual case.
        range: The values that an input is declared for; ``None`` where nothing is declared.
        start: The value of an input that nobody sets.
    """

    name: str
    unit: str
    identifier: str
    level: Level
    range: Range | None = None
    start: float = 0.0

    @property
    def low(self) -> float:
        """Least declared value; ``-inf`` where nothing is declared."""
        return -np.inf if self.range is None else self.range[0]

    @property
    def high(self) -> float:
        """Greatest declared value; ``inf`` where nothing is declared."""
        return np.inf if self.range is None else self.range[1]


@dataclass(frozen=True, kw_only=True)
class Side:
    """One declared limit of an output.

    Args:
        upper: Whether the output may not be above it; below it otherwise.
        value: The limit in the channel's unit, where it is not a channel.
        column: The channel that is the limit, in ``[inputs of the whole | computed]``; ``None`` where it is a value.
    """

    upper: bool
    value: float = 0.0
    column: int | None = None


@dataclass(frozen=True, kw_only=True)
class Late:
    """A number of the state that is a channel which a later stage computes.

    Args:
        place: Its place in the state of the whole.
        column: The channel, in ``[inputs of the whole | what it computes]``.
        offset: In the channel's unit.
        scale: In the channel's unit.
    """

    place: int
    column: int
    offset: float
    scale: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One model of a surrogate.

    Args:
        model: The model.
        sources: For each of its inputs the column in ``[inputs of the whole | what it computes]``.
        targets: For each of its outputs the column.
        limits: For each of its outputs the declared limits: the upper before the lower, which wins where they cross.
        told: For each of its outputs whether it leaves the whole, or is a part of one that does. Of any other nobody is
            told that it is at a limit: what is between two limits by its nature, such as a switch, is at one nearly
            always.
        doubts: For each of its outputs whether being at a limit says that the answer is in doubt; that is always told.
        first: Where its state begins in the state of the whole.
        first_remainder: Where its remainders begin among those of the whole, in float32.
        spare: Whether it has the one number that a whole has whose stages have no state.
    """

    model: Member
    sources: tuple[int, ...]
    targets: tuple[int, ...]
    limits: tuple[tuple[Side, ...], ...]
    told: tuple[bool, ...]
    doubts: tuple[bool, ...]
    first: int
    first_remainder: int
    spare: bool = False

    @cached_property
    def form(self) -> LaggedForm | StateSpaceForm | ProgramForm:
        """What is written."""
        return lowered_form(self.model, spare=self.spare)

    @cached_property
    def state(self) -> StateLayout | HiddenState | EquationState:
        """The layout of its own state, counted from ``first``."""
        return layout_of(self.model, spare=self.spare)

    @property
    def lagged(self) -> tuple[LaggedForm, StateLayout]:
        """Lowered form and layout of a model over lagged regressors."""
        form = LaggedForm.of(self.model)
        return form, StateLayout.of_form(form)

    @property
    def state_space(self) -> StateSpaceForm:
        """The form of a model that is a state space."""
        if isinstance(self.form, StateSpaceForm):
            return self.form
        raise ConfigError("not a state space", got=self.form.ends.outputs)

    @property
    def equations(self) -> tuple[ProgramForm, EquationState]:
        """Form and layout of a model that is equations."""
        if isinstance(self.form, ProgramForm) and isinstance(self.state, EquationState):
            return self.form, self.state
        raise ConfigError("not equations", got=self.form.ends.outputs)

    @property
    def neuron(self) -> Neuron:
        """Kind of its neurons; those of networks in equations are of the first kind that there was."""
        return NEURONS["tanh"] if isinstance(self.form, ProgramForm) else self.form.neuron

    @property
    def known_sources(self) -> tuple[int, ...]:
        """Columns that are known when it runs; the first one in place of those that are computed later.

        What stands there is not read: of a channel that is computed later, a stage uses past samples only.
        """
        return tuple(source if source < self.targets[0] else 0 for source in self.sources)

    @property
    def late(self) -> tuple[Late, ...]:
        """Numbers of its state that are set once the whole step is computed."""
        return tuple(
            Late(place=self.first + line.first, column=source, offset=line.offset, scale=line.scale)
            for source, line in zip(self.sources, self.state.lines, strict=False)
            if source > self.targets[-1] and line.length
        )

    @property
    def searched(self) -> EquationState | None:
        """The layout of equations that have states; ``None`` for any other model."""
        state = self.state
        return state if isinstance(state, EquationState) and state.form.n_state else None

    @property
    def remainders(self) -> int:
        """Numbers more in its state in float32: what rounding took from its newest numbers, for the next step."""
        if isinstance(self.form, StateSpaceForm | ProgramForm):
            return self.form.n_state
        return self.form.n_outputs if self.form.adds else 0

    @property
    def bounded(self) -> bool:
        """Whether its outputs are held within bounds of the model itself."""
        return bool(np.isfinite(self.form.low) or np.isfinite(self.form.high))

    @property
    def limited(self) -> bool:
        """Whether an output has a declared limit."""
        return any(self.limits)


def stages_of(
    models: Sequence[Member], wiring: Wiring, limits: Dict[str, Limit], outputs: Sequence[str]
) -> tuple[Stage, ...]:
    """The models of a wiring as stages.

    Args:
        models: In the order in which they run.
        wiring: How they read each other.
        limits: What holds each output.
        outputs: What leaves the whole.

    Returns:
        The stages, in that order.
    """
    columns = {name: i for i, name in enumerate(wiring.channels)}
    stages: list[Stage] = []
    first = remainder = 0
    forgets = all(isinstance(form := lowered_form(one), ProgramForm) and not form.n_state for one in models)
    for model in models:
        ends = lowered_form(model).ends
        stage = Stage(
            model=model,
            sources=tuple(columns[name] for name in ends.inputs),
            targets=tuple(columns[name] for name in ends.outputs),
            limits=tuple(_sides(limits.get(name, Limit()), columns) for name in ends.outputs),
            told=tuple(_told(name, limits.get(name, Limit()), outputs) for name in ends.outputs),
            doubts=tuple(limits.get(name, Limit()).doubt for name in ends.outputs),
            first=first,
            first_remainder=remainder,
            spare=forgets and not stages,
        )
        stages.append(stage)
        first, remainder = first + stage.state.size, remainder + stage.remainders
    return tuple(stages)


def _told(name: str, limit: Limit, outputs: Sequence[str]) -> bool:
    return limit.doubt or any(limit.tells_of(name, output) for output in outputs)


def _sides(limit: Limit, columns: Dict[str, int]) -> tuple[Side, ...]:
    sides = []
    for upper, value in ((True, limit.high), (False, limit.low)):
        if isinstance(value, str):
            sides.append(Side(upper=upper, column=columns[value]))
        elif value is not None and np.isfinite(value):
            sides.append(Side(upper=upper, value=float(value)))
    return tuple(sides)
