"""Fitted polynomial models, for one output and any number of inputs.

What is run, exported and differentiated is the state space of their polynomials in observer form.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.models.channels.mapping import Mapping
from sysid.models.channels.scaling import Scaling
from sysid.models.contract.flat import as_many
from sysid.models.contract.ratio import Ratio
from sysid.models.converting.to_control import Matrices
from sysid.models.linear.innovation_moves import InnovationModel
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.linear_forms import LinearForms
from sysid.models.linear.polynomial_orders import AbstractPolynomial, Polynomials
from sysid.models.linear.state_space import StateSpace

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class PolynomialModel(LinearForms, InnovationModel):
    """A fitted polynomial model.

    Args:
        orders: The structure.
        theta: Coefficients in scaled numbers, in the order of :meth:`AbstractPolynomial.names`.
        scaling: Between units and scaled numbers.
        mapping: Which channels go in, which comes out.
        sample_time: Seconds.
        input_units: Unit of each input.
        output_unit: Unit of the output.
        rest_output: Output at rest, in its unit.
    """

    orders: AbstractPolynomial
    theta: Array
    scaling: Scaling
    mapping: Mapping
    sample_time: float
    input_units: tuple[str, ...]
    output_unit: str
    rest_output: float

    structure_field = "orders"

    def __post_init__(self) -> None:
        theta = np.array(self.theta, dtype=np.float64)
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)

    @property
    def structure(self) -> AbstractPolynomial:
        """The orders."""
        return self.orders

    @property
    def n_parameters(self) -> int:
        """Coefficients and, if fitted, the constant."""
        return self.orders.n_parameters

    @cached_property
    def polynomials(self) -> Polynomials:
        """The polynomials in scaled numbers."""
        return self.orders.polynomials(self.theta)

    @cached_property
    def system(self) -> Innovations:
        """Their state space in scaled numbers."""
        return self.polynomials.system()

    @cached_property
    def recursion(self) -> StateSpace:
        """The form that is run."""
        return StateSpace.of(self.system, self.scaling, noise=self.orders.noise)

    @property
    def vector(self) -> NDArray[np.float64]:
        """Its coefficients in scaled numbers."""
        return self.theta

    def with_theta(self, theta: NDArray[np.float64]) -> PolynomialModel:
        """The same model with other numbers, in the order of :attr:`vector`."""
        return replace(self, theta=as_many(theta, len(self.theta)))

    @property
    def gains(self) -> Array:
        """What each of its scaled coefficients is multiplied with in the channels' units."""
        found, first = np.ones(len(self.theta)), 0
        for j, nb in enumerate(self.orders.nb):
            found[first : first + nb] = self.scaling.output_scale / self.scaling.input_scale[j]
            first += nb
        found[len(found) - self.orders.level :] = self.scaling.output_scale
        return found

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Poles of what the inputs drive, in the z plane."""
        p = self.polynomials
        return np.concatenate([np.roots(one).astype(np.complex128) for one in (p.A, *p.F)])

    @property
    def pole_radius(self) -> float:
        """Magnitude of the largest pole of what the inputs drive."""
        return float(np.abs(self.poles).max(initial=0.0))

    def ratio(self, j: int) -> Ratio:
        """From one input to the output, in ``1/z``."""
        p, name, delay = self.polynomials, self.mapping.inputs[j], self.orders.nk[j]
        common = len(p.A) > 1
        gain = self.scaling.output_scale / self.scaling.input_scale[j]
        return Ratio(
            B=gain * p.B[j][delay:], F=p.A if common else p.F[j], delay=delay, discrete=True,
            of_numerator=f"B({name}, ", of_denominator="A(" if common else f"F({name}, ",
        )  # fmt: skip

    @property
    def matrices(self) -> Matrices:
        """The state space in the channels' units."""
        gain, scale = self.scaling.output_scale, np.array(self.scaling.input_scale)
        return self.system.A, self.system.B / scale, gain * self.system.C, gain * self.system.D / scale

    def _written(self) -> dict[str, Any]:
        return {"scaling": self.scaling.to_dict(), "theta": self.theta.tolist()}

    @staticmethod
    def _read(fields: Dict[str, Any]) -> dict[str, Any]:
        return {
            "scaling": Scaling.from_dict(fields["scaling"]),
            "theta": np.array(fields["theta"], dtype=np.float64),
        }
