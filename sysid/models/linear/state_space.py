"""The form that linear models with hidden states lower to: a state space, run by the compiled kernel."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.kernels import innovations
from sysid.kernels import linear as kernel
from sysid.models.channels.history import History, fitting_columns
from sysid.models.channels.scaling import Scaling, VectorScaling
from sysid.models.contract.form import AbstractForm, no_prediction
from sysid.models.linear.at_rest import AT_ONE, state_at_rest
from sysid.models.linear.innovations import Innovations

HISTORY_NOISE = 1e-6
"""Variance of the output's history relative to what the model explains, where it is too short to tell its noise: small
enough to follow a clean record, large enough that states which it does not show stay at their equilibrium."""

EXACT = 1e-18
"""Variance of what a state leaves unexplained, relative to the output's, below which a history has no noise."""

FORGETS = 0.5
"""Distance from 1 beyond which the poles of a filter forget at once, as those of a recursion over past outputs do."""

BEYOND = 2.0
"""How far a run may begin from the output that stood, as a part of how far that was from its equilibrium: as far beyond
that, on its other side."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Filter:
    """A system in the coordinates in which its predictor loses no digits, where those of a free run are others.

    Args:
        system: In these coordinates.
        towards: From its state to the one of a free run.
        back: The inverse.
    """

    system: Innovations
    towards: NDArray[np.float64]
    back: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class StateSpace(AbstractForm):
    r"""``x(t+1) = A x(t) + B u(t)``, ``y(t) = C x(t) + D u(t) + c`` in scaled numbers.

    The state comes from the history: the equilibrium at its oldest inputs, run on through its inputs; where it holds
    more than one sample, the part of its output that this does not explain moves the state by its least squares
    solution. Where that leaves a residual, of variance :math:`\lambda`, it is

    .. math:: x_0 = P O^T (O P O^T + \lambda I)^{-1} (y - \hat y)

    the mean of a state with covariance :math:`P`, that of white inputs, given the output; :math:`O` is the
    observability matrix. A history of one sample is a system at rest, whose output is the model's; of an integrator,
    which may rest anywhere, it is the sample's (:mod:`sysid.models.linear.at_rest`).

    Args:
        A: Shape ``(n_state, n_state)``.
        B: Shape ``(n_state, n_inputs)``.
        C: Shape ``(n_outputs, n_state)``.
        D: Shape ``(n_outputs, n_inputs)``.
        constant: Outputs without inputs, shape ``(n_outputs,)``.
        scaling: Between units and scaled numbers; one of several outputs makes arrays of outputs have columns.
        low: Lower bound of the output in scaled numbers; ``-inf`` for none.
        high: Upper bound of the output in scaled numbers; ``inf`` for none.
        K: Gain from the innovation ``y - yhat`` to the state, shape ``(n_state, n_outputs)``, with which the output one
            step ahead is predicted; ``None`` where the noise is added to the output and predicts nothing.
    """

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: NDArray[np.float64]
    constant: NDArray[np.float64]
    scaling: Scaling | VectorScaling
    low: float = -np.inf
    high: float = np.inf
    K: NDArray[np.float64] | None = None
    filter: Filter | None = None
    predicts: bool = field(default=False, init=False)

    @classmethod
    def of(cls, system: Innovations, scaling: Scaling | VectorScaling, *, noise: bool) -> StateSpace:
        """A system in innovations form as what is run.

        Args:
            system: Its matrices, in scaled numbers.
            scaling: Between units and scaled numbers.
            noise: Whether its model of the noise counts; without it there is no prediction from measured output.

        Returns:
            The form.
        """
        gain = system.K if noise else None
        return cls(
            A=system.A, B=system.B, C=system.C, D=system.D, constant=system.constant, K=gain, scaling=scaling
        )  # fmt: skip

    def __post_init__(self) -> None:
        object.__setattr__(self, "predicts", self.K is not None)

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
        gain = np.zeros(0) if self.K is None else self.K
        parts = (self.A, self.B, self.C, self.D, self.constant, gain)
        return np.concatenate([part.ravel() for part in parts])

    @property
    def n_outputs(self) -> int:
        """Number of outputs."""
        return len(self.C)

    @property
    def gain(self) -> NDArray[np.float64]:
        """``K``, or zeros."""
        return np.zeros((self.n_state, self.n_outputs)) if self.K is None else self.K

    def state(self, history: History) -> NDArray[np.float64]:
        """The state after some samples.

        Args:
            history: The samples, oldest first, in units; a single one is a system at rest.

        Returns:
            Shape ``(n_state,)``.
        """
        x = self._begun(history)
        if len(history.output) > 1:
            self._run(self._checked(history.inputs), x)
        return x

    def followed(self, history: History) -> NDArray[np.float64]:
        """The free run over a history itself; see the base class."""
        return self._in_units(self._run(self._checked(history.inputs), self._begun(history)))

    def _begun(self, history: History) -> NDArray[np.float64]:
        """The state before the oldest sample of a history; of a single one, the state after it."""
        inputs, output = self._checked(history.inputs), self._scaled(history.output)
        if len(inputs) == 1:
            return self.resting(inputs[0], output[0])
        x = self.equilibrium(inputs[0]) if self.radius < 1.0 - AT_ONE else np.zeros(self.n_state)
        return x + self._correction(inputs, output, x, history.known)

    @property
    def memory(self) -> int:
        """Twice as many samples as states but for dead times, which are among the states once."""
        moving = int(np.count_nonzero(np.abs(scipy.linalg.eigvals(self.A)) > AT_ONE)) if self.n_state else 0
        return self.n_state + moving + 1

    @cached_property
    def radius(self) -> float:
        """Largest magnitude of an eigenvalue."""
        return float(np.abs(scipy.linalg.eigvals(self.A)).max(initial=0.0)) if self.n_state else 0.0

    def resting(self, inputs: NDArray[np.float64], output: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state of a system at rest.

        With a model of the noise it is the filter's state after that output and these inputs stood for ever: like a
        recursion over past outputs, the free run then begins at the output that is declared. Where that says nothing,
        it is the state of the system without the noise.

        Args:
            inputs: Scaled inputs, shape ``(n_inputs,)``.
            output: Scaled outputs, shape ``(n_outputs,)``.

        Returns:
            Shape ``(n_state,)``.
        """
        if self.K is not None and self._told_by_standing:
            return self.standing(inputs, output)
        return state_at_rest((self.A, self.B, self.C, self.D, self.constant), inputs, output)

    @cached_property
    def _told_by_standing(self) -> bool:
        """Whether an output that stood for ever says where the state of the filter is.

        White noise of a sensor, and a short record, put a zero of the noise near 1: of what stands the noise then has
        less than of one sample, and a filter that hardly forgets sums a difference of the output from its equilibrium
        up to many times its size. Where it forgets nothing, the state is not determined at all.
        """
        one = self if self.filter is None else self.filter.system
        gain = self.gain if self.filter is None else self.filter.system.K
        forgets = np.eye(self.n_state) - one.A + gain @ one.C
        sizes = scipy.linalg.svdvals(forgets) if self.n_state else np.ones(1)
        if not sizes[-1] > AT_ONE * max(float(sizes[0]), 1.0):
            return False
        if np.abs(scipy.linalg.eigvals(forgets)).min(initial=1.0) > FORGETS:
            return True
        left = np.eye(self.n_outputs) - one.C @ scipy.linalg.solve(forgets, gain)
        return bool(np.abs(scipy.linalg.eigvals(left)).max() <= BEYOND)

    def equilibrium(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        """The state at which the system stays while its inputs are held.

        Args:
            inputs: Scaled inputs, shape ``(n_inputs,)``.

        Returns:
            Shape ``(n_state,)``; the one of least length where there are many.
        """
        if self.n_state == 0:
            return np.zeros(0)
        return np.asarray(scipy.linalg.lstsq(np.eye(self.n_state) - self.A, self.B @ inputs, cond=AT_ONE)[0])

    def standing(self, inputs: NDArray[np.float64], output: NDArray[np.float64]) -> NDArray[np.float64]:
        """The filter's state after scaled inputs and scaled outputs that have stood for ever.

        Args:
            inputs: Shape ``(n_inputs,)``.
            output: Shape ``(n_outputs,)``.

        Returns:
            Shape ``(n_state,)``.
        """
        if self.filter is not None:
            return self.filter.towards @ self.filter.system.standing(inputs, output)
        drive = self.B @ inputs + self.gain @ (output - self.D @ inputs - self.constant)
        return np.asarray(scipy.linalg.lstsq(np.eye(self.n_state) - self.A + self.gain @ self.C, drive, cond=AT_ONE)[0])

    def simulate(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """Free run; see the base class."""
        scaled = self._checked(inputs)
        return self._in_units(self._run(scaled, self.state(history)))

    def predict(
        self, inputs: NDArray[np.float64], output: NDArray[np.float64], history: History, steps: int
    ) -> NDArray[np.float64]:
        """Prediction by the Kalman filter; see the base class. An output that is not a number moves nothing.

        With the state ``x(t + 1 | t)`` that the filter has, ``x(t + k | t)`` follows by the free run over ``k - 1``
        steps. Of the first ``k`` samples nothing is measured in time: they are the free run from the history.
        """
        if self.K is None:
            raise no_prediction("a linear model without a model of its noise")
        scaled, n = self._checked(inputs), len(inputs)
        measured = self._scaled(np.asarray(output, dtype=np.float64))
        x = self._filtered(history)
        start = x.copy()
        X, y = self._tracked(scaled, measured, x)
        if min(steps, n) <= 1:
            return self._in_units(y)
        moved = scaled @ self.B.T
        for _ in range(min(steps, n) - 1):
            X[1:] = X[:-1] @ self.A.T + moved[:-1]
            X[0] = start
        return self._in_units(X @ self.C.T + scaled @ self.D.T + self.constant)

    def forecast(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """The free run from the state that the Kalman filter has after the history; see the base class."""
        if self.K is None:
            return self.simulate(inputs, history)
        return self._in_units(self._run(self._checked(inputs), self._filtered(history)))

    def _filtered(self, history: History) -> NDArray[np.float64]:
        """The state after some samples by the Kalman filter, from the one that fits them best."""
        x = self._begun(history)
        if len(history.output) > 1:
            measured = np.where(history.known[:, np.newaxis], self._scaled(history.output), np.nan)
            self._tracked(self._checked(history.inputs), measured, x)
        return x

    def _tracked(
        self, scaled: NDArray[np.float64], output: NDArray[np.float64], x: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The filter's states and predictions over some scaled samples; ``x`` becomes the state after them."""
        states, predicted = np.empty((len(scaled), self.n_state)), np.empty((len(scaled), self.n_outputs))
        if self.filter is not None:
            z = self.filter.back @ x
            predicted, states = self.filter.system.predicted(scaled, output, z)
            x[:] = self.filter.towards @ z
            return states @ self.filter.towards.T, predicted
        matrices = (self.A, self.B, self.C, self.D, self.gain, self.constant)
        innovations.predict(*matrices, scaled, np.ascontiguousarray(output), x, states, predicted)
        return states, predicted

    def _run(self, scaled: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled outputs over some scaled inputs; ``x`` becomes the state after them."""
        y = np.empty((len(scaled), self.n_outputs))
        kernel.state_space(self.A, self.B, self.C, self.D, scaled, x, y)
        return y + self.constant

    def _scaled(self, output: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs in scaled numbers, one column each."""
        return np.asarray(self.scaling.scale_output(output)).reshape(len(output), self.n_outputs)

    def _in_units(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outputs in their units, within bounds; of a single one without an axis of its own."""
        return self.scaling.unscale_columns(np.clip(y, self.low, self.high))

    def _correction(
        self,
        scaled: NDArray[np.float64],
        output: NDArray[np.float64],
        x: NDArray[np.float64],
        known: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        """How far the state at the history's begin is from the one expected, judged by its output."""
        if not self.n_state:
            return x
        missing = output - self._run(scaled, x.copy())
        rows = np.empty((len(scaled), self.n_outputs, self.n_state))
        row = self.C.copy()
        for t in range(len(scaled)):
            rows[t] = row
            row = row @ self.A
        observed, missing = rows[known].reshape(-1, self.n_state), missing[known].ravel()
        if not np.isfinite(observed).all() or not len(missing):
            return np.zeros(self.n_state)
        size = np.linalg.norm(observed, axis=0)
        scale = np.where(size > 0.0, size, 1.0)
        found, _, rank, _ = scipy.linalg.lstsq(observed / scale, missing, cond=1e-10)
        left = missing - (observed / scale) @ found
        level = float(left @ left) / max(len(left) - rank, 1)
        clean = level <= EXACT * max(float(np.mean(output**2)), np.finfo(np.float64).tiny)
        if (len(left) > rank and clean) or self.radius >= 1.0 - AT_ONE:
            return np.asarray(found / scale)
        spread = self._covariance(level)
        told = observed @ _root(spread)
        if not np.isfinite(told).all():  # so near the edge that a covariance has no digits left
            return np.asarray(found / scale)
        if len(left) <= rank:
            level = HISTORY_NOISE * max(float(np.mean(np.sum(told**2, axis=1))), np.finfo(np.float64).tiny)
        if self.n_inputs and self.radius < 1.0:  # the first input may not have been held always
            held = scipy.linalg.lstsq(np.eye(self.n_state) - self.A, self.B)[0]
            spread = spread + held @ held.T
        root = _root(spread)
        # Least squares with what was expected as rows of its own: of a long history no matrix of samples by samples.
        with np.errstate(all="ignore"):
            rows = np.concatenate([observed @ root, np.sqrt(level) * np.eye(self.n_state)])
            if not np.isfinite(rows).all():
                return np.asarray(found / scale)
            right = np.concatenate([missing, np.zeros(self.n_state)])
            moved = root @ scipy.linalg.lstsq(rows, right)[0]
        return np.asarray(moved if np.isfinite(moved).all() else found / scale)

    def _covariance(self, level: float) -> NDArray[np.float64]:
        """Covariance of the state under white inputs and innovations; the identity where the system is not stable.

        Args:
            level: Variance of the innovations: what no input reaches, such as the level of a drift, they do.
        """
        if self.radius >= 1.0:
            return np.eye(self.n_state)
        drive = self.B @ self.B.T + level * (self.gain @ self.gain.T)
        return np.asarray(scipy.linalg.solve_discrete_lyapunov(self.A, drive))

    def _checked(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.scaling.scale_inputs(fitting_columns(inputs, self.n_inputs))


def _root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """``R`` with ``R R^T`` a covariance; not a number where that is none."""
    if not np.isfinite(covariance).all():
        return np.full_like(covariance, np.nan)
    sizes, vectors = scipy.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(sizes, 0.0)))
