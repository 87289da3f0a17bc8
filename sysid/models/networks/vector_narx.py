"""NARX with several outputs: one network for channels that act on each other within a sample."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.models.channels.history import History
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import VectorScaling
from sysid.models.contract.moves import moves_of
from sysid.models.contract.several_outputs import SeveralOutputs
from sysid.models.lagged.cascade_program import Limit
from sysid.models.lagged.vector_recursion import VectorRecursion
from sysid.models.networks.narx import CLAMP, NARX
from sysid.models.networks.network_model import NetworkModel
from sysid.models.orders.activations import PLAIN, Activation
from sysid.models.orders.lags import Lags, LagSpec, is_one_set
from sysid.models.orders.output_limits import Between, parse_several, written
from sysid.models.orders.structure import AbstractStructure


@dataclass(frozen=True, kw_only=True)
class VectorNARX(AbstractStructure):
    """Delays and neurons of a network with several outputs.

    Every output is a function of the same neurons, and every neuron reads the past of all outputs: what one reservoir
    does to another within a sample is part of the network.

    Args:
        input_delays: Lags of the inputs, as in :class:`~sysid.models.NARX`.
        output_delays: Lags of the outputs in the same forms, from 1 on; one set for all, or a list of one per output.
        neurons: Number of neurons.
        feedthrough: A linear part from all regressors to the outputs beside the neurons.
        activation: The kind of the neurons, as in :class:`~sysid.models.NARX`.
        limits: Values between which outputs are held inside the recursion: by name, as ``{"position": [0, 300]}``, or
            ``found`` where the records show them; outputs that stand at no end are free.

    Raises:
        ConfigError: If a set of lags, the limits or the number of neurons cannot be used.

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
    activation: Activation = PLAIN
    limits: Any = None

    kind = "VectorNARX"
    learns_curves = True
    several_outputs = True

    def __init__(
        self,
        *,
        input_delays: LagSpec | Iterable[LagSpec],
        output_delays: LagSpec | Iterable[LagSpec],
        neurons: int,
        feedthrough: bool = True,
        activation: str = PLAIN,
        limits: Any = None,
    ) -> None:
        sets: list[Any] = (
            [output_delays] if is_one_set(output_delays) else [*cast("Iterable[LagSpec]", output_delays)] or [()]
        )
        # Each set goes through the structure of one output, which checks it and the neurons.
        parts = [
            NARX(
                input_delays=input_delays,
                output_delays=one,
                neurons=neurons,
                feedthrough=feedthrough,
                activation=activation,
            )
            for one in sets
        ]
        object.__setattr__(self, "input_delays", parts[0].input_delays)
        object.__setattr__(self, "output_delays", tuple(part.output_delays for part in parts))
        object.__setattr__(self, "neurons", neurons)
        object.__setattr__(self, "feedthrough", feedthrough)
        object.__setattr__(self, "activation", activation)
        object.__setattr__(self, "limits", parse_several(limits))

    @property
    def label(self) -> str:
        """Delays and neurons, as the label of a network with one output."""
        labels = dict.fromkeys(
            NARX(input_delays=self.input_delays, output_delays=one, neurons=self.neurons).label.split(" ")[1]
            for one in self.output_delays
        )
        word = f" {self.activation}" * (self.activation != PLAIN)
        if self.limits:
            found = isinstance(self.limits, str)
            word += f" limits {self.limits if found else ', '.join(f'{n} {written(b)}' for n, b in self.limits)}"
        return f"{self.kind} {', '.join(labels)}{word}"

    def resized(self, neurons: int) -> VectorNARX:
        """The same structure with another number of neurons."""
        return replace(self, neurons=neurons)

    def check_inputs(self, n_inputs: int) -> None:
        """Refuse sets of input delays that are not one per input; see the base class."""
        self._sets("input", self.input_delays, n_inputs)

    def check_outputs(self, n_outputs: int) -> None:
        """Refuse sets of output delays that are not one per output; see the base class."""
        self._sets("output", self.output_delays, n_outputs)

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
        inputs = self._sets("input", self.input_delays, n_inputs)
        return Lags(inputs=(*inputs, *self._sets("output", self.output_delays, n_outputs)), output=())

    @staticmethod
    def _sets(what: str, given: tuple[tuple[int, ...], ...], n: int) -> tuple[tuple[int, ...], ...]:
        if len(given) not in {1, n}:
            raise ConfigError(
                f"the sets of {what} delays do not match the {what}s",
                where=f"{what}_delays",
                expected=f"one set, or {n}: one per {what}",
                got=f"{len(given)} sets",
                remedy=f"give each {what} its own list, or one list for all",
            )
        return given * n if len(given) == 1 else given

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
            **({"activation": self.activation} if self.activation != PLAIN else {}),
            **({"limits": self.limits if isinstance(self.limits, str) else self._sides()} if self.limits else {}),
        }

    def _sides(self) -> dict[str, list[float | None]]:
        return {name: list(sides) for name, sides in self.limits}


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorNARXModel(NetworkModel, SeveralOutputs):
    r"""A fitted network with several outputs.

    In scaled numbers :math:`\hat y_t = \mathrm{clip}(w x_t + c + V\,\sigma(W x_t + b))` with one row of :math:`w` and
    :math:`V` for each output, and the past of all outputs in :math:`x_t`.

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
        between: Limits between which each output is held, in its unit; empty where none is.

    Raises:
        TraceError: If the parameters do not fit the structure.
    """

    network: VectorNARX
    theta: NDArray[np.float64]
    scaling: VectorScaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]
    clamp: float = CLAMP
    between: tuple[Between, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "between", tuple(tuple(sides) for sides in self.between))
        for name in ("output_units", "rest_outputs"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        count = self.network.parameter_count(len(self.mapping.inputs), len(self.mapping.outputs))
        if self.theta.shape != (count,):
            raise TraceError(
                "the parameter vector does not fit the structure",
                expected=f"{count} parameters",
                got=f"shape {self.theta.shape}",
                remedy="use parameters that were fitted with this structure",
            )

    @property
    def structure(self) -> VectorNARX:
        """Delays and neurons."""
        return self.network

    @property
    def lags(self) -> Lags:
        """The regressors over inputs and outputs."""
        return self.network.lags(len(self.mapping.inputs), len(self.mapping.outputs))

    @property
    def limits(self) -> Dict[str, Limit]:
        """What holds its outputs, as a cascade has it."""
        sides = zip(self.mapping.outputs, self.between, strict=False)
        return {name: Limit(low=low, high=high) for name, (low, high) in sides if (low, high) != (None, None)}

    @cached_property
    def recursion(self) -> VectorRecursion:
        """The form that is run and exported."""
        return VectorRecursion(
            lags=self.lags,
            n_outputs=len(self.mapping.outputs),
            neurons=self.network.neurons,
            theta=self.theta,
            linear=self.network.feedthrough,
            scaling=self.scaling,
            low=-self.clamp,
            high=self.clamp,
            between=self.between,
            activation=self.network.activation,
        )

    def output_moves(
        self,
        factor: NDArray[np.float64],
        inputs: NDArray[np.float64],
        history: History,
        measured: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """How the outputs move with the weights, by differences; see the base class."""

        def run(theta: NDArray[np.float64]) -> NDArray[np.float64]:
            moved = replace(self.recursion, theta=theta)
            if measured is None:
                return moved.simulate(inputs, history)
            return moved.predict(inputs, measured, history, 1)

        return moves_of(run, self.theta, factor, (len(inputs), len(self.mapping.outputs)))

    def _written(self) -> dict[str, Any]:
        return super()._written() | ({"between": [list(sides) for sides in self.between]} if self.limits else {})

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        between = tuple(tuple(sides) for sides in fields.get("between", ()))
        return NetworkModel._read(fields) | {"between": between}
