"""A state space as exporters see it, linear or with neurons beside the matrices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sysid.kernels.neurons import NEURONS, Neuron
from sysid.models import History, NeuralEnsemble, NeuralForm, Scaling, StateSpace, VectorScaling
from sysid.models.channels.ends import Ends
from sysid.models.orders.activations import PLAIN


@dataclass(frozen=True, kw_only=True, eq=False)
class Neurons:
    """A layer beside a matrix: ``V s(W z + b)``.

    Args:
        weights: ``W``, shape ``(n_neurons, n_states + n_inputs)``.
        bias: ``b``, shape ``(n_neurons,)``.
        readout: ``V``, shape ``(n_rows, n_neurons)``.
    """

    weights: NDArray[np.float64]
    bias: NDArray[np.float64]
    readout: NDArray[np.float64]

    def __len__(self) -> int:
        """How many there are."""
        return len(self.bias)


@dataclass(frozen=True, kw_only=True, eq=False)
class StateSpaceForm:
    r"""``x(t+1) = clip(x + T z + d + V s(W z + b))``, ``y = clip(r(C z + c + v s(Wy z + by)))`` with ``z = [x; u]``.

    All in scaled numbers.

    Args:
        ends: Names, units and values at rest of what goes in and comes out.
        lowered: What the model runs.
        change: ``T``, what a step adds to the state, shape ``(n_states, n_states + n_inputs)``: a slow mode is nearly
            an integrator, so that ``A - 1`` is kept and not ``A``.
        drift: ``d``, shape ``(n_states,)``.
        readout: ``C``, shape ``(n_outputs, n_states + n_inputs)``.
        constant: ``c``, shape ``(n_outputs,)``.
        state_neurons: Those of the state.
        output_neurons: Those of the output.
        neuron: ``s``.
        rectified: ``r`` is the absolute value; the identity otherwise.
        bound: Bound of each state; ``inf`` for none.
        gain: From scaled channels at rest to the state, shape ``(n_states, n_channels)``; the channels are the inputs,
            and the outputs where the state at rest depends on them.
        rest: The state at rest where these are zero, shape ``(n_states,)``.
    """

    ends: Ends
    lowered: StateSpace | NeuralForm
    change: NDArray[np.float64]
    drift: NDArray[np.float64]
    readout: NDArray[np.float64]
    constant: NDArray[np.float64]
    state_neurons: Neurons
    output_neurons: Neurons
    neuron: Neuron
    rectified: bool
    bound: float
    gain: NDArray[np.float64]
    rest: NDArray[np.float64]

    @classmethod
    def linear(cls, lowered: StateSpace, ends: Ends) -> StateSpaceForm:
        """A linear state space: no neurons, no bound."""
        n, row = lowered.n_state, lowered.n_state + lowered.n_inputs
        p = lowered.n_outputs
        none, silent = np.zeros(lowered.n_inputs), np.zeros(p)
        rest = lowered.resting(none, silent)
        gain = [lowered.resting(unit, silent) - rest for unit in np.eye(lowered.n_inputs)]
        by_output = [lowered.resting(none, unit) - rest for unit in np.eye(p)]
        gain += by_output if np.any(by_output) else []
        return cls(
            ends=ends,
            lowered=lowered,
            change=np.concatenate([lowered.A - np.eye(n), lowered.B], axis=1),
            drift=np.zeros(n),
            readout=np.concatenate([lowered.C, lowered.D], axis=1),
            constant=lowered.constant,
            state_neurons=Neurons(weights=np.zeros((0, row)), bias=np.zeros(0), readout=np.zeros((n, 0))),
            output_neurons=Neurons(weights=np.zeros((0, row)), bias=np.zeros(0), readout=np.zeros((p, 0))),
            neuron=NEURONS[PLAIN],
            rectified=False,
            bound=np.inf,
            gain=np.column_stack(gain) if gain else np.zeros((n, 0)),
            rest=rest,
        )

    @classmethod
    def neural(cls, lowered: NeuralForm, ends: Ends) -> StateSpaceForm:
        """A neural state space."""
        sizes, theta = lowered.sizes, lowered.theta
        n, k, q, row = sizes.states, sizes.neurons, sizes.output_neurons, sizes.row
        M, W, Wy = (theta[part].reshape(-1, row) for part in (sizes.linear, sizes.hidden, sizes.output_hidden))
        L, E = theta[sizes.output_linear].reshape(-1, row), theta[sizes.start].reshape(n, -1)
        change = M[:, :-1].copy()
        change[:, :n] -= np.eye(n)
        return cls(
            ends=ends,
            lowered=lowered,
            change=change,
            drift=M[:, -1],
            readout=L[:, :-1],
            constant=L[:, -1],
            state_neurons=Neurons(weights=W[:, :-1], bias=W[:, -1], readout=theta[sizes.readout].reshape(n, k)),
            output_neurons=Neurons(
                weights=Wy[:, :-1], bias=Wy[:, -1], readout=theta[sizes.output_readout].reshape(len(L), q)
            ),
            neuron=NEURONS[lowered.activation],
            rectified=lowered.rectified,
            bound=lowered.bound,
            gain=E[:, :-1],
            rest=E[:, -1],
        )

    @classmethod
    def ensemble(cls, lowered: NeuralEnsemble, ends: Ends) -> StateSpaceForm:
        """Several neural state spaces as one, whose state after a history the members find by themselves."""
        return replace(cls.neural(lowered.joined, ends), lowered=lowered)

    @property
    def scaling(self) -> Scaling | VectorScaling:
        """Between units and scaled numbers."""
        return self.lowered.scaling

    @property
    def n_state(self) -> int:
        """Length of the state."""
        return len(self.drift)

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.ends.inputs)

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.constant)

    @property
    def offset(self) -> tuple[float, ...]:
        """Of every input, then of every output, in its unit."""
        return (*self.scaling.input_offset, *_each(self.scaling.output_offset))

    @property
    def scale(self) -> tuple[float, ...]:
        """Of every input, then of every output, in its unit."""
        return (*self.scaling.input_scale, *_each(self.scaling.output_scale))

    @property
    def low(self) -> float:
        """Lower bound of the output in scaled numbers."""
        return self.lowered.low

    @property
    def high(self) -> float:
        """Upper bound of the output in scaled numbers."""
        return self.lowered.high

    def rest_of(self, levels: NDArray[np.float64]) -> float | NDArray[np.float64]:
        """The levels of the outputs, shape ``(n_outputs,)``, as a history has them."""
        return levels if isinstance(self.scaling, VectorScaling) else float(levels[0])

    @property
    def rest_channels(self) -> tuple[str, ...]:
        """The channels that ``gain`` takes."""
        return (*self.ends.inputs, *self.ends.outputs)[: self.gain.shape[1]]

    def from_history(self, history: History) -> NDArray[np.float64]:
        """The state after some samples.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(n_states,)``.
        """
        return self.lowered.state(history)


def _each(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)
