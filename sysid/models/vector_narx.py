"""NARX with several outputs: one network for channels that act on each other within a sample."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.models.ends import Ends, read_now
from sysid.models.lags import Lags, LagSpec
from sysid.models.mapping import LISTS, Mapping, check_fields, listed
from sysid.models.narx import CLAMP, NARX
from sysid.names import read_sides, written_side


@dataclass(frozen=True, kw_only=True)
class VectorMapping:
    """Which channels go in, which come out; written ``STP -> BP+AR+BC``.

    Args:
        inputs: Names of the input channels; none for a record without input.
        outputs: Names of the output channels, at least one.

    Raises:
        ConfigError: If there is no output, or a channel appears twice.

    Example:
        >>> str(VectorMapping.parse("STP -> BP + AR"))
        'STP -> BP+AR'
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(self.inputs))
        object.__setattr__(self, "outputs", tuple(self.outputs))
        names = (*self.inputs, *self.outputs)
        if not self.outputs or not all(names) or len(set(names)) != len(names):
            raise ConfigError(
                "not a mapping of input channels to output channels",
                expected="different channel names on both sides, as in STP -> BP+AR",
                got=str(self),
                remedy="name each channel once; a model's own past outputs are inputs by its structure",
            )

    def __str__(self) -> str:
        return f"{written_side(self.inputs)} -> {written_side(self.outputs)}".lstrip()

    @classmethod
    def of(cls, value: object) -> VectorMapping:
        """A mapping from what people write.

        Args:
            value: A mapping of one output or of several, its text, or its lists:
                ``{"inputs": ["STP"], "outputs": ["BP", "AR"]}``.

        Returns:
            The mapping.

        Raises:
            ConfigError: If it is none of these.
        """
        if isinstance(value, VectorMapping):
            return value
        if isinstance(value, Mapping) or (isinstance(value, Dict) and "output" in value):
            one = Mapping.of(value)
            return cls(inputs=one.inputs, outputs=(one.output,))
        if not isinstance(value, Dict):
            return cls.parse(str(value))
        check_fields(value, ("inputs", "outputs"), "{inputs: [STP], outputs: [BP, AR]}")
        return cls(inputs=listed(value["inputs"], what="inputs"), outputs=listed(value["outputs"], what="outputs"))

    @classmethod
    def parse(cls, text: str) -> VectorMapping:
        """Read a mapping from text.

        Args:
            text: Input names joined by ``+``, an arrow, output names joined by ``+``.

        Returns:
            The mapping.

        Raises:
            ConfigError: If the text does not have that form.
        """
        sides = read_sides(text)
        if len(sides) != 2:
            raise ConfigError(
                "not a mapping",
                expected="input channels, an arrow and output channels, as in STP -> BP+AR",
                got=text,
                remedy="write -> between inputs and outputs" if len(sides) < 2 else f"write {LISTS}",
            )
        inputs, outputs = sides
        return cls(inputs=tuple(inputs), outputs=tuple(outputs))


