"""ARX models of several outputs: a matrix of polynomials in the past of all outputs, and one in that of the inputs."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import VectorScaling
from sysid.models.contract.flat import as_many
from sysid.models.contract.ratio import Ratio
from sysid.models.converting.continuous import ContinuousStateSpace, rates
from sysid.models.converting.to_control import Matrices
from sysid.models.lagged.vector_recursion import VectorRecursion
from sysid.models.linear.linear_forms import VectorLinearForms
from sysid.models.linear.polynomial_matrices import PolynomialMatrices
from sysid.models.linear.vector_arx_orders import VectorARX


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorARXModel(VectorLinearForms):
    r"""A fitted ARX model of several outputs, in the channels' units.

    :math:`\hat y_t = d + \sum_k A_k y_{t-k} + \sum_k B_k u_{t-k}`. Note the sign: MATLAB's polynomial matrix
    :math:`A(q)` has :math:`-A_k`.

    Args:
        orders: The structure, with an entry for each output and each channel that it reads.
        coefficients: Output by output ``[b of input 1 | b of input 2 | ... | a of output 1 | ...]``, shape
            ``(n_coefficients,)``.
        intercepts: The constant ``d`` of each output, in its unit, shape ``(n_outputs,)``.
        mapping: Which channels go in, which come out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_units: Unit of each output.
        rest_outputs: Each output at rest, in its unit.

    Raises:
        TraceError: If there are not as many coefficients as the structure has.
    """

    orders: VectorARX
    coefficients: NDArray[np.float64]
    intercepts: NDArray[np.float64]
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    rest_outputs: tuple[float, ...]

    structure_field = "orders"

    def __post_init__(self) -> None:
        orders = self.orders.sized(len(self.mapping.inputs), len(self.mapping.outputs))
        object.__setattr__(self, "orders", orders)
        for name, n in (("coefficients", len(orders.terms)), ("intercepts", len(self.mapping.outputs))):
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.shape != (n,):
                raise TraceError(
                    f"the {name} do not fit the structure",
                    expected=f"{n} numbers",
                    got=f"shape {values.shape}",
                    remedy="use those that were fitted with this structure",
                )
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        for name in ("input_units", "output_units", "rest_outputs"):
            object.__setattr__(self, name, tuple(getattr(self, name)))

    @property
    def structure(self) -> VectorARX:
        """The orders."""
        return self.orders

    @property
    def n_parameters(self) -> int:
        """Coefficients and, if fitted, the intercepts."""
        return len(self.coefficients) + len(self.intercepts) * self.orders.intercept

    @cached_property
    def polynomials(self) -> PolynomialMatrices:
        """Its two matrices of polynomials."""
        return PolynomialMatrices(terms=self.orders.terms, values=self.coefficients, sizes=self._sizes)

    @property
    def _sizes(self) -> tuple[int, int]:
        return len(self.mapping.outputs), len(self.mapping.inputs)

    @property
    def a(self) -> NDArray[np.float64]:
        """Coefficients of past outputs, shape ``(n_lags, n_outputs, n_outputs)``: ``a[0]`` is that of the lag 1."""
        return -self.polynomials.A[1:]

    @property
    def b(self) -> NDArray[np.float64]:
        """Coefficients of inputs, shape ``(n_lags, n_outputs, n_inputs)``: ``b[0]`` is that of the same sample."""
        return self.polynomials.B

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles in the z plane, the roots of ``det A``; a free run is stable if all lie inside the unit circle."""
        return self.polynomials.poles

    @property
    def pole_radius(self) -> float:
        """Magnitude of the largest pole; 0 without any."""
        return float(np.abs(self.poles).max(initial=0.0))

    @property
    def ratios(self) -> dict[tuple[int, int], Ratio]:
        """From each input to each output, in ``1/z``; all share the denominator ``det A``."""
        found = self.polynomials
        return {
            (o, j): Ratio(
                B=found.numerator(o, j), F=found.denominator, delay=found.delay(o, j), discrete=True,
                of_numerator=f"B({output}, {name}, ", of_denominator="F(", asks=max(row[j] for row in self.orders.nb),
            )
            for o, output in enumerate(self.mapping.outputs)
            for j, name in enumerate(self.mapping.inputs)
        }  # fmt: skip

    @cached_property
    def _places(self) -> tuple[NDArray[np.intp], int]:
        """Where each coefficient stands in the flat parameters of the recursion, and their number."""
        n_outputs, lags = len(self.mapping.outputs), self.orders.lags
        columns = {pair: at for at, pair in enumerate((c, lag) for c, own in enumerate(lags.inputs) for lag in own)}
        at = [n_outputs + i * len(columns) + columns[channel, lag] for i, channel, lag in self.orders.terms]
        return np.array(at, dtype=np.intp), n_outputs * (1 + len(columns))

    def spread(self, coefficients: NDArray[np.float64], intercepts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of coefficients and of intercepts as flat parameters of the recursion, where others are 0.

        Args:
            coefficients: Shape ``(n_coefficients, ...)``.
            intercepts: Shape ``(n_outputs, ...)``.

        Returns:
            Shape ``(n_parameters of the recursion, ...)``.
        """
        places, n = self._places
        theta = np.zeros((n, *coefficients.shape[1:]))
        theta[: len(intercepts)], theta[places] = intercepts, coefficients
        return theta

    def with_theta(self, theta: NDArray[np.float64]) -> VectorARXModel:
        """The same model with other parameters, those of the recursion; what no coefficient stands at is not read."""
        places, n = self._places
        theta = as_many(theta, n)
        return replace(self, intercepts=theta[: len(self.intercepts)], coefficients=theta[places])

    @cached_property
    def recursion(self) -> VectorRecursion:
        """The same model as a recursion without neurons and without scaling."""
        m, n = self._sizes[1], self._sizes[0]
        scaling = VectorScaling(
            input_offset=(0.0,) * m, input_scale=(1.0,) * m, output_offset=(0.0,) * n, output_scale=(1.0,) * n
        )
        theta = self.spread(self.coefficients, self.intercepts)
        return VectorRecursion(
            lags=self.orders.lags, n_outputs=n, neurons=0, theta=theta, linear=True, scaling=scaling
        )  # fmt: skip

    def innovation_responses(self, steps: int) -> NDArray[np.float64]:
        """Of the outputs to innovations: the inverse of ``A``; see the base class."""
        a, n = self.a, len(self.mapping.outputs)
        found = np.zeros((steps, n, n))
        found[0] = np.eye(n)
        for k in range(1, steps):
            for lag in range(1, min(k, len(a)) + 1):
                found[k] += a[lag - 1] @ found[k - lag]
        return found

    @property
    def matrices(self) -> Matrices:
        """A state space of it, in observer form: as many states an output as its longest lag."""
        return self.polynomials.observer((0,) * len(self.mapping.inputs))

    def continuous(self) -> ContinuousStateSpace:
        """The continuous system whose samples the model gives when its inputs are held, as ``d2c`` by zoh.

        Returns:
            The system in the channels' units, dead times that all outputs share beside it in seconds.

        Raises:
            ConfigError: If a pole is zero or negative, or an output has longer lags of an input, past those dead times,
                than of outputs: no continuous system of this order acts so.
        """
        late = [max(min(rows) - 1, 0) for rows in zip(*self.orders.nk, strict=True)]
        A, B, C, D = self.polynomials.observer(late)
        if len(A) > len(self.poles):
            raise ConfigError(
                "no continuous system of this order gives the discrete one",
                expected=f"{len(self.poles)} states, one for each pole",
                got=f"{len(A)} with all lags",
                remedy="fit it with fewer coefficients of inputs (nb), with one nk an input, or with as many lags of "
                "every output (na); or fit a state space",
            )
        remedy = "fit fewer past outputs (na), or a state space: such a pole mostly describes noise"
        A, B = rates(A, B, self.sample_time, remedy=remedy)
        delays = tuple(k * self.sample_time for k in late)
        return ContinuousStateSpace(A=A, B=B, C=C, D=D, delays=delays, mapping=self.mapping)

    def _written(self) -> dict[str, Any]:
        return {"coefficients": self.coefficients.tolist(), "intercepts": self.intercepts.tolist()}

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {name: np.array(fields[name], dtype=np.float64) for name in ("coefficients", "intercepts")}
