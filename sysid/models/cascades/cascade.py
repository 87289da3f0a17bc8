"""Cascade: models wired output to input, simulated as one."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, TraceError
from sysid.models.cascades.cascade_batch import simulate_records
from sysid.models.cascades.cascade_checks import check_circles, check_levels_and_limits, check_names, own_limits
from sysid.models.cascades.cascade_run import CascadeRun, Level
from sysid.models.cascades.cascade_stages import CompiledStage, ModelStage, stages_of
from sysid.models.cascades.wiring import Member, Wiring
from sysid.models.channels.ends import Ends, check_record
from sysid.models.channels.history import input_columns
from sysid.models.channels.rest_levels import resting
from sysid.models.converting.to_control import of_wired
from sysid.models.lagged.cascade_program import Limit
from sysid.traces import Trace


@dataclass(frozen=True, kw_only=True, eq=False)
class Cascade:
    """Models wired by the names of their channels: whatever one writes, the others read, at the same sample or later.

    Inputs of the whole are the channels that no member writes. Before the first sample the system is at rest: each
    output at its declared level, each input at its own first sample unless a level is declared. Nothing is taken from a
    measured output.

    Args:
        models: The members, in any order; kept in the order in which they run.
        rest: Level of channels at rest: a value in the channel's unit, the name of an input whose first sample it is
            (a reservoir charged at the running pressure), or of an output whose level it is, whoever sets that. By
            default an output's is its model's ``rest_output``.
        limits: Limits of outputs, by channel; those of a member are its own where nothing is declared here.

    Raises:
        ConfigError: If the models cannot be wired (circle, channel computed twice, units, sample times), or a level or
            limit names a channel that it cannot.

    Example:
        >>> from sysid.models import ARX, ARXModel, Mapping
        >>> def model(text: str) -> ARXModel:
        ...     return ARXModel(orders=ARX(na=1, nb=(1,), nk=(0,)), coefficients=np.array([0.5, 0.5]), intercept=0.0,
        ...         mapping=Mapping.parse(text), sample_time=0.1, input_units=("psi",), output_unit="psi",
        ...         rest_output=0.0)
        >>> cascade = Cascade(models=(model("BP -> AR"), model("STP -> BP")), rest={"BP": "STP", "AR": "STP"})
        >>> cascade.inputs, cascade.outputs
        (('STP',), ('BP', 'AR'))
        >>> cascade.simulate(np.array([[90.0], [82.0], [82.0]]))["AR"].tolist()
        [90.0, 88.0, 86.0]
    """

    models: tuple[Member, ...]
    rest: Dict[str, Level] = field(default_factory=dict)
    limits: Dict[str, Limit] = field(default_factory=dict)

    kind = "Cascade"

    def __post_init__(self) -> None:
        wiring = Wiring.of(tuple(self.models), {name: limit.channels for name, limit in self.limits.items()})
        object.__setattr__(self, "models", tuple(self.models[i] for i in wiring.order))
        check_circles(self.models, wiring)
        object.__setattr__(self, "rest", dict(self.rest))
        object.__setattr__(self, "limits", own_limits(self.models) | dict(self.limits))
        check_levels_and_limits(self.rest, self.limits, wiring)

    @property
    def single(self) -> None:
        """Not one model alone; see :attr:`sysid.models.AbstractModel.single`."""
        return

    @cached_property
    def wiring(self) -> Wiring:
        """What reads what; the members' own order."""
        return Wiring.of(self.models)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Channels that no member writes."""
        return self.wiring.inputs

    @property
    def outputs(self) -> tuple[str, ...]:
        """Channels that the members write, in the order in which they are computed."""
        return self.wiring.outputs

    @property
    def units(self) -> dict[str, str]:
        """Unit of every channel."""
        return self.wiring.units

    @property
    def sample_time(self) -> float:
        """Seconds."""
        return self.models[0].sample_time

    @property
    def n_parameters(self) -> int:
        """Parameters of all members."""
        return sum(model.n_parameters for model in self.models)

    @property
    def label(self) -> str:
        """The structures of the members."""
        return ", ".join(f"{model.mapping} {model.label}" for model in self.models)

    def member(self, output: str) -> Member:
        """The member that writes a channel.

        Args:
            output: The channel.

        Returns:
            The member.

        Raises:
            ChannelError: If no member writes it.
        """
        for model in self.models:
            if output in Ends.of(model).outputs:
                return model
        raise ChannelError([output], self.outputs, where="outputs of the cascade")

    def with_member(self, model: Member) -> Cascade:
        """The same cascade with the member replaced that writes these outputs.

        Args:
            model: The new member.

        Returns:
            The cascade; its wiring is found anew.

        Raises:
            ConfigError: If its outputs are not those of one member.
        """
        outputs = set(Ends.of(model).outputs)
        same = [set(Ends.of(other).outputs) == outputs for other in self.models]
        if not any(same):
            raise ConfigError(
                "no member to replace",
                expected=f"the outputs of one of {', '.join(str(other.mapping) for other in self.models)}",
                got=str(model.mapping),
            )
        models = tuple(model if yes else other for other, yes in zip(self.models, same, strict=True))
        own = own_limits(self.models)  # of which those of the former member go with it
        declared = {name: limit for name, limit in self.limits.items() if own.get(name) != limit}
        return replace(self, models=models, limits=declared)

    def upstream_of(self, outputs: Collection[str], *, given: Collection[str] = ()) -> Cascade:
        """The part that some outputs depend on.

        Args:
            outputs: Outputs of members.
            given: Channels that are inputs of the part, whoever writes them here.

        Returns:
            The cascade of those members.
        """
        writer = {name: model for model in self.models for name in Ends.of(model).outputs}
        wanted, waiting = set[str](), [name for name in outputs if name not in given]
        while waiting:
            name = waiting.pop()
            if name in writer and name not in wanted:
                ends = Ends.of(writer[name])
                wanted |= set(ends.outputs)
                held_by = [bound for n in ends.outputs if n in self.limits for bound in self.limits[n].channels]
                waiting += [source for source in (*ends.inputs, *held_by) if source not in given]
        models = tuple(model for model in self.models if set(Ends.of(model).outputs) & wanted)
        channels = {name for model in models for end in (Ends.of(model),) for name in (*end.inputs, *end.outputs)}
        limits = {name: limit for name, limit in self.limits.items() if name in wanted}
        # A given channel begins where its record does if the channel that it would rest at is no longer there.
        there = {name: level for name, level in self.rest.items() if name in channels}
        # What followed an output that is no longer there has that output's level.
        there = {
            name: level if level in channels or name in given else self.level(name) for name, level in there.items()
        }
        rest = {name: level for name, level in there.items() if not isinstance(level, str) or level in channels}
        return Cascade(models=models, rest=rest, limits=limits)

    def to_control(self) -> Any:
        """Linear members as one object of python-control, from deviations of the inputs to deviations of every output.

        Returns:
            A ``control.StateSpace`` in the channels' units, dead times among its states.

        Raises:
            ConfigError: If a member is not linear, or an output has limits.
        """
        if self.limits:
            raise ConfigError(
                "a cascade with limits is not linear",
                where=", ".join(self.limits),
                expected="no limits",
                got=f"limits of {len(self.limits)} outputs",
                remedy="convert the members one by one: cascade.member(NAME).to_control()",
            )
        return of_wired(self.models, self.inputs, self.outputs, self.sample_time)

    @cached_property
    def stages(self) -> tuple[CompiledStage | ModelStage, ...]:
        """Members that the compiled pass takes together, and models with a state of their own between them."""
        return stages_of(self.models, self.wiring.channels, self.limits)

    def levels(self, first: NDArray[np.float64], rest: Dict[str, Level] | None = None) -> NDArray[np.float64]:
        """Every channel before the first sample.

        Args:
            first: The inputs' first sample, shape ``(n_inputs,)``.
            rest: Levels that take the place of the declared ones.

        Returns:
            Shape ``(n_inputs + n_outputs,)``, in units.

        Raises:
            ChannelError: If a level names a channel that it cannot.
        """
        start = dict(zip(self.inputs, map(float, first), strict=True))
        own = start | self._own_levels
        declared = {**self.rest, **(rest or {})}
        check_names("rest", declared, self.wiring.channels)
        levels = []
        for name in self.wiring.channels:
            level = resting(name, declared, own, self.outputs)
            if isinstance(level, str):
                check_names(f"rest of {name}", [level], self.inputs)
                level = start[level]
            levels.append(float(level))
        return np.array(levels)

    @cached_property
    def _own_levels(self) -> dict[str, float]:
        ends = map(Ends.of, self.models)
        return {name: level for end in ends for name, level in zip(end.outputs, end.rest_outputs, strict=True)}

    def level(self, output: str) -> Level:
        """Where an output is declared to be at rest.

        Args:
            output: The output.

        Returns:
            A value in its unit, or the input whose first sample it is.
        """
        return resting(output, self.rest, self._own_levels, self.outputs)

    def simulate(self, inputs: NDArray[np.float64], *, rest: Dict[str, Level] | None = None) -> CascadeRun:
        """Free run of the whole from its inputs alone.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the order of :attr:`inputs` and in their units.
            rest: Levels at rest that take the place of the declared ones in this run.

        Returns:
            Every channel at every sample, and what was held.

        Raises:
            TraceError: If the number of inputs is not the cascade's.
            ChannelError: If a level names a channel that it cannot.
        """
        inputs = self.checked(inputs, 2)
        values, held = self.empty(len(inputs))
        self.run(inputs, rest, values, held)
        return self.wrapped(values, held)

    def run_from(self, inputs: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.float64]:
        """Free run from rest at some outputs; see :meth:`sysid.models.AbstractModel.run_from`."""
        levels = dict(zip(self.outputs, map(float, rest), strict=True))
        return self.simulate(inputs, rest=levels).values[:, inputs.shape[1] :]

    def simulate_trace(self, trace: Trace, *, rest: Dict[str, Level] | None = None) -> CascadeRun:
        """Free run over a trace's inputs; its other channels are not read.

        Args:
            trace: The trace.
            rest: As in :meth:`simulate`.

        Returns:
            The run.

        Raises:
            ChannelError: If the trace lacks an input.
            ConfigError: If the trace has another sample time, or a channel in another unit.
        """
        check_record(self.units, self.sample_time, trace)
        return self.simulate(trace.columns(self.inputs), rest=rest)

    def simulate_batch(
        self, inputs: NDArray[np.float64], *, rest: Dict[str, Level] | None = None, workers: int = 2
    ) -> CascadeRun:
        """Free runs over independent records of equal length: the cars of a train, the sequences of a stress test.

        Args:
            inputs: Shape ``(n_records, n_samples, n_inputs)``.
            rest: As in :meth:`simulate`.
            workers: Threads.

        Returns:
            One run whose arrays have a first axis of records.

        Raises:
            TraceError: If the number of inputs is not the cascade's.
            ChannelError: If a level names a channel that it cannot.
        """
        return simulate_records(self, inputs, rest=rest, workers=workers)

    def checked(self, inputs: NDArray[np.float64], axes: int) -> NDArray[np.float64]:
        """Inputs of the right shape, or an error.

        Args:
            inputs: Samples, or records of samples.
            axes: How many axes they must have.

        Returns:
            The inputs as float64; what is infinite is not a number.

        Raises:
            TraceError: If the shape is not the cascade's.
        """
        inputs = input_columns(inputs, self.inputs)
        if inputs.ndim != axes or inputs.shape[-1] != len(self.inputs) or 0 in inputs.shape[:-1]:
            raise TraceError(
                "the inputs do not fit the cascade",
                expected=f"{axes} axes, the last of them {len(self.inputs)}: {', '.join(self.inputs)}",
                got=f"shape {inputs.shape}",
                remedy="give one column per input, in the order of cascade.inputs",
            )
        return inputs

    def empty(self, *shape: int) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
        """Room for a run: values of all channels, and what held the outputs.

        Args:
            shape: Number of samples, or of records and samples.

        Returns:
            Both arrays.
        """
        return np.empty((*shape, len(self.wiring.channels))), np.empty((*shape, len(self.outputs)), dtype=np.int8)

    def wrapped(self, values: NDArray[np.float64], held: NDArray[np.int8]) -> CascadeRun:
        """Arrays that are filled as a run.

        Args:
            values: Of all channels, the last axis.
            held: What held the outputs.

        Returns:
            The run.
        """
        return CascadeRun(
            inputs=self.inputs, outputs=self.outputs, values=values, held=held, units=self.units,
            sample_time=self.sample_time,
        )  # fmt: skip

    def run(
        self,
        inputs: NDArray[np.float64],
        rest: Dict[str, Level] | None,
        values: NDArray[np.float64],
        held: NDArray[np.int8],
    ) -> None:
        """Run over one record into arrays that are there.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``.
            rest: As in :meth:`simulate`.
            values: Shape ``(n_samples, n_channels)``, written.
            held: Shape ``(n_samples, n_outputs)``, written.
        """
        values[:, : inputs.shape[1]] = inputs
        levels = self.levels(inputs[0], rest)
        at = 0
        for stage in self.stages:
            stage.run(levels, values, held[:, at : at + stage.n_outputs])
            at += stage.n_outputs

    def to_dict(self) -> dict[str, Any]:
        """Everything needed to build the cascade again, as JSON values."""
        return {
            "structure": {"kind": self.kind},
            "members": [model.to_dict() for model in self.models],
            "rest": dict(self.rest),
            "limits": {name: limit.to_dict() for name, limit in self.limits.items()},
        }
