"""What exporters lower: one model, or several wired output to input, as stages run one after the other.

A single model is a surrogate of one stage. A cascade is several: each stage reads inputs of the whole or outputs of
earlier stages, in their units, within the same sample. In a circle a stage also reads past samples of what a later
stage computes; these are put into its state at the end of the step (:class:`Late`). Exporters know stages only, so that
whatever can be written as stages runs in every format. How models are wired is :class:`sysid.models.Cascade`'s to say.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sysid.errors import ConfigError
from sysid.export.cell import Cell, cell_of
from sysid.export.layout import DelayLine, SpaceState, StateLayout, layout_of
from sysid.export.space import SpaceCell
from sysid.models import AbstractModel, Cascade, History, Limit
from sysid.models.wiring import Member, Wiring

Range = tuple[float, float]
"""Least and greatest value, in the channel's unit."""
Level = float | str
"""A value at rest, or the input whose first sample it is."""
LONGEST_IDENTIFIER = 60
"""Characters. A file's name may have 255, with its folders 260 on Windows, and a cascade may have eighty outputs."""


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
        column: The channel that is the limit, in ``[inputs of the whole | outputs]``; ``None`` where it is a value.
    """

    upper: bool
    value: float = 0.0
    column: int | None = None


@dataclass(frozen=True, kw_only=True)
class Late:
    """A number of the state that is a channel which a later stage computes.

    Args:
        place: Its place in the state of the whole.
        column: The channel, in ``[inputs of the whole | outputs of the whole]``.
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
        sources: For each of its inputs the column in ``[inputs of the whole | outputs of the whole]``.
        targets: For each of its outputs the column.
        limits: For each of its outputs the declared limits: the upper before the lower, which wins where they cross.
        first: Where its state begins in the state of the whole.
        first_remainder: Where its remainders begin among those of the whole, in float32.
    """

    model: Member
    sources: tuple[int, ...]
    targets: tuple[int, ...]
    limits: tuple[tuple[Side, ...], ...]
    first: int
    first_remainder: int

    @cached_property
    def cell(self) -> Cell | SpaceCell:
        """What is written."""
        return cell_of(self.model)

    @cached_property
    def state(self) -> StateLayout | SpaceState:
        """The layout of its own state, counted from ``first``."""
        return layout_of(self.model)

    @property
    def lagged(self) -> tuple[Cell, StateLayout]:
        """Cell and layout of a model over lagged regressors."""
        cell = Cell.of(self.model)
        return cell, StateLayout.of_cell(cell)

    @property
    def space(self) -> SpaceCell:
        """The cell of a model that is a state space."""
        if isinstance(self.cell, SpaceCell):
            return self.cell
        raise ConfigError("not a state space", got=self.cell.ends.outputs)

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
    def remainders(self) -> int:
        """Numbers more in its state in float32: what rounding took from its newest numbers, for the next step."""
        if isinstance(self.cell, SpaceCell):
            return self.state.size
        return self.cell.n_outputs if self.cell.adds else 0

    @property
    def bounded(self) -> bool:
        """Whether its outputs are held within bounds of the model itself."""
        return bool(np.isfinite(self.cell.low) or np.isfinite(self.cell.high))

    @property
    def limited(self) -> bool:
        """Whether an output has a declared limit."""
        return any(self.limits)


@dataclass(frozen=True, kw_only=True, eq=False)
class Surrogate:
    """Stages and what goes in.

    Args:
        source: The model or cascade that is written.
        inputs: What goes in.
        outputs: What comes out, in the order in which it is computed.
        stages: In the order in which they run.
    """

    source: AbstractModel | Cascade
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    stages: tuple[Stage, ...]

    @classmethod
    def of(
        cls,
        source: AbstractModel | Cascade,
        ranges: Dict[str, Range] | None = None,
        starts: Dict[str, float] | None = None,
    ) -> Surrogate:
        """A model or a cascade as a surrogate.

        Args:
            source: What to write.
            ranges: The values that inputs are declared for, by channel.
            starts: The values of inputs that nobody sets, by channel; the middle of their range by default, 0
                without one.

        Returns:
            The surrogate.

        Raises:
            ConfigError: If a model is of a kind that cannot be written, or models in a circle have no input.
        """
        if isinstance(source, Cascade):
            models, wiring, limits = source.models, source.wiring, source.limits
        else:
            models, wiring, limits = (source,), Wiring.of([source]), {}
        if not wiring.inputs:
            raise ConfigError(
                "nothing goes into the models",
                expected="at least one channel that none of them computes",
                got=", ".join(str(model.mapping) for model in models),
                remedy="wire models of which one reads what comes from outside",
            )
        ranges, starts = ranges or {}, starts or {}
        identifiers, levels = _identifiers(wiring.channels), _levels(source, wiring)
        inputs = tuple(
            Port(
                name=name,
                unit=wiring.units[name],
                identifier=identifiers[name],
                level=levels[name],
                range=ranges.get(name),
                start=starts.get(name, sum(ranges.get(name, (0.0, 0.0))) / 2.0),
            )
            for name in wiring.inputs
        )
        outputs = tuple(
            Port(name=name, unit=wiring.units[name], identifier=identifiers[name], level=levels[name])
            for name in wiring.outputs
        )
        return cls(source=source, inputs=inputs, outputs=outputs, stages=_stages(models, wiring, limits))

    @property
    def channels(self) -> tuple[Port, ...]:
        """Inputs, then outputs."""
        return (*self.inputs, *self.outputs)

    @property
    def sample_time(self) -> float:
        """Seconds."""
        return self.source.sample_time

    @property
    def identifier(self) -> str:
        """A C identifier that tells what it computes, such as ``bp_ar_to_bc``: prefix of names, name of files.

        Where that would be too long, what it begins with, and a digest of all of it.
        """
        sides = ("_".join(port.identifier for port in ports) for ports in (self.inputs, self.outputs))
        whole = "_to_".join(sides)
        if len(whole) <= LONGEST_IDENTIFIER:
            return whole
        digest = hashlib.sha256(whole.encode()).hexdigest()[:8]
        return f"{whole[:LONGEST_IDENTIFIER].rpartition('_')[0] or whole[:LONGEST_IDENTIFIER]}_{digest}"

    @property
    def mapping(self) -> str:
        """What goes in and comes out, such as ``BP+AR -> BC``."""
        return f"{'+'.join(p.name for p in self.inputs)} -> {', '.join(p.name for p in self.outputs)}"

    @property
    def label(self) -> str:
        """The structures of the stages."""
        return ", ".join(stage.model.structure.label for stage in self.stages)

    @property
    def lines(self) -> tuple[DelayLine, ...]:
        """The delay lines of all stages, laid end to end."""
        return tuple(
            replace(line, first=stage.first + line.first) for stage in self.stages for line in stage.state.lines
        )

    @property
    def late(self) -> tuple[Late, ...]:
        """Numbers of the state that are set once a step is computed; none without a circle."""
        return tuple(late for stage in self.stages for late in stage.late)

    @property
    def state_size(self) -> int:
        """Length of the state."""
        return sum(stage.state.size for stage in self.stages)

    @property
    def remainders(self) -> int:
        """Numbers more in the state in float32, at its end; 0 at the beginning of a run."""
        return sum(stage.remainders for stage in self.stages)

    def state_length(self, dtype: DTypeLike) -> int:
        """Length of the state of a file.

        Args:
            dtype: Number type of the file.

        Returns:
            The state's size; in float32 with a place for every remainder.
        """
        return self.state_size + (self.remainders if np.dtype(dtype) == np.float32 else 0)

    def levels(self, first: NDArray[np.float64]) -> NDArray[np.float64]:
        """Every channel before the first sample, as declared.

        Args:
            first: The inputs' first sample, shape ``(n_inputs,)``.

        Returns:
            Shape ``(n_inputs + n_outputs,)``, in units.
        """
        values = dict(zip((port.name for port in self.inputs), map(float, first), strict=True))
        return np.array([values[p.level] if isinstance(p.level, str) else p.level for p in self.channels])

    def at_rest(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state of a system at rest, every channel at its declared level.

        Args:
            inputs: Their first sample, shape ``(n_inputs,)``, in units.

        Returns:
            Shape ``(state_size,)``.
        """
        levels = self.levels(inputs)
        return np.concatenate([stage.state.at_rest(levels[[*stage.sources, *stage.targets]]) for stage in self.stages])

    def simulate(
        self, inputs: NDArray[np.float64], rest_outputs: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Free run from rest by the model or cascade itself.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in their units.
            rest_outputs: Shape ``(n_outputs,)``; the declared levels by default.

        Returns:
            Shape ``(n_samples, n_outputs)``, in their units.
        """
        inputs = np.asarray(inputs, dtype=np.float64)
        rest = self.levels(inputs[0])[len(self.inputs) :] if rest_outputs is None else rest_outputs
        if isinstance(self.source, Cascade):
            levels = dict(zip(self.source.outputs, map(float, rest), strict=True))
            return self.source.simulate(inputs, rest=levels).values[:, len(self.inputs) :]
        history = History.at_rest(inputs=inputs[0], output=float(rest[0]))
        return self.source.simulate(inputs, history)[:, np.newaxis]

    def state_text(self) -> dict[str, Any]:
        """The state as JSON values, with how to read it."""
        spaces = [(stage.first, stage.state) for stage in self.stages if isinstance(stage.state, SpaceState)]
        text = {
            "size": self.state_size,
            "order": "delay line after delay line; within a line the newest sample first",
            "number": "(value in the channel's unit - offset) / scale",
            "lines": [line.to_dict() for line in self.lines],
            "remainders_float32": self.remainders,
        }
        return text | ({"state_spaces": [{"first": at, **state.to_dict()} for at, state in spaces]} if spaces else {})


def _stages(models: Sequence[Member], wiring: Wiring, limits: Dict[str, Limit]) -> tuple[Stage, ...]:
    columns = {name: i for i, name in enumerate(wiring.channels)}
    stages: list[Stage] = []
    first = remainder = 0
    for model in models:
        ends = cell_of(model).ends
        stage = Stage(
            model=model,
            sources=tuple(columns[name] for name in ends.inputs),
            targets=tuple(columns[name] for name in ends.outputs),
            limits=tuple(_sides(limits.get(name, Limit()), columns) for name in ends.outputs),
            first=first,
            first_remainder=remainder,
        )
        stages.append(stage)
        first, remainder = first + stage.state.size, remainder + stage.remainders
    return tuple(stages)


def _sides(limit: Limit, columns: Dict[str, int]) -> tuple[Side, ...]:
    sides = []
    for upper, value in ((True, limit.high), (False, limit.low)):
        if isinstance(value, str):
            sides.append(Side(upper=upper, column=columns[value]))
        elif value is not None and np.isfinite(value):
            sides.append(Side(upper=upper, value=float(value)))
    return tuple(sides)


def _levels(source: AbstractModel | Cascade, wiring: Wiring) -> dict[str, Level]:
    """Every channel's level; an input without a declared one stands at its own first sample."""
    levels: dict[str, Level] = {name: name for name in wiring.inputs}
    models = source.models if isinstance(source, Cascade) else (source,)
    for ends in (cell_of(model).ends for model in models):
        levels |= dict(zip(ends.outputs, ends.rest_outputs, strict=True))
    return levels | dict(source.rest if isinstance(source, Cascade) else {})


def _identifiers(names: Sequence[str]) -> dict[str, str]:
    """Channel names as different C identifiers."""
    found: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^0-9a-z]+", "_", name.lower()).strip("_") or "channel"
        plain = f"c{plain}" if plain[0].isdigit() else plain
        number = 2
        unique = plain
        while unique in found.values():
            unique, number = f"{plain}_{number}", number + 1
        found[name] = unique
    return found
