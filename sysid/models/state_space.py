"""The form that transfer functions lower to: a linear state space, run by the compiled kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import TraceError
from sysid.kernels import linear as kernel
from sysid.models.form import AbstractForm
from sysid.models.history import History
from sysid.models.scaling import Scaling

HISTORY_NOISE = 1e-6
"""Variance of the output's history relative to what the model explains, when a state is estimated from it: small
enough to follow a clean record, large enough that states which it does not show stay at their equilibrium."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StateSpace(AbstractForm):
    r"""``x(t+1) = A x(t) + B u(t)``, ``y(t) = C x(t) + D u(t) + c`` in scaled numbers.

    The state comes from the history: the equilibrium at its oldest inputs, run on through its inputs; where it holds
    more than one sample, the part of its output that this does not explain moves the state by

    .. math:: x_0 = P O^T (O P O^T + \lambda I)^{-1} (y - \hat y)

    the mean of a state with covariance :math:`P`, that of white inputs, given the output; :math:`O` is the
    observability matrix. A history of one sample is a system at rest, whose output is the model's.

    Args:
        A: Shape ``(n_state, n_state)``.
        B: Shape ``(n_state, n_inputs)``.
        C: Shape ``(n_state,)``.
        D: Shape ``(n_inputs,)``.
        constant: Output without inputs.
        scaling: Between units and scaled numbers.
        low: Lower bound of the output in scaled numbers; ``-inf`` for none.
        high: Upper bound of the output in scaled numbers; ``inf`` for none.
    """

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: NDArray[np.float64]
    constant: float
    scaling: Scaling
    low: float = -np.inf
    high: float = np.inf

    @property
    def n_state(self) -> int:
        """Length of the state."""
        return len(self.A)

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return int(self.B.shape[1])

    @property
    def numbers(self) -> NDArray[np.float64]:
        """All matrices and the constant, flat."""
        return np.concatenate([self.A.ravel(), self.B.ravel(), self.C, self.D, [self.constant]])

    def state(self, history: History) -> NDArray[np.float64]:
        """The state after some samples.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(n_state,)``.
        """
        inputs = self._checked(history.inputs)
        x = self.equilibrium(inputs[0])
        if len(inputs) == 1:
            return x
        x = x + self._correction(inputs, self.scaling.scale_output(history.output), x)
        self._run(inputs, x)
        return x

    def equilibrium(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state at which the system stays while its inputs are held.

        Args:
            inputs: Scaled inputs, shape ``(n_inputs,)``.

        Returns:
            Shape ``(n_state,)``; the one of least length where there are many.
        """
        if self.n_state == 0:
            return np.zeros(0)
        return np.asarray(linalg.lstsq(np.eye(self.n_state) - self.A, self.B @ inputs)[0])

    def simulate(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """Free run; see the base class."""
        scaled = self._checked(inputs)
        y = self._run(scaled, self.state(history))
        return self.scaling.unscale_output(np.clip(y, self.low, self.high))

    def predict(
        self,
        inputs: NDArray[np.float64],
        output: NDArray[np.float64],  # noqa: ARG002 - the noise is added to the output and says nothing about the next
        history: History,
        steps: int,  # noqa: ARG002 - for the same reason
    ) -> NDArray[np.float64]:
        """The free run: with white noise on the output alone the best prediction does not use past output."""
        return self.simulate(inputs, history)

    def _run(self, scaled: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled output over some scaled inputs; ``x`` becomes the state after them."""
        y = np.empty((len(scaled), 1))
        kernel.state_space(self.A, self.B, self.C[np.newaxis], self.D[np.newaxis], scaled, x, y)
        return y[:, 0] + self.constant

    def _correction(
        self, scaled: NDArray[np.float64], output: NDArray[np.float64], x: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """How far the state at the history's begin is from equilibrium, judged by its output."""
        missing = output - self._run(scaled, x.copy())
        spread = self._covariance()
        observed = np.empty((len(scaled), self.n_state))
        row = self.C.copy()
        for t in range(len(scaled)):
            observed[t] = row
            row = row @ self.A
        seen = observed @ spread @ observed.T
        level = HISTORY_NOISE * max(float(np.trace(seen)) / len(seen), np.finfo(np.float64).tiny)
        return np.asarray(spread @ observed.T @ linalg.lstsq(seen + level * np.eye(len(seen)), missing)[0])

    def _covariance(self) -> NDArray[np.float64]:
        """Covariance of the state under white inputs; the identity where the system is not stable."""
        if np.abs(linalg.eigvals(self.A)).max(initial=0.0) >= 1.0:
            return np.eye(self.n_state)
        return np.asarray(linalg.solve_discrete_lyapunov(self.A, self.B @ self.B.T))

    def _checked(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        inputs = np.asarray(inputs, dtype=np.float64)
        if inputs.ndim != 2 or inputs.shape[1] != self.n_inputs:
            raise TraceError(
                "the inputs do not fit the model",
                expected=f"inputs and history of shape (n, {self.n_inputs})",
                got=f"shape {inputs.shape}",
                remedy="give one column per input of the mapping, in its order",
            )
        return self.scaling.scale_inputs(inputs)
