"""NARX: one layer of neurons, and a linear part beside it, over past inputs and past outputs."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling
from sysid.models.lagged.cascade_program import Limit
from sysid.models.lagged.recursion import Recursion
from sysid.models.networks.network_model import NetworkModel
from sysid.models.orders.activations import PLAIN, Activation, check_activation
from sysid.models.orders.lags import MOST, Lagged, Lags, LagSpec, is_one_set, parse_lags, whole
from sysid.models.orders.output_limits import Between, parse_limits, written
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure

CLAMP = 3.0
"""Bound of the output in scaled numbers. Training data lie within -1 to 1; a free run that leaves three times
that range is lost, and the bound keeps it finite, in training and wherever the model runs later."""


@dataclass(frozen=True, kw_only=True)
class NARX(AbstractStructure):
    """Delays and neurons of a NARX network, as in MATLAB's ``narxnet``.

    Args:
        input_delays: Lags of every input: ``4`` for 1 to 4, ``"0:3"`` for a range, ``[0, 1, 2, 4]`` for a set; ``[]``
            for a record without input (NAR).
            Lag 0 is the direct input x(n). One such entry per input, in a list of lists, sets them apart.
        output_delays: Lags of the output, in the same forms, from 1 on.
        neurons: Number of neurons.
        feedthrough: A linear part from all regressors to the output beside the neurons.
        gated: Each neuron is a gate: what it adds is not a constant but a linear function of the regressors times what
            it puts out. For flows through valves, whose rate is a product; about twice the parameters for the same
            neurons.
        activation: The kind of the neurons: ``tanh``, which saturates, or another of
            :data:`sysid.kernels.neurons.NEURONS`.
        limits: Values between which the output is held inside the recursion, in its unit: ``[low, high]``, or ``found``
            where the records show them. For what integrates until it meets an end: a cylinder, a tank, a charge.

    Raises:
        ConfigError: If a set of lags, the number of neurons or the limits cannot be used.

    Example:
        >>> NARX(input_delays=4, output_delays=4, neurons=20).label
        'NARX 4/4/20'
        >>> NARX(input_delays=[[0, 1], [1, 2, 4]], output_delays="1:2", neurons=5).lags(2).n_regressors
        7
        >>> NARX(input_delays="0:1", output_delays=1, neurons=12, gated=True).label
        'NARX 0:1/1/12 gated'
    """

    input_delays: Annotated[tuple[tuple[int, ...], ...], IntRange(low=1, high=5)]
    output_delays: Annotated[tuple[int, ...], IntRange(low=1, high=5)]
    neurons: Annotated[int, IntRange(low=1, high=20)]
    feedthrough: bool = True
    gated: bool = False
    activation: Activation = PLAIN
    limits: Any = None

    kind = "NARX"
    learns_curves = True

    def __init__(
        self,
        *,
        input_delays: LagSpec | Iterable[LagSpec],
        output_delays: LagSpec,
        neurons: int,
        feedthrough: bool = True,
        gated: bool = False,
        activation: str = PLAIN,
        limits: Any = None,
    ) -> None:
        object.__setattr__(self, "input_delays", _per_input(input_delays))
        object.__setattr__(self, "output_delays", parse_lags(output_delays, first=1, where="output_delays"))
        object.__setattr__(self, "neurons", neurons)
        object.__setattr__(self, "feedthrough", feedthrough)
        object.__setattr__(self, "gated", gated)
        object.__setattr__(self, "activation", activation)
        object.__setattr__(self, "limits", parse_limits(limits))
        check_activation(activation)
        if not whole(neurons) or (neurons == 0 and not feedthrough):
            raise ConfigError(
                "not a number of neurons",
                where="neurons",
                expected=f"a whole number from 1 to {MOST:,}, or 0 with feedthrough",
                got=shortened(neurons),
                remedy="write for example neurons: 20",
            )
        if gated and not (feedthrough and neurons):
            raise ConfigError(
                "gates stand beside a linear part",
                where="gated",
                expected="at least one neuron, and feedthrough",
                got=f"{neurons} neurons, feedthrough {feedthrough}",
                remedy="leave feedthrough out: it is on by default",
            )

    @property
    def label(self) -> str:
        """Delays and neurons as ``NARX 4/4/20``; other lag sets are written out by their ends and number."""
        kind = " gated" * self.gated + f" {self.activation}" * (self.activation != PLAIN)
        kind += f" limits {written(self.limits)}" if self.limits else ""
        if not self.input_delays:
            return f"NAR {_short(self.output_delays)}/{self.neurons}{kind}"
        distinct = dict.fromkeys(self.input_delays)
        inputs = ",".join(_short(lags) for lags in distinct)
        return f"NARX {inputs}/{_short(self.output_delays)}/{self.neurons}{kind}"

    def lags(self, n_inputs: int) -> Lags:
        """The regressors for a number of inputs.

        Args:
            n_inputs: Inputs of the mapping.

        Returns:
            The regressors; one set of input delays serves every input.

        Raises:
            ConfigError: If several sets are given and their number is not that of the inputs.
        """
        if len(self.input_delays) not in {1, n_inputs}:
            raise ConfigError(
                "the sets of input delays do not match the inputs",
                where="input_delays",
                expected=f"one set, or {n_inputs}: one per input",
                got=f"{len(self.input_delays)} sets",
                remedy="give each input its own list, or one list for all",
            )
        inputs = self.input_delays * n_inputs if len(self.input_delays) == 1 else self.input_delays
        return Lags(inputs=inputs, output=self.output_delays)

    def lagged(self, n_inputs: int) -> Lagged:
        """Neurons over its regressors, with or without a linear part and gates."""
        return Lagged(
            lags=self.lags(n_inputs),
            neurons=self.neurons,
            linear=self.feedthrough,
            gated=self.gated,
            activation=self.activation,
        )

    def resized(self, neurons: int) -> NARX:
        """The same delays with another number of neurons; 0 leave the linear part."""
        return replace(self, neurons=neurons, gated=self.gated and neurons > 0)

    def check_inputs(self, n_inputs: int) -> None:
        """Refuse as many sets of input delays as are neither one nor one per input."""
        self.lags(n_inputs)

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "kind": self.kind,
            "input_delays": [list(lags) for lags in self.input_delays],
            "output_delays": list(self.output_delays),
            "neurons": self.neurons,
            "feedthrough": self.feedthrough,
            # Absent where they are the plain ones, so that older files keep their digest.
            **({"gated": True} if self.gated else {}),
            **({"activation": self.activation} if self.activation != PLAIN else {}),
            **({"limits": self.limits if isinstance(self.limits, str) else list(self.limits)} if self.limits else {}),
        }


def _per_input(spec: LagSpec | Iterable[LagSpec]) -> tuple[tuple[int, ...], ...]:
    if is_one_set(spec):
        return (parse_lags(cast("LagSpec", spec), first=0, where="input_delays"),)
    sets = cast("Iterable[LagSpec]", spec)
    return tuple(parse_lags(entry, first=0, where=f"input_delays, input {i + 1}") for i, entry in enumerate(sets))


def _short(lags: tuple[int, ...]) -> str:
    if lags == tuple(range(1, len(lags) + 1)):
        return str(len(lags))
    if lags == tuple(range(lags[0], lags[-1] + 1)):
        return f"{lags[0]}:{lags[-1]}"
    return f"{lags[0]}..{lags[-1]}({len(lags)})"


@dataclass(frozen=True, kw_only=True, eq=False)
class NARXModel(NetworkModel):
    """A fitted NARX network.

    Args:
        network: The structure.
        theta: Flat parameters ``[W | b | v | c | w | V]`` in scaled numbers (see :class:`Recursion`).
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
        clamp: Bound of the output in scaled numbers; infinite for none.
        between: Limits between which it is held, in its unit.
    """

    network: NARX
    theta: NDArray[np.float64]
    scaling: Scaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    rest_output: float
    clamp: float = CLAMP
    between: Between = (None, None)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "between", tuple(self.between))

    @property
    def structure(self) -> NARX:
        """Delays and neurons."""
        return self.network

    @property
    def limits(self) -> Dict[str, Limit]:
        """What holds its output, as a cascade has it."""
        low, high = self.between
        return {} if low is None and high is None else {self.mapping.output: Limit(low=low, high=high)}

    @property
    def recursion(self) -> Recursion:
        """The form that is run and exported."""
        return Recursion(
            lags=self.network.lags(len(self.mapping.inputs)),
            neurons=self.network.neurons,
            theta=self.theta,
            scaling=self.scaling,
            low=-self.clamp,
            high=self.clamp,
            between=self.between,
            activation=self.network.activation,
        )

    def _written(self) -> dict[str, Any]:
        return super()._written() | ({"between": list(self.between)} if self.limits else {})

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return NetworkModel._read(fields) | {"between": tuple(fields.get("between", (None, None)))}