@dataclass(frozen=True, kw_only=True)
class VectorNARX:
    """Delays and neurons of a network with several outputs.

    Every output is a function of the same neurons, and every neuron reads the past of all outputs: what one reservoir
    does to another within a sample is part of the network.

    Args:
        input_delays: Lags of the inputs, as in :class:`~sysid.models.NARX`.
        output_delays: Lags of the outputs in the same forms, from 1 on; one set for all, or a list of one per output.
        neurons: Number of tanh neurons.
        feedthrough: A linear part from all regressors to the outputs beside the neurons.

    Raises:
        ConfigError: If a set of lags or the number of neurons cannot be used.

    Example:
        >>> VectorNARX(input_delays="0:2", output_delays=[1, 2, 4], neurons=20).label
        'VectorNARX 0:2/1..4(3)/20'
        >>> VectorNARX(input_delays=[0], output_delays=2, neurons=5).lags(1, 3).n_regressors
        7
    """

    input_delays: tuple[tuple[int, ...], ...]
    output_delays: tuple[tuple[int, ...], ...]
    neurons: int
    feedthrough: bool = True

    kind = "VectorNARX"

    def __init__(
        self,
        *,
        input_delays: LagSpec | Iterable[LagSpec],
        output_delays: LagSpec | Iterable[LagSpec],
        neurons: int,
        feedthrough: bool = True,
    ) -> None:
        several = not isinstance(output_delays, (int, str)) and not all(isinstance(e, int) for e in output_delays)
        sets = list(output_delays) if several and not isinstance(output_delays, int) else [output_delays]
        # Each set goes through the structure of one output, which checks it and the neurons.
        parts = [
            NARX(input_delays=input_delays, output_delays=one, neurons=neurons, feedthrough=feedthrough)  # type: ignore[arg-type]  # checked there
            for one in sets
        ]
        object.__setattr__(self, "input_delays", parts[0].input_delays)
        object.__setattr__(self, "output_delays", tuple(part.output_delays for part in parts))
        object.__setattr__(self, "neurons", neurons)
        object.__setattr__(self, "feedthrough", feedthrough)

    @property
    def label(self) -> str:
        """Delays and neurons, as the label of a network with one output."""
        labels = dict.fromkeys(
            NARX(input_delays=self.input_delays, output_delays=one, neurons=self.neurons).label.split(" ")[1]
            for one in self.output_delays
        )
        return f"{self.kind} {', '.join(labels)}"

    def lags(self, n_inputs: int, n_outputs: int) -> Lags:
        """The regressors: inputs, then outputs, all as channels that are read with a lag.

        Args:
            n_inputs: Inputs of the mapping.
            n_outputs: Outputs of the mapping.

        Returns:
            Lags whose ``inputs`` are the inputs and the outputs of the network, and whose ``output`` is empty.

        Raises:
            ConfigError: If several sets are given and their number is not that of the channels.
        """
        sets: list[tuple[int, ...]] = []
        for what, given, n in (("input", self.input_delays, n_inputs), ("output", self.output_delays, n_outputs)):
            if len(given) not in {1, n}:
                raise ConfigError(
                    f"the sets of {what} delays do not match the {what}s",
                    where=f"{what}_delays",
                    expected=f"one set, or {n}: one per {what}",
                    got=f"{len(given)} sets",
                    remedy=f"give each {what} its own list, or one list for all",
                )
            sets += given * n if len(given) == 1 else given
        return Lags(inputs=tuple(sets), output=())

    def parameter_count(self, n_inputs: int, n_outputs: int) -> int:
        """Length of the flat parameters ``[W | b | V | c | w]`` for so many channels."""
        r = self.lags(n_inputs, n_outputs).n_regressors
        return self.neurons * (r + 1) + n_outputs * (self.neurons + 1 + (r if self.feedthrough else 0))

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "kind": self.kind,
            "input_delays": [list(lags) for lags in self.input_delays],
            "output_delays": [list(lags) for lags in self.output_delays],
            "neurons": self.neurons,
            "feedthrough": self.feedthrough,
        }


