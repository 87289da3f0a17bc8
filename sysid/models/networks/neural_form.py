"""The form that a neural state space lowers to: sizes, flat parameters, free run, and the state after a history."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.kernels import neural_state_space as kernel
from sysid.kernels.arrays import read_only
from sysid.kernels.neurons import code_of
from sysid.models.channels.history import History, fitting_columns
from sysid.models.channels.scaling import Scaling, VectorScaling
from sysid.models.contract.form import AbstractForm, no_prediction
from sysid.models.contract.state_descent import StateSearch
from sysid.models.networks.neural_sizes import Sizes
from sysid.models.orders.activations import PLAIN

STATE_BOUND = 10.0
"""Bound of each state. Fits scale the states to -1 to 1 over their records; ten times that is lost, and the bound
keeps a free run finite."""

MOST_SIGNED = 4
"""Outputs whose signs are tried in all ways where a sensor cannot tell them; of more, all with the same sign."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Scaled inputs and outputs of a history, and which samples are not masked."""

    inputs: NDArray[np.float64]
    output: NDArray[np.float64]
    known: NDArray[np.bool_]

    @classmethod
    def of(cls, scaled: NDArray[np.float64], output: NDArray[np.float64], known: NDArray[np.bool_] | None) -> Seen:
        """Samples, all of which are known by default."""
        return cls(scaled, output, np.ones(len(output), dtype=np.bool_) if known is None else known)


