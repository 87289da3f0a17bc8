"""Polynomials as a chart: their coefficients are the parameters, their state space is what predicts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.state_space.coordinates import Directions
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.polynomial_orders import AbstractPolynomial

Array = NDArray[np.float64]

STEP = 1e-30
"""Along the imaginary axis: entries are products and sums of coefficients, so that such derivatives are exact."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PolynomialChart:
    """The state space of some polynomials as a function of their coefficients.

    Args:
        orders: The structure.
    """

    orders: AbstractPolynomial

    @property
    def n_parameters(self) -> int:
        """Length of the vector."""
        return self.orders.n_parameters

    def system(self, theta: Array) -> Innovations:
        """The system at some coefficients."""
        return self.orders.polynomials(theta).system()

    def directions(self, theta: Array) -> Directions:
        """Derivatives of each matrix with respect to the coefficients."""
        moved = [
            self.orders.polynomials(theta + 1j * STEP * unit).system() for unit in np.eye(self.n_parameters)
        ]  # fmt: skip
        parts = {
            name: np.stack([np.imag(getattr(one, name)) / STEP for one in moved], axis=-1)
            for name in ("A", "B", "C", "D", "K", "constant")
        }
        return Directions(**parts)
