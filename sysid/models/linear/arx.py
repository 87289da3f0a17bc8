"""ARX: the output as a linear function of its own past and of past inputs."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, shortened
from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling
from sysid.models.contract.flat import as_many
from sysid.models.contract.ratio import Ratio
from sysid.models.converting.realisation import observer_row
from sysid.models.converting.to_control import Matrices
from sysid.models.lagged.recursion import Recursion
from sysid.models.linear.linear_forms import LinearForms
from sysid.models.orders.lags import MOST, Lagged, Lags, whole
from sysid.models.orders.ranges import IntRange
from sysid.models.orders.structure import AbstractStructure


@dataclass(frozen=True, kw_only=True)
class ARX(AbstractStructure):
    """Orders of an ARX model, as in MATLAB's ``arx``.

    Of several outputs it is a model an output, each of which reads its own past; where they read each other's too, in
    one model, it is :class:`~sysid.models.VectorARX`.

    Args:
        na: Number of past outputs.
        nb: Number of past values of each input, or one number for all; empty, as ``nk``, for a record without input
            (an AR model).
        nk: Dead time of each input in samples, or one for all.
        intercept: Fit a constant beside the lags. Without it, or data as deviations from an operating
            point, an ARX model of pressures around 90 psi is not judged fairly.

    Raises:
        ConfigError: If an order is negative, or ``nb`` and ``nk`` differ in length.

    Example:
        >>> ARX(na=2, nb=(2,), nk=(3,)).label
        'ARX [2; 2; 3]'
    """

    na: Annotated[int, IntRange(low=1, high=30)]
    nb: Annotated[tuple[int, ...], IntRange(low=1, high=30)]
    nk: Annotated[tuple[int, ...], IntRange(low=0, high=3)]
    intercept: bool = True

    kind = "ARX"
    per_input = ("nb", "nk")

    def __post_init__(self) -> None:
        self._listed(*self.per_input)
        if not all(map(whole, (self.na, *self.nb, *self.nk))) or len(self.nb) != len(self.nk):
            raise ConfigError(
                "not the orders of an ARX model",
                expected=f"na from 0 on, and one nb and one nk from 0 on for each input, or one for all, whole "
                f"numbers up to {MOST:,}",
                got=f"na = {shortened(self.na)}, nb = {shortened(list(self.nb))}, nk = {shortened(list(self.nk))}",
                remedy="of outputs that read each other's past write VectorARX, with the same orders"
                if any(isinstance(one, list | tuple) for one in (self.na, *self.nb, *self.nk))
                else "write for example na: 2, nb: [2, 2], nk: [1, 1]",
            )

    @property
    def label(self) -> str:
        """As MATLAB writes the orders."""
        if not self.nb:
            return f"AR [{self.na}]"
        return f"ARX [{self.na}; {' '.join(map(str, self.nb))}; {' '.join(map(str, self.nk))}]"

    @property
    def lags(self) -> Lags:
        """The regressors."""
        inputs = tuple(tuple(range(nk, nk + nb)) for nb, nk in zip(self.nb, self.nk, strict=True))
        return Lags(inputs=inputs, output=tuple(range(1, self.na + 1)))

    def lagged(self, n_inputs: int) -> Lagged:
        """Linear in its regressors."""
        return Lagged(lags=self.for_inputs(n_inputs).lags)

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        return {"kind": self.kind, "na": self.na, "nb": list(self.nb), "nk": list(self.nk), "intercept": self.intercept}


@dataclass(frozen=True, kw_only=True, eq=False)
class ARXModel(LinearForms):
    r"""A fitted ARX model, in the channels' units.

    :math:`\hat y_t = d + \sum_i a_i y_{t-i} + \sum_j \sum_i b_{j,i} u_{j,t-n_{k,j}-i}`. Note the sign: MATLAB's
    polynomial :math:`A(q)` has :math:`-a_i`.

    Args:
        orders: The structure.
        coefficients: ``[b of input 1 | b of input 2 | ... | a]``, shape ``(n_regressors,)``.
        intercept: The constant ``d`` in the output's unit.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
    """

    orders: ARX
    coefficients: NDArray[np.float64]
    intercept: float
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    rest_output: float

    structure_field = "orders"

    def __post_init__(self) -> None:
        coefficients = np.array(self.coefficients, dtype=np.float64)
        coefficients.setflags(write=False)
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "input_units", tuple(self.input_units))

    @property
    def structure(self) -> ARX:
        """The orders."""
        return self.orders

    @property
    def n_parameters(self) -> int:
        """Coefficients and, if fitted, the intercept."""
        return len(self.coefficients) + self.orders.intercept

    @property
    def a(self) -> NDArray[np.float64]:
        """Coefficients of the past outputs, shape ``(na,)``."""
        return self.coefficients[len(self.coefficients) - self.orders.na :]

    @property
    def b(self) -> tuple[NDArray[np.float64], ...]:
        """For each input the coefficients of its past values, shapes ``(nb_j,)``."""
        ends = np.cumsum(self.orders.nb, dtype=np.intp)
        return tuple(np.split(self.coefficients[: ends[-1]], ends[:-1])) if len(ends) else ()

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles in the z plane, shape ``(na,)``; a free run is stable if all lie inside the unit circle."""
        return np.asarray(np.roots([1.0, *(-self.a)]), dtype=np.complex128)

    def with_theta(self, theta: NDArray[np.float64]) -> ARXModel:
        """The same model with another constant and other coefficients, in this order."""
        theta = as_many(theta, 1 + len(self.coefficients))
        return replace(self, intercept=float(theta[0]), coefficients=theta[1:])

    def innovation_responses(self, steps: int) -> NDArray[np.float64]:
        """Of the outputs to an innovation: ``1 / A``; see the base class."""
        found = np.zeros(steps)
        found[0] = 1.0
        for k in range(1, steps):
            past = found[max(k - self.orders.na, 0) : k][::-1]
            found[k] = self.a[: len(past)] @ past
        return found.reshape(-1, 1, 1)

    def ratio(self, j: int) -> Ratio:
        """From one input to the output, in ``1/z``; all inputs share the denominator."""
        return Ratio(
            B=self.b[j], F=np.concatenate([[1.0], -self.a]), delay=self.orders.nk[j], discrete=True,
            of_numerator=f"b({self.mapping.inputs[j]}, ", of_denominator="a(", past_outputs=True,
        )  # fmt: skip

    @property
    def pole_radius(self) -> float:
        """Magnitude of the largest pole; 0 without any."""
        return float(np.abs(self.poles).max(initial=0.0))

    @property
    def recursion(self) -> Recursion:
        """The same model as a recursion without neurons and without scaling."""
        theta = np.concatenate([[self.intercept], self.coefficients])
        return Recursion(
            lags=self.orders.lags, neurons=0, theta=theta, scaling=Scaling.identity(len(self.mapping.inputs))
        )

    @property
    def matrices(self) -> Matrices:
        """A state space of it, in observer form: as many states as its longest lag."""
        ups = {
            j: np.concatenate([np.zeros(nk), b]) for j, (nk, b) in enumerate(zip(self.orders.nk, self.b, strict=True))
        }
        A, B, C, D = observer_row([(np.concatenate([[1.0], -self.a]), ups)], len(ups))
        return A, B, C, D

    def _written(self) -> dict[str, Any]:
        return {"coefficients": self.coefficients.tolist(), "intercept": self.intercept}

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {
            "coefficients": np.array(fields["coefficients"], dtype=np.float64),
            "intercept": fields["intercept"],
        }
