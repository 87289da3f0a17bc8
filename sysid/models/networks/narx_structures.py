"""NARX: one layer of neurons, and a linear part beside it, over past inputs and past outputs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Any, cast

from sysid.errors import ConfigError, shortened
from sysid.models.orders.activations import PLAIN, Activation, check_activation
from sysid.models.orders.lags import (
    MOST,
    Lagged,
    Lags,
    LagSpec,
    check_reads,
    is_one_set,
    parse_lags,
    parse_output_lags,
    whole,
)
from sysid.models.orders.output_limits import FOUND, parse_limits, parse_several, written
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure


@dataclass(frozen=True, kw_only=True)
class NARX(AbstractStructure):
    """Delays and neurons of a NARX network, as in MATLAB's ``narxnet``.

    Args:
        input_delays: Lags of every input: ``4`` for 1 to 4, ``"0:3"`` for a range, ``[0, 1, 2, 4]`` for a set; ``[]``
            for a record without input (NAR).
            Lag 0 is the direct input x(n). One such entry per input, in a list of lists, sets them apart.
        output_delays: Lags of the output, in the same forms, from 1 on; ``[]`` for a network that reads inputs alone
            (NFIR, MATLAB's ``timedelaynet``; a curve where the inputs' only lag is 0).
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
        >>> NARX(input_delays="0:3", output_delays=[], neurons=6).label
        'NFIR 0:3/6'
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
        object.__setattr__(self, "output_delays", parse_output_lags(output_delays))
        object.__setattr__(self, "neurons", neurons)
        object.__setattr__(self, "feedthrough", feedthrough)
        object.__setattr__(self, "gated", gated)
        object.__setattr__(self, "activation", activation)
        object.__setattr__(self, "limits", parse_limits(limits))
        check_activation(activation)
        check_reads(self.input_delays, self.output_delays)
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
        if not self.output_delays:
            return f"NFIR {inputs}/{self.neurons}{kind}"
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
        check_reads(inputs, self.output_delays)
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

    def for_outputs(self, n_outputs: int) -> NARX | VectorNARX:
        """One network for all outputs, where there are several: each reads the past of all, as in ``narxnet``.

        Gates, and limits that are given for one output, are for a network an output.
        """
        if n_outputs == 1 or self.gated or self.limits not in (None, FOUND):
            return self
        fields = self.to_dict()
        del fields["kind"]
        return VectorNARX(**fields)

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


@dataclass(frozen=True, kw_only=True)
class VectorNARX(AbstractStructure):
    """Delays and neurons of a network with several outputs.

    Every output is a function of the same neurons, and every neuron reads the past of all outputs: what one reservoir
    does to another within a sample is part of the network.

    Args:
        input_delays: Lags of the inputs, as in :class:`~sysid.models.NARX`.
        output_delays: Lags of the outputs in the same forms, from 1 on; one set for all, or a list of one per output;
            ``[]`` for none.
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
        outputs = self._sets("output", self.output_delays, n_outputs)
        check_reads((*inputs, *outputs), ())
        return Lags(inputs=(*inputs, *outputs), output=())

    def lagged(self, n_inputs: int) -> Lagged:
        """Neurons over its regressors, each set of output delays a channel like the inputs."""
        inputs = self._sets("input", self.input_delays, n_inputs)
        return Lagged(
            lags=Lags(inputs=(*inputs, *self.output_delays), output=()),
            neurons=self.neurons,
            linear=self.feedthrough,
            activation=self.activation,
        )

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
