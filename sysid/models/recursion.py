"""The form that every model with lagged regressors lowers to, run by the compiled kernel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.kernels import recursion as kernel
from sysid.kernels.neurons import code_of
from sysid.models.activations import PLAIN
from sysid.models.column_recursion import ColumnRecursion
from sysid.models.ends import read_now
from sysid.models.form import AbstractForm
from sysid.models.history import History
from sysid.models.lags import Lags
from sysid.models.output_limits import Between
from sysid.models.scaling import Scaling

NOT_KEPT = (np.empty((0, 0)), np.empty((0, 0), dtype=np.int8))
"""Room for activations and for what held an output, of which nobody asks."""


def parameter_count(lags: Lags, neurons: int, *, linear: bool, gated: bool = False) -> int:
    """Length of the flat parameter vector ``[W | b | v | c | w | V]``.

    Args:
        lags: The regressors.
        neurons: Number of neurons.
        linear: Whether there is a linear part beside them.
        gated: Whether each neuron has a gate; with a linear part only.

    Returns:
        Number of parameters.
    """
    r = lags.n_regressors
    return neurons * (r + 2) + 1 + (r if linear else 0) + (neurons * r if gated else 0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Recursion(AbstractForm):
    r"""A layer of neurons and a linear part over lagged regressors, scaling included.

    In scaled numbers :math:`\hat y_t = \mathrm{clip}(w^T x_t + c + \sum_k (v_k + V_k x_t)\,\sigma(W_k x_t + b_k))`,
    with :math:`V = 0` where there are no gates; the kernel's docstring has the derivation. Exporters read this form, so
    that what runs elsewhere is what was fitted.

    Args:
        lags: The regressors.
        neurons: Number of neurons; 0 for a linear model.
        theta: Flat parameters ``[W | b | v | c | w | V]``, with or without ``V``, or ``w`` and ``V``.
        scaling: Between units and scaled numbers.
        low: Lower bound of the output in scaled numbers; ``-inf`` for none.
        high: Upper bound of the output in scaled numbers; ``inf`` for none.
        between: Limits of the output in its unit, as a cascade has them: at a bound a run is lost, at a limit right.
        activation: The kind of its neurons, :math:`\sigma`.
    """

    lags: Lags
    neurons: int
    theta: NDArray[np.float64]
    scaling: Scaling
    low: float = -np.inf
    high: float = np.inf
    between: Between = (None, None)
    activation: str = PLAIN

    def __post_init__(self) -> None:
        theta = np.array(self.theta, dtype=np.float64)
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)
        kinds = ((False, False), (True, False), (True, True))
        sizes = {parameter_count(self.lags, self.neurons, linear=linear, gated=gated) for linear, gated in kinds}
        if theta.ndim != 1 or len(theta) not in sizes:
            raise TraceError(
                "the parameter vector does not fit the structure",
                expected=f"{' or '.join(str(size) for size in sorted(sizes))} parameters",
                got=f"shape {theta.shape}",
                remedy="use parameters that were fitted with this structure",
            )

    @property
    def bounds(self) -> tuple[float, float]:
        """Between what the kernels hold the output, in scaled numbers: bounds within the limits."""
        low, high = self._limits
        return min(max(self.low, low), high), min(max(self.high, low), high)

    @property
    def _limits(self) -> tuple[float, float]:
        """The limits in scaled numbers, infinite for none."""
        low, high = (
            far if one is None else float(self.scaling.scale_output(np.array(one)))
            for one, far in zip(self.between, (-np.inf, np.inf), strict=True)
        )
        return low, high

    def in_units(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled outputs in their unit; one that is held at a limit is at it to the last bit, as in a cascade."""
        found = self.scaling.unscale_output(y)
        for at, (limit, scaled) in enumerate(zip(self.between, self._limits, strict=True)):
            if limit is not None:
                found = np.where((y >= scaled) if at else (y <= scaled), limit, found)
        return found

    @property
    def numbers(self) -> NDArray[np.float64]:
        """The flat parameters."""
        return self.theta

    @property
    def hidden_weights(self) -> NDArray[np.float64]:
        """``W``, shape ``(n_neurons, n_regressors)``."""
        n = self.neurons * self.lags.n_regressors
        return self.theta[:n].reshape(self.neurons, self.lags.n_regressors)

    @property
    def hidden_bias(self) -> NDArray[np.float64]:
        """``b``, shape ``(n_neurons,)``."""
        n = self.neurons * self.lags.n_regressors
        return self.theta[n : n + self.neurons]

    @property
    def readout(self) -> NDArray[np.float64]:
        """``v``, shape ``(n_neurons,)``."""
        n = self.neurons * (self.lags.n_regressors + 1)
        return self.theta[n : n + self.neurons]

    @property
    def constant(self) -> float:
        """``c``."""
        return float(self.theta[self.neurons * (self.lags.n_regressors + 2)])

    @property
    def linear(self) -> NDArray[np.float64]:
        """``w``, shape ``(n_regressors,)``; zeros where the model has no linear part."""
        r = self.lags.n_regressors
        first = self.neurons * (r + 2) + 1
        w = self.theta[first : first + r]
        return w if len(w) else np.zeros(r)

    @property
    def gates(self) -> NDArray[np.float64] | None:
        """``V``, shape ``(n_neurons, n_regressors)``; ``None`` where the neurons have no gates."""
        r = self.lags.n_regressors
        flat = self.theta[self.neurons * (r + 2) + 1 + r :]
        return flat.reshape(self.neurons, r) if len(flat) else None

    @property
    def columns(self) -> ColumnRecursion:
        """Its output is one more column of lagged regressors."""
        return ColumnRecursion(
            lags=Lags(inputs=(*self.lags.inputs, self.lags.output), output=()),
            neurons=self.neurons,
            theta=self.theta,
            linear=len(self.theta) > self.neurons * (self.lags.n_regressors + 2) + 1,
            gated=self.gates is not None,
            offset=(*self.scaling.input_offset, self.scaling.output_offset),
            scale=(*self.scaling.input_scale, self.scaling.output_scale),
            low=self.low,
            high=self.high,
            activation=self.activation,
        )

    def extended(
        self, inputs: NDArray[np.float64], history: History
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Scaled inputs with their past, and room for the output after its past.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            history: The samples before.

        Returns:
            Inputs of shape ``(depth + n_samples, n_inputs)`` and output of shape ``(depth + n_samples,)``,
            both scaled; the output's last ``n_samples`` are zero.

        Raises:
            TraceError: If the number of inputs is not the model's.
        """
        inputs = np.asarray(inputs, dtype=np.float64)
        if inputs.ndim != 2 or inputs.shape[1] != self.lags.n_inputs or history.inputs.shape[1] != self.lags.n_inputs:
            raise TraceError(
                "the inputs do not fit the model",
                expected=f"inputs and history of shape (n, {self.lags.n_inputs})",
                got=f"shapes {inputs.shape} and {history.inputs.shape}",
                remedy="give one column per input of the mapping, in its order",
            )
        past_inputs, past_output = history.padded(self.lags.depth)
        u = self.scaling.scale_inputs(np.concatenate([past_inputs, inputs]))
        y = np.concatenate([self.scaling.scale_output(past_output), np.zeros(len(inputs))])
        return u, y

    def reads_now(self, inputs: tuple[str, ...]) -> frozenset[str]:
        """Inputs that it reads with a lag of 0."""
        return read_now(inputs, self.lags.inputs)

    def simulate(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """Free run: the model is fed its own past output.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            history: The samples before.

        Returns:
            Output of shape ``(n_samples,)``, in its unit.
        """
        u, y = self.extended(inputs, history)
        kernel.free_run(u, y, y, *self._arguments(len(inputs)))
        return self.in_units(y[self.lags.depth :])

    @property
    def memory(self) -> int:
        """Lags before the first row, and rows to tell the outputs among them."""
        return self.lags.depth + max(self.lags.output, default=0)

    def refined(self, history: History) -> History:
        """Past outputs by Gauss-Newton on those before the first row, followed by the free run from there.

        Masked outputs take no part. A single Gauss-Newton step is exact for a linear model.

        Args:
            history: Measured samples, oldest first.

        Returns:
            The history with the model's own outputs; as it is where it is no longer than the lags, or the run is lost.
        """
        depth, own = self.lags.depth, max(self.lags.output, default=0)
        if own == 0 or len(history.output) <= depth:
            return history
        u, measured = self.scaling.scale_inputs(history.inputs), self.scaling.scale_output(history.output)
        places = slice(depth - own, len(measured))
        known = history.known[places]

        def run(past: NDArray[np.float64]) -> NDArray[np.float64]:
            y = measured.copy()
            y[depth - own : depth] = past
            kernel.free_run(u, y, y, *self._arguments(len(measured) - depth))
            return y[places]

        found = gauss_newton(run, measured[depth - own : depth], measured[places], known)
        if found is None:
            return history
        y = measured.copy()
        y[places] = run(found)
        return History(inputs=history.inputs, output=self.scaling.unscale_output(y))

    def followed(self, history: History) -> NDArray[np.float64]:
        """The free run over a history itself; see the base class."""
        return self.refined(history).output

    def predict(
        self, inputs: NDArray[np.float64], output: NDArray[np.float64], history: History, steps: int
    ) -> NDArray[np.float64]:
        """Prediction ``steps`` ahead: measured output up to ``t - steps``, the model's own after it.

        Args:
            inputs: Shape ``(n_samples, n_inputs)``, in the channels' units.
            output: Measured output, shape ``(n_samples,)``.
            history: The samples before.
            steps: How far ahead, at least 1.

        Returns:
            Predicted output of shape ``(n_samples,)``; its first ``steps`` samples start from the history.
        """
        u, y = self.extended(inputs, history)
        measured = y.copy()
        measured[self.lags.depth :] = self.scaling.scale_output(np.asarray(output, dtype=np.float64))
        kernel.predict(u, measured, y, steps, *self._arguments(len(inputs)))
        return self.in_units(y[self.lags.depth :])

    def _arguments(self, n_steps: int) -> tuple[object, ...]:
        lags = self.lags
        tables = (lags.input_channel, lags.input_lag, lags.output_lag)
        kind, bounds = code_of(self.activation), self.bounds
        return (lags.depth, n_steps, *tables, self.theta, self.neurons, kind, *bounds, *NOT_KEPT)


STEPS, APART = 12, 1e-5
"""Gauss-Newton steps at most, and how far apart outputs are put for a derivative, in scaled numbers."""


def gauss_newton(
    run: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    start: NDArray[np.float64],
    target: NDArray[np.float64],
    known: NDArray[np.bool_],
) -> NDArray[np.float64] | None:
    """What to begin a run with so that it comes closest to a target.

    Args:
        run: From what it begins with to what it gives, both flat.
        start: The first guess.
        target: What it should give.
        known: Which of the target's values count.

    Returns:
        What was found; ``None`` where no run is finite.
    """

    def residual(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(known, run(x) - target, 0.0)

    x, r = start.copy(), residual(start)
    if not np.isfinite(r).all():
        return None
    for _ in range(STEPS):
        moved = [residual(x + step) - residual(x - step) for step in APART * np.eye(len(x))]
        J = np.column_stack(moved) / (2.0 * APART)
        if not np.isfinite(J).all():
            return x
        step, share, better = np.linalg.lstsq(J, -r, rcond=1e-10)[0], 1.0, False
        while not better and share > 1e-3:
            trial = residual(x + share * step)
            better = bool(np.isfinite(trial).all() and trial @ trial < r @ r)
            if better:
                gained = r @ r - trial @ trial
                x, r = x + share * step, trial
            share /= 4.0
        if not better or gained < 1e-12 * (r @ r):
            break
    return x
