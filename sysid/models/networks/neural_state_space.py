"""Neural state space: a linear state space with neurons beside it, for systems that remember more than lags hold."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from dataclasses import fields as dataclass_fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.channels.history import History
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling, VectorScaling
from sysid.models.contract.moves import moves_of
from sysid.models.contract.several_outputs import SeveralOutputs
from sysid.models.networks.narx import CLAMP
from sysid.models.networks.network_model import NetworkModel
from sysid.models.networks.neural_ensemble import NeuralEnsemble, check_shares
from sysid.models.networks.neural_form import NeuralForm
from sysid.models.networks.neural_sizes import Sizes
from sysid.models.orders.activations import PLAIN, Activation, check_activation
from sysid.models.orders.lags import whole
from sysid.models.orders.structure import AbstractStructure

OUTPUTS = ("plain", "absolute")
MOST_UNITS = 1_000
"""States or neurons: their product is a matrix."""


@dataclass(frozen=True, kw_only=True)
class NeuralStateSpace(AbstractStructure):
    """Hidden states and neurons of ``x(t+1) = A x + B u + f(x, u)``, ``y = C x + D u + g(x, u)``.

    Args:
        states: Number of hidden states.
        neurons: Neurons in ``f``; 0 for a linear state equation.
        output_neurons: Neurons in ``g``; 0 for a linear output.
        activation: The kind of the neurons: ``tanh``, which saturates, ``cubic``, which goes on growing beyond the
            training range as springs do that stiffen, or another of :data:`sysid.kernels.neurons.NEURONS`.
        output: ``plain``, or ``absolute`` for a sensor that cannot tell a sign.
        integrators: The last so many states are sums, exactly: ``x(t+1) = x(t) + a z + b u + c``, where ``z`` are the
            states before it. Nothing else reads a sum but the outputs, so that the plant is the same wherever it
            stands. Neurons feed the other states; where there are none, the first sum.
        integrators_seen: Neurons read the sums too: friction or a load that depends on the place. No linear term does,
            so that bounded neurons let nothing run away.
        linear_inputs: Neurons do not read the inputs, which act in proportion however large: a force, a flow.
        directions: Neurons read so many learnt combinations of states and inputs, and move the states in so many ways:
            the linear fractional form of a linear plant with a static nonlinearity in it. In any by default.

    Raises:
        ConfigError: If a number or a name cannot be used.

    Example:
        >>> NeuralStateSpace(states=2, neurons=10).label
        'NSS 2/10'
    """

    states: int
    neurons: int
    output_neurons: int = 0
    activation: Activation = PLAIN
    output: str = "plain"
    integrators: int = 0
    integrators_seen: bool = False
    linear_inputs: bool = False
    directions: int | None = None

    acts_at_once = True
    kind = "NSS"
    learns_curves = True
    learns_start = True

    def __post_init__(self) -> None:
        for name, least in (("states", 1), ("neurons", 0), ("output_neurons", 0)):
            value = getattr(self, name)
            if not whole(value) or not least <= value <= MOST_UNITS:
                raise ConfigError(
                    f"not a number of {name.replace('_', ' ')}",
                    where=name,
                    expected=f"a whole number from {least} to {MOST_UNITS:,}",
                    got=shortened(value),
                    remedy="write for example {kind: NSS, states: 2, neurons: 10}",
                )
        if not whole(self.integrators) or not 0 <= self.integrators <= self.states:
            raise ConfigError(
                "not a number of integrators",
                where="integrators",
                expected=f"a whole number from 0 to the number of states, {self.states}",
                got=shortened(self.integrators),
                remedy="write for example {kind: NSS, states: 2, neurons: 4, integrators: 1}",
            )
        if self.integrators_seen and not self.integrators:
            raise ConfigError(
                "there is no integrator to be seen",
                where="integrators_seen",
                expected="integrators: 1 or more beside it",
                got="integrators: 0",
                remedy="declare the integrators, or leave integrators_seen out",
            )
        if self.directions is not None and (not whole(self.directions) or not 1 <= self.directions <= MOST_UNITS):
            raise ConfigError(
                "not a number of directions",
                where="directions",
                expected=f"a whole number from 1 to {MOST_UNITS:,}, or nothing where neurons may read all",
                got=shortened(self.directions),
                remedy="write for example {kind: NSS, states: 4, neurons: 10, directions: 1}",
            )
        check_activation(self.activation)
        if self.output not in OUTPUTS:
            raise ConfigError(
                "unknown output",
                where="output",
                expected=" or ".join(OUTPUTS),
                got=shortened(self.output),
                remedy=f"write for example output: {OUTPUTS[0]}",
            )

    @property
    def label(self) -> str:
        """States and neurons as ``NSS 2/10``, with the output's neurons and what is not the default."""
        numbers = [self.states, self.neurons, *([self.output_neurons] if self.output_neurons else [])]
        words = [self.activation] * (self.activation != PLAIN) + [self.output] * (self.output != "plain")
        if self.integrators:
            many, seen = "s" * (self.integrators > 1), " seen" * self.integrators_seen
            words.append(f"{self.integrators} integrator{many}{seen}")
        words += ["linear inputs"] * self.linear_inputs
        if self.directions is not None:
            words.append(f"{self.directions} direction{'s' * (self.directions > 1)}")
        return " ".join([self.kind, "/".join(str(number) for number in numbers), *words])

    def for_outputs(self, n_outputs: int) -> NeuralStateSpace:
        """One state space for all outputs, where there are several: they share its states."""
        if n_outputs == 1 or self.several_outputs:
            return self
        return VectorNeuralStateSpace(**{field.name: getattr(self, field.name) for field in dataclass_fields(self)})

    def sizes(self, n_inputs: int, n_outputs: int = 1) -> Sizes:
        """Where the parameters stand for a number of inputs and outputs.

        Args:
            n_inputs: Inputs of the mapping.
            n_outputs: Outputs of the mapping.

        Returns:
            The sizes.
        """
        return Sizes(
            states=self.states,
            inputs=n_inputs,
            neurons=self.neurons,
            output_neurons=self.output_neurons,
            outputs=n_outputs,
            integrators=self.integrators,
            integrators_seen=self.integrators_seen,
            linear_inputs=self.linear_inputs,
            directions=self.directions,
        )

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {
            "kind": self.kind,
            "states": self.states,
            "neurons": self.neurons,
            "output_neurons": self.output_neurons,
            "activation": self.activation,
            "output": self.output,
            # Without any they keep their digest.
            **(
                {"integrators": self.integrators, "integrators_seen": self.integrators_seen} if self.integrators else {}
            ),
            **({"linear_inputs": True} if self.linear_inputs else {}),
            **({} if self.directions is None else {"directions": self.directions}),
        }


