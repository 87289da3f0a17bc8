"""What exporters lower: one model, or several wired output to input, as stages run one after the other.

A single model is a surrogate of one stage. A cascade is several: each stage reads inputs of the whole or outputs of
earlier stages, in their units, within the same sample. In a circle a stage also reads past samples of what a later
stage computes; these are put into its state at the end of the step (:class:`Late`). Exporters know stages only, so that
whatever can be written as stages runs in every format. How models are wired is :class:`sysid.models.Cascade`'s to say.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sysid.errors import ConfigError
from sysid.export.forms.lagged import lowered_form
from sysid.export.forms.layout import DelayLine, HiddenState
from sysid.export.forms.stage import Late, Level, Port, Range, Stage, stages_of
from sysid.models import AbstractModel, Cascade
from sysid.models.cascades.wiring import Wiring
from sysid.models.channels.history import known_inputs
from sysid.models.channels.rest_levels import leaders, resting
from sysid.models.contract.form import unheeded
from sysid.names import c_identifier, distinct, written_side
from sysid.traces import Trace

LONGEST_IDENTIFIER = 60
"""Characters. A file's name may have 255, with its folders 260 on Windows, and a cascade may have eighty outputs."""
TICK = "tick"
"""Name of the input of models without input: one number a sample, whatever it is."""
MANY = 8
"""Stages beyond which their structures are not listed in a line."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Surrogate:
    """Stages and what goes in.

    Args:
        source: The model or cascade that is written.
        inputs: What goes in.
        computed: What the stages compute, in that order.
        outputs: What of it comes out.
        stages: In the order in which they run.
    """

    source: AbstractModel | Cascade
    inputs: tuple[Port, ...]
    computed: tuple[Port, ...]
    outputs: tuple[Port, ...]
    stages: tuple[Stage, ...]

    @classmethod
    def of(
        cls,
        source: AbstractModel | Cascade,
        ranges: Dict[str, Range] | None = None,
        starts: Dict[str, float] | None = None,
        outputs: Sequence[str] | None = None,
    ) -> Surrogate:
        """A model or a cascade as a surrogate.

        Args:
            source: What to write.
            ranges: The values that inputs are declared for, by channel.
            starts: The values of inputs that nobody sets, by channel; the middle of their range by default, 0
                without one.
            outputs: What comes out, in this order; all that is computed by default.

        Returns:
            The surrogate.

        Raises:
            ConfigError: If a model is of a kind that cannot be written, or an output is not computed.
        """
        wiring = Wiring.of(source.models)
        wiring = wiring if wiring.inputs else _ticking(wiring)
        ranges, starts = ranges or {}, starts or {}
        identifiers, levels = distinct(wiring.channels, c_identifier), _levels(source, wiring)
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
        computed = {
            name: Port(name=name, unit=wiring.units[name], identifier=identifiers[name], level=levels[name])
            for name in wiring.outputs
        }
        names = _known_names(wiring.outputs if outputs is None else outputs, computed)
        return cls(
            source=source,
            inputs=inputs,
            computed=tuple(computed.values()),
            outputs=tuple(computed[name] for name in names),
            stages=stages_of(source.models, wiring, source.limits, names),
        )

    @property
    def ticks(self) -> bool:
        """Whether nothing goes into the models, so that its one input says how long to run and is not read."""
        return not self.source.inputs

    def inputs_of(self, trace: Trace) -> NDArray[np.float64]:
        """What goes in over a trace.

        Args:
            trace: The trace.

        Returns:
            Shape ``(n_samples, n_inputs)``, in their units.

        Raises:
            ChannelError: If it lacks an input.
        """
        return np.zeros((len(trace), 1)) if self.ticks else trace.columns([port.name for port in self.inputs])

    @property
    def channels(self) -> tuple[Port, ...]:
        """Inputs, then everything that is computed."""
        return (*self.inputs, *self.computed)

    @property
    def columns(self) -> tuple[int, ...]:
        """Where each output stands among :attr:`channels`."""
        return tuple(len(self.inputs) + self.computed.index(port) for port in self.outputs)

    @cached_property
    def followers(self) -> dict[int, int]:
        """What begins where an output does that comes out: its column among :attr:`channels`, and that output's."""
        columns = {port.name: len(self.inputs) + at for at, port in enumerate(self.computed)}
        return {columns[name]: columns[led] for name, led in self.following([p.name for p in self.outputs]).items()}

    def following(self, names: Collection[str]) -> dict[str, str]:
        """What has the level at rest of one of some outputs, whoever says what that is.

        Args:
            names: The outputs.

        Returns:
            Of each other one that follows one of them, the nearest.
        """
        computed, rest, found = [port.name for port in self.computed], self.source.rest, {}
        for name in computed:
            led = [one for one in leaders(name, rest, computed) if one in names]
            if led and name not in names:
                found[name] = led[0]
        return found

    @property
    def selects(self) -> bool:
        """Whether what comes out is not simply all that is computed."""
        return self.outputs != self.computed

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
        return f"{written_side([p.name for p in self.inputs])} -> {', '.join(p.name for p in self.outputs)}"

    @property
    def label(self) -> str:
        """The structures of the stages; of many, their number."""
        if len(self.stages) > MANY:
            return f"{len(self.stages)} models with {self.source.n_parameters} parameters"
        return ", ".join(stage.model.label for stage in self.stages)

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
            Shape ``(n_channels,)``, in units.
        """
        values = dict(zip((port.name for port in self.inputs), map(float, known_inputs(first)), strict=True))
        return np.array([values[p.level] if isinstance(p.level, str) else p.level for p in self.channels])

    def at_rest(self, inputs: NDArray[np.float64], computed: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """The state of a system at rest, every channel at its declared level.

        Args:
            inputs: Their first sample, shape ``(n_inputs,)``, in units.
            computed: Other levels of what is computed, shape ``(n_computed,)``.

        Returns:
            Shape ``(state_size,)``.
        """
        levels = self.levels(inputs)
        if computed is not None:
            levels[len(self.inputs) :] = computed
        return np.concatenate([stage.state.at_rest(levels[[*stage.sources, *stage.targets]]) for stage in self.stages])

    def simulate(
        self, inputs: NDArray[np.float64], rest_outputs: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Free run from rest by the model or cascade itself, of what comes out.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in their units.
            rest_outputs: Shape ``(n_outputs,)``; the declared levels by default.

        Returns:
            Shape ``(n_samples, n_outputs)``, in their units.
        """
        inputs = np.asarray(inputs, dtype=np.float64)
        return self.chosen(self.compute(inputs, self.rest(inputs[0], rest_outputs)))

    def rest(self, first: NDArray[np.float64], outputs: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """What is computed, before the first sample.

        Args:
            first: The inputs' first sample, shape ``(n_inputs,)``.
            outputs: Other values of the outputs, shape ``(n_outputs,)``; the declared levels by default.

        Returns:
            Shape ``(n_computed,)``, in units.
        """
        levels = self.levels(first)
        if outputs is not None:
            levels[list(self.columns)] = outputs
            levels[list(self.followers)] = levels[list(self.followers.values())]
        return levels[len(self.inputs) :]

    def chosen(self, computed: NDArray[np.float64]) -> NDArray[np.float64]:
        """What comes out of what is computed: shape ``(n_samples, n_outputs)`` of ``(n_samples, n_computed)``."""
        return computed[:, [column - len(self.inputs) for column in self.columns]] if self.selects else computed

    def compute(self, inputs: NDArray[np.float64], rest: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Free run from rest by the model or cascade itself, of everything that is computed.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in their units.
            rest: Shape ``(n_computed,)``; the declared levels by default.

        Returns:
            Shape ``(n_samples, n_computed)``, in their units.
        """
        inputs = np.asarray(inputs, dtype=np.float64)
        rest = self.rest(inputs[0]) if rest is None else rest
        inputs = inputs[:, :0] if self.ticks else inputs
        return self.source.run_from(inputs, rest)

    def run_from(self, inputs: NDArray[np.float64], initial: Dict[str, float]) -> NDArray[np.float64]:
        """Free run from other outputs than the declared levels.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in their units.
            initial: Outputs before the first sample, in their units, by name.

        Returns:
            Everything that is computed, shape ``(n_samples, n_computed)``.

        Raises:
            ConfigError: If one of them says nothing to the models: the run would be the same without it.
        """
        names = [port.name for port in self.outputs]
        declared = self.chosen(self.rest(inputs[0])[np.newaxis])[0]
        moved = np.array([initial.get(name, level) for name, level in zip(names, declared, strict=True)])
        run = self.compute(inputs, self.rest(inputs[0], moved))
        for at in [names.index(name) for name in initial]:
            # The declared level is no other one: whether the models heed one, one that is shows.
            same = bool(moved[at] == declared[at])
            kept = np.where(np.arange(len(names)) == at, declared + same, moved)
            begun = same and np.isclose(self.chosen(run)[0, at], moved[at])
            if not begun and np.array_equal(self.compute(inputs, self.rest(inputs[0], kept)), run):
                raise unheeded(f"{names[at]} = {moved[at]:g}", model=self.label)
        return run

    def state_text(self) -> dict[str, Any]:
        """The state as JSON values, with how to read it."""
        spaces = [(stage.first, stage.state) for stage in self.stages if isinstance(stage.state, HiddenState)]
        text = {
            "size": self.state_size,
            "order": "delay line after delay line; within a line the newest sample first",
            "number": "(value in the channel's unit - offset) / scale",
            "lines": [line.to_dict() for line in self.lines],
            "remainders_float32": self.remainders,
        }
        equations = [(stage.first, stage.searched) for stage in self.stages if stage.searched]
        if spaces:
            text["state_spaces"] = [{"first": at, **state.to_dict()} for at, state in spaces]
        if equations:
            text["equations"] = [{"first": at, **state.to_dict()} for at, state in equations]
        return text


def _ticking(wiring: Wiring) -> Wiring:
    """What nothing goes into, with an input that nobody reads: it tells exported files how long to run."""
    name = TICK
    while name in wiring.outputs:
        name += "_"
    return replace(wiring, inputs=(name,), units={name: "", **wiring.units})


def _known_names(names: Sequence[str], computed: Dict[str, Port]) -> tuple[str, ...]:
    """Names of outputs, each of something that is computed, and once."""
    if not names or len(set(names)) < len(names) or not set(names) <= set(computed):
        raise ConfigError(
            "these cannot be the outputs of what is exported",
            where="outputs",
            expected=f"some of {', '.join(computed)}, each once",
            got=", ".join(names) or "none",
            remedy="name what the models compute",
        )
    return tuple(names)


def _levels(source: AbstractModel | Cascade, wiring: Wiring) -> dict[str, Level]:
    """Every channel's level; an input without a declared one stands at its own first sample."""
    levels: dict[str, Level] = {name: name for name in wiring.inputs}
    own: dict[str, float] = {}
    for ends in (lowered_form(model).ends for model in source.models):
        own |= dict(zip(ends.outputs, ends.rest_outputs, strict=True))
    declared = {name: resting(name, source.rest, own, wiring.outputs) for name in wiring.outputs}
    return levels | dict(source.rest) | declared
