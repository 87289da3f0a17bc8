"""Fitted NARX networks, of one output and of several."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling, VectorScaling
from sysid.models.contract.several_outputs import SeveralOutputs
from sysid.models.lagged.cascade_program import Limit
from sysid.models.lagged.recursion import Recursion
from sysid.models.lagged.vector_recursion import VectorRecursion
from sysid.models.networks.narx_structures import NARX, VectorNARX
from sysid.models.networks.network_model import NetworkModel
from sysid.models.orders.lags import Lags
from sysid.models.orders.output_limits import Between

CLAMP = 3.0
"""Bound of the output in scaled numbers. Training data lie within -1 to 1; a free run that leaves three times
that range is lost, and the bound keeps it finite, in training and wherever the model runs later."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NARXModel(NetworkModel):
    """A fitted NARX network.

    Args:
        network: The structure.
        theta: Flat parameters ``[W | b | v | c | w | V]`` in scaled numbers (see :class:`Recursion`).
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
        clamp: Bound of the output in scaled numbers; infinite for none.
        between: Limits between which it is held, in its unit.
    """

    network: NARX
    theta: NDArray[np.float64]
    scaling: Scaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    rest_output: float
    clamp: float = CLAMP
    between: Between = (None, None)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "between", tuple(self.between))

    @property
    def structure(self) -> NARX:
        """Delays and neurons."""
        return self.network

    @property
    def limits(self) -> Dict[str, Limit]:
        """What holds its output, as a cascade has it."""
        low, high = self.between
        return {} if low is None and high is None else {self.mapping.output: Limit(low=low, high=high)}

    @property
    def recursion(self) -> Recursion:
        """The form that is run and exported."""
        return Recursion(
            lags=self.network.lags(len(self.mapping.inputs)),
            neurons=self.network.neurons,
            theta=self.theta,
            scaling=self.scaling,
            low=-self.clamp,
            high=self.clamp,
            between=self.between,
            activation=self.network.activation,
        )

    def _written(self) -> dict[str, Any]:
        return super()._written() | ({"between": list(self.between)} if self.limits else {})

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return NetworkModel._read(fields) | {"between": tuple(fields.get("between", (None, None)))}


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorNARXModel(NetworkModel, SeveralOutputs):
    r"""A fitted network with several outputs.

    In scaled numbers :math:`\hat y_t = \mathrm{clip}(w x_t + c + V\,\sigma(W x_t + b))` with one row of :math:`w` and
    :math:`V` for each output, and the past of all outputs in :math:`x_t`.

    Args:
        network: The structure.
        theta: Flat parameters ``[W (neurons, regressors) | b | V (outputs, neurons) | c | w (outputs, regressors)]``.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which come out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_units: Unit of each output.
        rest_outputs: Each output at rest, in its unit.
        clamp: Bound of every output in scaled numbers.
        between: Limits between which each output is held, in its unit; empty where none is.

    Raises:
        TraceError: If the parameters do not fit the structure.
    """

    network: VectorNARX
    theta: NDArray[np.float64]
    scaling: VectorScaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]
    clamp: float = CLAMP
    between: tuple[Between, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "between", tuple(tuple(sides) for sides in self.between))
        for name in ("output_units", "rest_outputs"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        count = self.network.parameter_count(len(self.mapping.inputs), len(self.mapping.outputs))
        if self.theta.shape != (count,):
            raise TraceError(
                "the parameter vector does not fit the structure",
                expected=f"{count} parameters",
                got=f"shape {self.theta.shape}",
                remedy="use parameters that were fitted with this structure",
            )

    @property
    def structure(self) -> VectorNARX:
        """Delays and neurons."""
        return self.network

    @property
    def lags(self) -> Lags:
        """The regressors over inputs and outputs."""
        return self.network.lags(len(self.mapping.inputs), len(self.mapping.outputs))

    @property
    def limits(self) -> Dict[str, Limit]:
        """What holds its outputs, as a cascade has it."""
        sides = zip(self.mapping.outputs, self.between, strict=False)
        return {name: Limit(low=low, high=high) for name, (low, high) in sides if (low, high) != (None, None)}

    @cached_property
    def recursion(self) -> VectorRecursion:
        """The form that is run and exported."""
        return VectorRecursion(
            lags=self.lags,
            n_outputs=len(self.mapping.outputs),
            neurons=self.network.neurons,
            theta=self.theta,
            linear=self.network.feedthrough,
            scaling=self.scaling,
            low=-self.clamp,
            high=self.clamp,
            between=self.between,
            activation=self.network.activation,
        )

    def _written(self) -> dict[str, Any]:
        return super()._written() | ({"between": [list(sides) for sides in self.between]} if self.limits else {})

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        between = tuple(tuple(sides) for sides in fields.get("between", ()))
        return NetworkModel._read(fields) | {"between": between}
