"""What exporters lower: one model, or several wired output to input, as stages run one after the other.

A single model is a surrogate of one stage. A cascade without a loop between its models is several: each stage reads
inputs of the whole or outputs of earlier stages, in their units, within the same sample. Exporters know stages only,
so that whatever can be written as stages runs in every format.
"""

from __future__ import annotations

import re
from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.export.layout import DelayLine, LinearState, StateLayout, layout_of, recursion_of
from sysid.models import AbstractForm, AbstractModel, Ends, History, Recursion, Wiring

Range = tuple[float, float]
"""Least and greatest value, in the channel's unit."""


@dataclass(frozen=True, kw_only=True)
class Port:
    """An input or output of a surrogate.

    Args:
        name: Name of the channel.
        unit: Its unit.
        identifier: The name as a lower-case C identifier.
        range: The values that an input is declared for; ``None`` where nothing is declared.
        start: The value of an input that nobody sets.
    """

    name: str
    unit: str
    identifier: str
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One model of a surrogate.

    Args:
        model: The model.
        sources: For each of its inputs the column in ``[inputs of the whole | outputs of earlier stages]``.
        first: Where its state begins in the state of the whole.
    """

    model: AbstractModel
    sources: tuple[int, ...]
    first: int

    @property
    def form(self) -> AbstractForm:
        """The form that is exported."""
        return self.model.recursion

    @property
    def recursion(self) -> Recursion:
        """The form, where it has delay lines (:class:`ConfigError` where it is a state space)."""
        return recursion_of(self.model)

    @property
    def state(self) -> StateLayout | LinearState:
        """The layout of its own state, counted from ``first``."""
        return layout_of(self.model)

    @property
    def layout(self) -> StateLayout:
        """The layout of its delay lines, counted from ``first``; as for ``recursion``."""
        return StateLayout.of(self.model)

    @property
    def bounded(self) -> bool:
        """Whether its output is held within bounds."""
        return bool(np.isfinite(self.form.low) or np.isfinite(self.form.high))


@dataclass(frozen=True, kw_only=True, eq=False)
class Surrogate:
    """Stages and what goes in.

    Args:
        inputs: What goes in.
        stages: In the order in which they run; the output of each is an output of the whole.
    """

    inputs: tuple[Port, ...]
    stages: tuple[Stage, ...]

    @classmethod
    def of(
        cls, model: AbstractModel, ranges: Dict[str, Range] | None = None, starts: Dict[str, float] | None = None
    ) -> Surrogate:
        """A single model as a surrogate.

        Args:
            model: The model.
            ranges: The values that its inputs are declared for, by channel.
            starts: The values of inputs that nobody sets, by channel.

        Returns:
            A surrogate of one stage.
        """
        return cls.wired([model], ranges, starts)

    @classmethod
    def wired(
        cls,
        models: Sequence[AbstractModel],
        ranges: Dict[str, Range] | None = None,
        starts: Dict[str, float] | None = None,
    ) -> Surrogate:
        """Models wired by the names of their channels.

        Args:
            models: In any order that :class:`~sysid.models.Wiring` can put right: a model reads another's output under
                its name, and whatever no model computes is an input of the whole.
            ranges: The values that inputs are declared for, by channel.
            starts: The values of inputs that nobody sets, by channel; the middle of their range by default, 0
                without one.

        Returns:
            The surrogate.

        Raises:
            ConfigError: If there is no model, an output is computed twice, the models read each other in a circle, or
                sample times or units differ.
        """
        wiring = Wiring.of(models)
        models = [models[i] for i in wiring.order]
        _check_no_circle(models, wiring)
        units, inputs = wiring.units, wiring.inputs
        columns = {name: i for i, name in enumerate(wiring.channels)}
        stages, first = [], 0
        for model in models:
            stages.append(
                Stage(model=model, sources=tuple(columns[name] for name in model.mapping.inputs), first=first)
            )
            first += layout_of(model).size
        identifiers = _identifiers(columns)
        ranges, starts = ranges or {}, starts or {}
        ports = [
            Port(
                name=name,
                unit=units[name],
                identifier=identifiers[name],
                range=ranges.get(name),
                start=starts.get(name, sum(ranges.get(name, (0.0, 0.0))) / 2.0),
            )
            for name in inputs
        ]
        return cls(inputs=tuple(ports), stages=tuple(stages))

    @property
    def outputs(self) -> tuple[Port, ...]:
        """The output of every stage."""
        names = [port.name for port in self.inputs] + [stage.model.mapping.output for stage in self.stages]
        identifiers = _identifiers(names)
        models = [stage.model for stage in self.stages]
        return tuple(
            Port(name=m.mapping.output, unit=m.output_unit, identifier=identifiers[m.mapping.output]) for m in models
        )

    @property
    def sample_time(self) -> float:
        """Seconds."""
        return self.stages[0].model.sample_time

    @property
    def identifier(self) -> str:
        """A C identifier that tells what it computes, such as ``bp_ar_to_bc``: prefix of names, name of files."""
        sides = ("_".join(port.identifier for port in ports) for ports in (self.inputs, self.outputs))
        return "_to_".join(sides)

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
    def state_size(self) -> int:
        """Length of the state."""
        return sum(stage.state.size for stage in self.stages)

    @property
    def rest_outputs(self) -> NDArray[np.float64]:
        """The declared output at rest of every stage, in its unit, shape ``(n_outputs,)``."""
        return np.array([stage.model.rest_output for stage in self.stages])

    def at_rest(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state of a system that has stood at some inputs for ever, its outputs at their declared rest values.

        Args:
            inputs: Shape ``(n_inputs,)``, in their units.

        Returns:
            Shape ``(state_size,)``.
        """
        known = np.concatenate([np.asarray(inputs, dtype=np.float64), self.rest_outputs])
        return np.concatenate(
            [
                stage.state.from_history(
                    History.at_rest(inputs=known[list(stage.sources)], output=stage.model.rest_output)
                )
                for stage in self.stages
            ]
        )

    def simulate(
        self, inputs: NDArray[np.float64], rest_outputs: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Free run from rest by the models themselves, each fed with what the earlier ones put out.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in their units.
            rest_outputs: Shape ``(n_outputs,)``; the declared ones by default.

        Returns:
            Shape ``(n_samples, n_outputs)``, in their units.
        """
        known = np.asarray(inputs, dtype=np.float64)
        rest = np.asarray(self.rest_outputs if rest_outputs is None else rest_outputs, dtype=np.float64)
        first = np.concatenate([known[0], rest])
        for k, stage in enumerate(self.stages):
            history = History.at_rest(inputs=first[list(stage.sources)], output=float(rest[k]))
            output = stage.model.simulate(known[:, list(stage.sources)], history)
            known = np.column_stack([known, output])
        return known[:, len(self.inputs) :]

    def state_text(self) -> dict[str, Any]:
        """The state as JSON values, with how to read it."""
        spaces = [(stage.first, stage.state) for stage in self.stages if isinstance(stage.state, LinearState)]
        text = {
            "size": self.state_size,
            "order": "delay line after delay line; within a line the newest sample first",
            "number": "(value in the channel's unit - offset) / scale",
            "lines": [line.to_dict() for line in self.lines],
        }
        return text | ({"state_spaces": [{"first": at, **state.to_dict()} for at, state in spaces]} if spaces else {})


def _check_no_circle(models: Sequence[AbstractModel], wiring: Wiring) -> None:
    """Stages run one after the other; what a later one put out a sample ago is not among their inputs."""
    back = [str(model.mapping) for model in models if wiring.feeds_back(Ends.of(model))]
    if back:
        raise ConfigError(
            "models that read each other in a circle cannot be exported as stages",
            expected="models of which each reads inputs and outputs of models before it",
            got=f"{', '.join(back)} read what is computed after them",
            remedy="export models without a circle",
        )


def _identifiers(names: Sequence[str] | Dict[str, int]) -> dict[str, str]:
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