@dataclass(frozen=True, kw_only=True)
class VectorNeuralStateSpace(NeuralStateSpace):
    """A neural state space that all outputs of a mapping share; see :class:`NeuralStateSpace`.

    What one output says of the states is used for the others; neurons of the output equation are read by all of them.

    Example:
        >>> VectorNeuralStateSpace(states=4, neurons=10).label
        'VectorNSS 4/10'
    """

    kind = "VectorNSS"
    several_outputs = True


@dataclass(frozen=True, kw_only=True, eq=False)
class _NeuralModel(NetworkModel):
    """What neural state spaces of one output and of several have in common; both have the fields below."""

    network: NeuralStateSpace
    theta: NDArray[np.float64]
    scaling: Scaling | VectorScaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    clamp: float = CLAMP
    shares: tuple[int, ...] = (1,)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "shares", tuple(self.shares))
        check_shares(self.shares)

    @property
    def structure(self) -> NeuralStateSpace:
        """States and neurons."""
        return self.network

    @property
    def n_parameters(self) -> int:
        """Those that are fitted: what integrators hold is not among them."""
        return self.n_together * len(self.shares)

    @property
    def n_together(self) -> int:
        """Parameters of one member."""
        return self.network.sizes(len(self.mapping.inputs), len(self.mapping.outputs)).free

    @property
    def label(self) -> str:
        """The structure, and how many members an ensemble has."""
        n = len(self.shares)
        return self.network.label if n == 1 else f"{self.network.label}, mean of {n}"

    @property
    def recursion(self) -> NeuralForm:
        """The form that is run: that of an ensemble, where there are several members."""
        fields: dict[str, Any] = {
            "sizes": self.network.sizes(len(self.mapping.inputs), len(self.mapping.outputs)),
            "theta": self.theta,
            "scaling": self.scaling,
            "activation": self.network.activation,
            "rectified": self.network.output == "absolute",
            "low": -self.clamp,
            "high": self.clamp,
        }
        return NeuralEnsemble(**fields, shares=self.shares) if len(self.shares) > 1 else NeuralForm(**fields)

    def output_moves(
        self,
        factor: NDArray[np.float64],
        inputs: NDArray[np.float64],
        history: History,
        measured: NDArray[np.float64] | None = None,  # noqa: ARG002 - one step ahead nothing is predicted
    ) -> NDArray[np.float64]:
        """How the free run moves with the weights, by differences; see the base class.

        A state that is estimated from several samples stays where it is.
        """
        form = self.recursion
        scaled = form.scaled(inputs)
        known = form.state(history) if len(history.output) > 1 else None

        def run(theta: NDArray[np.float64]) -> NDArray[np.float64]:
            moved = replace(form, theta=theta)
            return moved.run(scaled, moved.state(history) if known is None else known.copy())

        found = moves_of(run, self.theta, factor, (len(inputs), form.sizes.outputs))
        found *= np.reshape(self.scaling.output_scale, (-1, 1))
        return found if self.structure.several_outputs else found[:, 0]

    def _written(self) -> dict[str, Any]:
        shares = {"shares": list(self.shares)} if len(self.shares) > 1 else {}  # single ones keep their digest
        return super()._written() | shares

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return NetworkModel._read(fields) | {"shares": tuple(fields.get("shares", (1,)))}


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralStateSpaceModel(_NeuralModel):
    """A fitted neural state space.

    Args:
        network: The structure.
        theta: Flat parameters in scaled numbers (see :class:`Sizes`), of an ensemble those of its members in turn.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
        clamp: Bound of the output in scaled numbers; infinite for none.
        shares: Of an ensemble, whose output is the mean of its members', the weight of each as a whole number; the
            structure is that of one member.
    """

    scaling: Scaling
    output_unit: str
    rest_output: float


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorNeuralStateSpaceModel(_NeuralModel, SeveralOutputs):
    """A fitted neural state space of several outputs.

    Args:
        network: The structure.
        theta: Flat parameters in scaled numbers (see :class:`Sizes`), of an ensemble those of its members in turn.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which come out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_units: Unit of each output.
        rest_outputs: Each output at rest, in its unit.
        clamp: Bound of the outputs in scaled numbers; infinite for none.
        shares: As for one output.
    """

    network: VectorNeuralStateSpace
    scaling: VectorScaling
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]
