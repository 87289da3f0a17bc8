"""The form that every model of one output with lagged regressors lowers to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.models.channels.ends import read_now
from sysid.models.channels.scaling import Scaling
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.lagged.lagged_form import AbstractLaggedForm
from sysid.models.orders.activations import PLAIN
from sysid.models.orders.lags import Lags
from sysid.models.orders.output_limits import Between


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
class Recursion(AbstractLaggedForm):
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
    def n_inputs(self) -> int:
        """Number of inputs."""
        return self.lags.n_inputs

    @property
    def output_limits(self) -> tuple[Between, ...]:
        """Limits of the output in its unit."""
        return (self.between,)

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

    @cached_property
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

    def reads_now(self, inputs: tuple[str, ...]) -> frozenset[str]:
        """Inputs that it reads with a lag of 0."""
        return read_now(inputs, self.lags.inputs)