@dataclass(frozen=True, kw_only=True)
class VectorScaling:
    """``scaled = (value - offset) / scale`` for every input and output.

    Args:
        input_offset: One per input, in its unit.
        input_scale: One per input, in its unit, positive.
        output_offset: One per output, in its unit.
        output_scale: One per output, in its unit, positive.
    """

    input_offset: tuple[float, ...]
    input_scale: tuple[float, ...]
    output_offset: tuple[float, ...]
    output_scale: tuple[float, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorNARXModel:
    r"""A fitted network with several outputs.

    In scaled numbers :math:`\hat y_t = \mathrm{clip}(w x_t + c + V \tanh(W x_t + b))` with one row of :math:`w` and
    :math:`V` for each output, and the past of all outputs in :math:`x_t`. It runs as a cascade of one member.

    Args:
        network: The structure.
        theta: Flat parameters ``[W (neurons, regressors) | b | V (outputs, neurons) | c | w (outputs, regressors)]``.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which come out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_units: Unit of each output.
        rest_outputs: Each output at rest, in its unit.
        clamp: Bound of every output in scaled numbers.

    Raises:
        TraceError: If the parameters do not fit the structure.
    """

    network: VectorNARX
    theta: NDArray[np.float64]
    scaling: VectorScaling
    mapping: VectorMapping
    sample_time: float
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]
    clamp: float = CLAMP

    def __post_init__(self) -> None:
        theta = np.array(self.theta, dtype=np.float64)
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)
        for name in ("input_units", "output_units", "rest_outputs"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        count = self.network.parameter_count(len(self.mapping.inputs), len(self.mapping.outputs))
        if theta.shape != (count,):
            raise TraceError(
                "the parameter vector does not fit the structure",
                expected=f"{count} parameters",
                got=f"shape {theta.shape}",
                remedy="use parameters that were fitted with this structure",
            )

    @property
    def structure(self) -> VectorNARX:
        """Delays and neurons."""
        return self.network

    @property
    def n_parameters(self) -> int:
        """Length of ``theta``."""
        return len(self.theta)

    @property
    def lags(self) -> Lags:
        """The regressors over inputs and outputs."""
        return self.network.lags(len(self.mapping.inputs), len(self.mapping.outputs))

    @property
    def ends(self) -> Ends:
        """Its channels, as wiring sees them."""
        return Ends(
            inputs=self.mapping.inputs,
            outputs=self.mapping.outputs,
            input_units=self.input_units,
            output_units=self.output_units,
            rest_outputs=self.rest_outputs,
            direct=read_now(self.mapping.inputs, self.lags.inputs),
        )

    def with_theta(self, theta: NDArray[np.float64]) -> VectorNARXModel:
        """The same network with other weights."""
        return replace(self, theta=theta)

    def predict_outputs(
        self, signals: Dict[str, NDArray[np.float64]], rest: Dict[str, float]
    ) -> dict[str, NDArray[np.float64]]:
        """Prediction one step ahead from measured outputs.

        Args:
            signals: Every input and output, in its unit, shape ``(n_samples,)`` each.
            rest: Their values before the first sample.

        Returns:
            Every output, shape ``(n_samples,)``.
        """
        scaling, depth, n_out = self.scaling, self.lags.depth, len(self.mapping.outputs)
        names = (*self.mapping.inputs, *self.mapping.outputs)
        z = np.column_stack([np.concatenate([np.full(depth, rest[name]), signals[name]]) for name in names])
        z = (z - np.array(scaling.input_offset + scaling.output_offset)) / np.array(
            scaling.input_scale + scaling.output_scale
        )
        n, pairs = len(z) - depth, zip(self.lags.input_channel, self.lags.input_lag, strict=True)
        x = np.column_stack([z[depth - lag : depth - lag + n, column] for column, lag in pairs])
        k, r = self.network.neurons, x.shape[1]
        W, b, V, c, w = np.split(self.theta, np.cumsum([k * r, k, n_out * k, n_out]))
        y = np.tanh(x @ W.reshape(k, r).T + b) @ V.reshape(n_out, k).T + c
        y = np.clip(y + x @ w.reshape(n_out, r).T if len(w) else y, -self.clamp, self.clamp)
        y = y * np.array(scaling.output_scale) + np.array(scaling.output_offset)
        return {name: y[:, j] for j, name in enumerate(self.mapping.outputs)}

    def to_dict(self) -> dict[str, Any]:
        """Everything needed to build the model again."""
        scaling = self.scaling
        return {
            "structure": self.network.to_dict(),
            "mapping": str(self.mapping),
            "sample_time": self.sample_time,
            "input_units": list(self.input_units),
            "output_units": list(self.output_units),
            "rest_outputs": list(self.rest_outputs),
            "clamp": self.clamp if np.isfinite(self.clamp) else None,  # JSON has no infinity
            "scaling": {name: list(getattr(scaling, name)) for name in VectorScaling.__dataclass_fields__},
            "theta": self.theta.tolist(),
        }

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> VectorNARXModel:
        """The model that :meth:`to_dict` wrote."""
        return cls(
            network=VectorNARX(**{key: value for key, value in fields["structure"].items() if key != "kind"}),
            theta=np.array(fields["theta"], dtype=np.float64),
            scaling=VectorScaling(**{key: tuple(value) for key, value in fields["scaling"].items()}),
            mapping=VectorMapping.parse(fields["mapping"]),
            sample_time=fields["sample_time"],
            input_units=tuple(fields["input_units"]),
            output_units=tuple(fields["output_units"]),
            rest_outputs=tuple(fields["rest_outputs"]),
            clamp=np.inf if fields["clamp"] is None else fields["clamp"],
        )
