"""The form of networks with several outputs: a recursion in which each output reads the past of all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.ends import read_now
from sysid.models.channels.scaling import VectorScaling
from sysid.models.contract.column_recursion import ColumnRecursion
from sysid.models.lagged.lagged_form import AbstractLaggedForm
from sysid.models.orders.activations import PLAIN
from sysid.models.orders.lags import Lags
from sysid.models.orders.output_limits import Between


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorRecursion(AbstractLaggedForm):
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
    def output_limits(self) -> tuple[Between, ...]:
        """Limits of each output in its unit; empty for none."""
        return self.between

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
