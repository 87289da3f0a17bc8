"""Polynomials as a chart: their coefficients are the parameters, their state space is what predicts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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
        """Derivatives of each matrix with respect to the coefficients; not to be changed, others have them too."""
        return self._moved(theta) if min(self.orders.nk, default=1) == 0 else self._same_everywhere

    @cached_property
    def _same_everywhere(self) -> Directions:
        """Where no input acts at once: each entry is then a coefficient, or a difference of two."""
        return self._moved(np.zeros(self.n_parameters))

    def _moved(self, theta: Array) -> Directions:
        moved = [self.orders.polynomials(theta + 1j * STEP * unit).system() for unit in np.eye(self.n_parameters)]
        parts = {
            name: np.stack([np.imag(getattr(one, name)) / STEP for one in moved], axis=-1)
            for name in ("A", "B", "C", "D", "K", "constant")
        }
        return Directions(**parts)
