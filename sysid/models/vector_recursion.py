"""The form of networks with several outputs: a recursion in which each output reads the past of all."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.kernels import cascade as kernel
from sysid.kernels.cascade_layout import Layout, Program
from sysid.kernels.cascade_plan import Plan
from sysid.kernels.neurons import NEURONS
from sysid.models.activations import PLAIN
from sysid.models.cascade_program import Limit, program_of
from sysid.models.column_recursion import ColumnRecursion
from sysid.models.ends import Ends, read_now
from sysid.models.form import AbstractForm
from sysid.models.history import History
from sysid.models.lags import Lags
from sysid.models.output_limits import Between
from sysid.models.recursion import gauss_newton
from sysid.models.scaling import VectorScaling

_NOTHING = np.empty((0, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorRecursion(AbstractForm):
    r""":math:`\hat y_t = \mathrm{clip}(w x_t + c + V\,\sigma(W x_t + b))` over lagged inputs and outputs.

    Args:
        lags: Lags of every input and then of every output, as ``inputs``; ``output`` is empty.
        n_outputs: How many of these columns are outputs.
        neurons: Number of neurons.
        theta: Flat parameters ``[W | b | V | c | w]``.
        linear: Whether there is a linear part ``w``.
        scaling: Between units and scaled numbers.
        low: Lower bound of the outputs in scaled numbers; ``-inf`` for none.
        high: Upper bound of the outputs in scaled numbers; ``inf`` for none.
        between: Limits of each output in its unit; empty for none.
        activation: The kind of its neurons, :math:`\sigma`.
    """

    lags: Lags
    n_outputs: int
    neurons: int
    theta: NDArray[np.float64]
    linear: bool
    scaling: VectorScaling
    low: float = -np.inf
    high: float = np.inf
    between: tuple[Between, ...] = ()
    activation: str = PLAIN

    @property
    def n_inputs(self) -> int:
        """Number of inputs."""
        return len(self.lags.inputs) - self.n_outputs

    @property
    def numbers(self) -> NDArray[np.float64]:
        """The flat parameters."""
        return self.theta

    @property
    def _own(self) -> int:
        """The longest lag of an output."""
        return max(max(lags, default=0) for lags in self.lags.inputs[self.n_inputs :])

    @property
    def memory(self) -> int:
        """Lags before the first row, and rows to tell the outputs among them."""
        return self.lags.depth + self._own

    def reads_now(self, inputs: tuple[str, ...]) -> frozenset[str]:
        """Inputs that it reads with a lag of 0."""
        return read_now(inputs, self.lags.inputs)

    @property
    def columns(self) -> ColumnRecursion:
        """It as a member of a cascade."""
        scaling = self.scaling
        return ColumnRecursion(
            lags=self.lags,
            neurons=self.neurons,
            theta=self.theta,
            linear=self.linear,
            gated=False,
            offset=(*scaling.input_offset, *scaling.output_offset),
            scale=(*scaling.input_scale, *scaling.output_scale),
            low=self.low,
            high=self.high,
            activation=self.activation,
        )

    @cached_property
    def _program(self) -> Program:
        m, p = self.n_inputs, self.n_outputs
        inputs, outputs = tuple(f"u{i}" for i in range(m)), tuple(f"y{i}" for i in range(p))
        ends = Ends(
            inputs=inputs,
            outputs=outputs,
            input_units=("",) * m,
            output_units=("",) * p,
            rest_outputs=(0.0,) * p,
            direct=frozenset(),
        )
        limits = {f"y{i}": Limit(low=low, high=high) for i, (low, high) in enumerate(self.between)}
        return program_of([self.columns], [ends], (*inputs, *outputs), limits)

    @cached_property
    def _layout(self) -> Layout:
        return Plan.of(self._program).laid_out(self.theta)

    def simulate(self, inputs: NDArray[np.float64], history: History) -> NDArray[np.float64]:
        """Free run; see the base class."""
        depth = self.lags.depth
        past_inputs, past_output = history.padded(depth)
        inputs = self._checked(inputs)
        room = np.zeros((depth + len(inputs), self.n_inputs + self.n_outputs))
        room[:depth, : self.n_inputs], room[:depth, self.n_inputs :] = past_inputs, past_output
        room[depth:, : self.n_inputs] = inputs
        self._walk(room, depth)
        return np.ascontiguousarray(room[depth:, self.n_inputs :])

    def refined(self, history: History) -> History:
        """Past outputs by Gauss-Newton on those before the first row, followed by the free run from there."""
        depth, own, p = self.lags.depth, self._own, self.n_outputs
        if own == 0 or len(history.output) <= depth:
            return history
        scaling, places = self.scaling, slice(depth - own, len(history.output))
        measured = scaling.scale_output(history.output)

        def run(past: NDArray[np.float64]) -> NDArray[np.float64]:
            room = np.concatenate([history.inputs, history.output], axis=1)
            room[depth - own : depth, self.n_inputs :] = scaling.unscale_output(past.reshape(own, p))
            self._walk(room, depth)
            return scaling.scale_output(room[places, self.n_inputs :]).ravel()

        known = np.repeat(history.known[places], p)
        found = gauss_newton(run, measured[depth - own : depth].ravel(), measured[places].ravel(), known)
        if found is None:
            return history
        output = history.output.copy()
        output[places] = scaling.unscale_output(run(found).reshape(-1, p))
        return History(inputs=history.inputs, output=output)

    def followed(self, history: History) -> NDArray[np.float64]:
        """The free run over a history itself; see the base class."""
        return self.refined(history).output

    def predict(
        self, inputs: NDArray[np.float64], output: NDArray[np.float64], history: History, steps: int
    ) -> NDArray[np.float64]:
        """Prediction ``steps`` ahead, of all samples at once, step by step; see the base class."""
        depth, m, n = self.lags.depth, self.n_inputs, len(inputs)
        past_inputs, past_output = history.padded(depth)
        u = self.scaling.scale_inputs(np.concatenate([past_inputs, self._checked(inputs)]))
        y = self.scaling.scale_output(np.concatenate([past_output, np.asarray(output, dtype=np.float64)]))
        # ahead[j][t] is sample t as it was predicted j steps before it; what is measured is 0 steps ahead.
        ahead = [y]
        for step in range(1, steps + 1):
            columns = []
            for channel, lag in zip(self.lags.input_channel, self.lags.input_lag, strict=True):
                known = u[:, channel] if channel < m else ahead[max(0, step - lag)][:, channel - m]
                columns.append(known[depth - lag : depth - lag + n])
            predicted = y.copy()
            predicted[depth:] = self._held(self._step(np.column_stack(columns)), scaled=True)
            if step > 1:  # a record's first samples are predicted from the history, fewer steps before
                first = depth + step - 1
                predicted[depth:first] = ahead[-1][depth:first]
            ahead.append(predicted)
        return self._held(self.scaling.unscale_output(ahead[-1][depth:]))

    def _step(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scaled outputs of rows of regressors."""
        k, r, p = self.neurons, x.shape[1], self.n_outputs
        W, b, V, c, w = np.split(self.theta, np.cumsum([k * r, k, p * k, p]))
        h = NEURONS[self.activation].value(x @ W.reshape(k, r).T + b)
        y = h @ V.reshape(p, k).T + c
        return np.clip(y + x @ w.reshape(p, r).T if self.linear else y, self.low, self.high)

    def _held(self, y: NDArray[np.float64], *, scaled: bool = False) -> NDArray[np.float64]:
        """Outputs within their limits."""
        if not self.between:
            return y
        low, high = (
            np.array([far if sides[k] is None else sides[k] for sides in self.between], dtype=np.float64)
            for k, far in ((0, -np.inf), (1, np.inf))
        )
        if scaled:
            low, high = self.scaling.scale_output(low), self.scaling.scale_output(high)
        return np.clip(y, low, high)

    def _walk(self, room: NDArray[np.float64], past: int) -> None:
        """Run over the rows from ``past`` on, in units."""
        held = np.empty((len(room) - past, self.n_outputs), dtype=np.int8)
        kernel.go_on(self._program, self._layout, past, room, _NOTHING, held)

    def _checked(self, inputs: NDArray[np.float64]) -> NDArray[np.float64]:
        inputs = np.asarray(inputs, dtype=np.float64)
        if inputs.ndim != 2 or inputs.shape[1] != self.n_inputs:
            raise TraceError(
                "the inputs do not fit the model",
                expected=f"inputs and history of shape (n, {self.n_inputs})",
                got=f"shape {inputs.shape}",
                remedy="give one column per input of the mapping, in its order",
            )
        return inputs