@dataclass(frozen=True, kw_only=True, eq=False)
class NeuralForm(AbstractForm):
    r"""``x(t+1) = M z + V s(W z)``, ``y(t) = L z + v s(Wy z)`` with ``z = [x; u; 1]``, in scaled numbers.

    There may be several outputs, which share the states and the output's neurons.

    A history gives the state thus: its oldest sample is a system that has stood there (``E``); where it holds more
    samples, the state :math:`x_0` there minimises :math:`|\hat y(x_0) - y|^2/\sigma^2 + |x_0 - E z_0|^2` over the
    history, :math:`\sigma` being what is left of the output there, and the model runs on through it.

    Args:
        sizes: States, inputs, neurons.
        theta: Flat parameters.
        scaling: Between units and scaled numbers; one of several outputs makes arrays of outputs have columns.
        activation: The kind of its neurons.
        rectified: The outputs are absolute values.
        bound: Bound of each state.
        low: Lower bound of the outputs in scaled numbers.
        high: Upper bound of the outputs in scaled numbers.
    """

    sizes: Sizes
    theta: NDArray[np.float64]
    scaling: Scaling | VectorScaling
    activation: str = PLAIN
    rectified: bool = False
    bound: float = STATE_BOUND
    low: float = -np.inf
    high: float = np.inf
    predicts: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        theta = np.array(self.theta, dtype=np.float64)
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)
        if theta.shape != (self._count,):
            raise TraceError(
                "the parameter vector does not fit the structure",
                expected=f"{self._count} parameters",
                got=f"shape {theta.shape}",
                remedy="use parameters that were fitted with this structure",
            )

    @property
    def _count(self) -> int:
        """Number of parameters."""
        return self.sizes.count

    @property
    def numbers(self) -> NDArray[np.float64]:
        """The flat parameters."""
        return self.theta

    @property
    def memory(self) -> int:
        """Twice as many samples as states, and one more."""
        return 2 * self.sizes.states + 1

    def simulate(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """Free run; see the base class."""
        scaled = self.scaled(inputs)
        return self.scaling.unscale_columns(self.run(scaled, self.state(history)))

    def predict(
        self,
        inputs: NDArray[np.float64],  # noqa: ARG002 - nothing is predicted from any of them
        output: NDArray[np.float64],  # noqa: ARG002
        history: History,  # noqa: ARG002
        steps: int,  # noqa: ARG002
    ) -> NDArray[np.float64]:
        """None: the noise is added to the output, and says nothing about the next; see the base class."""
        raise no_prediction("a neural state space")

    def state(self, history: History) -> NDArray[np.float64]:
        """The state after some samples.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(n_states,)``.
        """
        x = self._begun(history)
        if len(history.output) > 1:
            self.run(self.scaled(history.inputs), x)
        return x

    def followed(self, history: History) -> NDArray[np.float64]:
        """The free run over a history itself; see the base class."""
        return self.scaling.unscale_columns(self.run(self.scaled(history.inputs), self._begun(history)))

    def _begun(self, history: History) -> NDArray[np.float64]:
        """The state before the oldest sample of a history; of a single one, the state after it."""
        scaled, output = self.scaled(history.inputs), self.scaled_outputs(history.output)
        x = self.resting(scaled[0], output[0])
        return x if len(output) == 1 else self.corrected(scaled, output, x, history.known)

    def resting(self, inputs: NDArray[np.float64], output: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state of a system that has stood at these scaled values, by the map ``E``.

        Args:
            inputs: Scaled inputs, shape ``(n_inputs,)``.
            output: Scaled outputs, shape ``(n_outputs,)``.

        Returns:
            Shape ``(n_states,)``.
        """
        E = self.theta[self.sizes.start].reshape(self.sizes.states, -1)
        return np.asarray(np.clip(E @ np.concatenate([inputs, output, [1.0]]), -self.bound, self.bound))

    def corrected(
        self,
        scaled: NDArray[np.float64],
        output: NDArray[np.float64],
        x: NDArray[np.float64],
        known: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """The state before some samples that their output shows, near the one expected.

        Args:
            scaled: Scaled inputs, shape ``(n_samples, n_inputs)``.
            output: Scaled outputs, shape ``(n_samples, n_outputs)``.
            x: State expected, shape ``(n_states,)``.
            known: Which outputs are not masked, shape ``(n_samples,)``; all by default.

        Returns:
            Shape ``(n_states,)``.
        """
        seen = Seen.of(scaled, output, known)
        # From what is expected the output may not show the way: descents begin all around.
        around = [x, np.clip(x, -1.0, 1.0), np.zeros(len(x)), *np.eye(len(x)), *-np.eye(len(x))]
        if self.rectified:
            # Across the kink of an absolute value no descent leads. With either sign given there is no kink.
            around += [self.descended_with(signs, seen, x) for signs in self.all_signs]
        return self.search(seen, x).found(around)

    @property
    def all_signs(self) -> list[tuple[float, ...]]:
        """Signs that outputs may have which a rectified output hides."""
        n = self.sizes.outputs
        return list(product((1.0, -1.0), repeat=n if n <= MOST_SIGNED else 1))

    def descended_with(
        self, signs: tuple[float, ...], seen: Seen, expected: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The state before some samples of a rectified output, if the outputs had these signs.

        Args:
            signs: Of the outputs.
            seen: The samples.
            expected: State expected, shape ``(n_states,)``.

        Returns:
            Shape ``(n_states,)``.
        """
        signed = replace(self, rectified=False, low=-np.inf, high=np.inf)
        wanted = replace(seen, output=np.array(signs) * seen.output)
        return signed.search(wanted, expected).descended(expected)

    def search(self, seen: Seen, expected: NDArray[np.float64]) -> StateSearch:
        """The search for the state before some samples.

        Args:
            seen: The samples.
            expected: State expected, shape ``(n_states,)``.

        Returns:
            The search, without bounds.
        """
        n, far = len(expected), np.full(len(expected), np.inf)
        known = slice(None) if seen.known.all() else seen.known

        def misfit(x: NDArray[np.float64], moving: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            away = (self.run(seen.inputs, x.copy()) - seen.output)[known].ravel()
            return away, self._linearised(seen.inputs, x)[known].reshape(-1, n) if moving else away

        return StateSearch(misfit=misfit, low=-far, high=far, expected=expected)

    def run(self, scaled: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled outputs over some scaled inputs; ``x`` becomes the state after them.

        Args:
            scaled: Scaled inputs, shape ``(n_samples, n_inputs)``.
            x: State before the first sample, shape ``(n_states,)``; overwritten.

        Returns:
            Shape ``(n_samples, n_outputs)``.
        """
        y = np.empty((len(scaled), self.sizes.outputs))
        kernel.free_run(scaled, x, *self.arguments(self.theta), y)
        return y

    def path(self, scaled: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """The states that a run visits: those before each sample.

        Args:
            scaled: Scaled inputs, shape ``(n_samples, n_inputs)``.
            x: State before the first sample, shape ``(n_states,)``; becomes the state after the last.

        Returns:
            Shape ``(n_samples, n_states)``.
        """
        s = self.sizes
        states = np.empty((len(scaled), s.states))
        # The run of a model whose outputs are its states.
        own = np.concatenate([self.theta[s.dynamic], np.eye(s.states, s.row).ravel()])
        kind = code_of(self.activation)
        kernel.free_run(scaled, x, read_only(own), s.neurons, 0, kind, False, self.bound, -np.inf, np.inf, states)
        return states

    def arguments(self, theta: NDArray[np.float64]) -> tuple[object, ...]:
        """What the kernels take between the state and the output.

        Args:
            theta: Parameters, at least those of both equations.

        Returns:
            Parameters, sizes, flags and bounds.
        """
        s = self.sizes
        kind = code_of(self.activation)
        return (read_only(theta), s.neurons, s.output_neurons, kind, self.rectified, self.bound, self.low, self.high)

    def scaled(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Inputs in the model's numbers.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.

        Returns:
            The same shape.

        Raises:
            TraceError: If the number of inputs is not the model's.
        """
        return self.scaling.scale_inputs(fitting_columns(inputs, self.sizes.inputs))

    def scaled_outputs(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs in the model's numbers.

        Args:
            output: As a history has them, in their units.

        Returns:
            Shape ``(n_samples, n_outputs)``.
        """
        return np.asarray(self.scaling.scale_output(output)).reshape(len(output), self.sizes.outputs)

    def _linearised(self, scaled: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivative of the outputs by the state before the first sample: ``(n_samples, n_outputs, n_states)``."""
        n, dynamic = self.sizes.states, self.sizes.dynamic.stop
        S = np.zeros((n, dynamic + n))
        S[:, dynamic:] = np.eye(n)
        y = np.empty((len(scaled), self.sizes.outputs))
        J = np.empty((*y.shape, dynamic + n + self.sizes.output.stop - self.sizes.output.start))
        kernel.sensitivities(scaled, x.copy(), S, *self.arguments(self.theta), y, J)
        return J[:, :, dynamic : dynamic + n]
