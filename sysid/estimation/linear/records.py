r"""Records that a transfer function is fitted to, in the time or the frequency domain.

A record turns the bases of all inputs into columns, and the model's output is linear in them. The derivative of an
output :math:`y_j = B/F\,u_j` with respect to the denominator of section :math:`i`, at a fixed numerator, is one more
pass through that section alone,

.. math:: \frac{\partial y_j}{\partial c_{i,k}} = -\frac{q^{-k}}{F_i}\,y_j \qquad(\text{or } s^k),

because :math:`\partial F / \partial c_{i,k} = q^{-k} F/F_i`: the whole gradient costs as many passes as the output.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.predictor import MirroredPredictor
from sysid.models.converting.orthonormal_basis import BasisSection, Domain, basis_of

Bases = tuple[tuple[BasisSection, ...], ...]
"""The basis of each input."""


class AbstractRecord(ABC):
    """One experiment as columns."""

    target: NDArray[np.float64]
    """Shape ``(n_rows,)``."""
    root_weights: NDArray[np.float64]
    """Square root of each row's weight, shape ``(n_rows,)``."""

    @abstractmethod
    def private(self, bases: Bases) -> int:
        """Number of columns that belong to this record alone, such as its initial state.

        Args:
            bases: One per input.

        Returns:
            The number.
        """

    @abstractmethod
    def columns(self, bases: Bases) -> NDArray[np.float64]:
        """Every tap of every input, then the record's own columns.

        Args:
            bases: One per input.

        Returns:
            Shape ``(n_rows, n_taps_of_all + n_private)``, unweighted.
        """

    def predictor(self, bases: Bases) -> MirroredPredictor | None:  # noqa: ARG002 - asked of records over time
        """Through what the errors are computed where poles are so unstable that a free run is lost.

        Args:
            bases: One per input.

        Returns:
            The predictor; ``None`` where errors are those of the free run.
        """
        return None

    @abstractmethod
    def tangents(self, bases: Bases, columns: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivatives of the output with respect to the sections' coefficients, at fixed numerators.

        Args:
            bases: One per input.
            columns: From :meth:`columns`.
            weights: What the columns are multiplied with, shape ``(n_taps_of_all + n_private,)``.

        Returns:
            Shape ``(n_rows, n_coefficients)``: input by input, section by section, ``c1`` before ``c2`` or ``c0``.
        """


@lru_cache(maxsize=32)
def full(bases: Bases, domain: Domain) -> Bases:
    """The same sections with all numerators below the number of poles: the space of free responses.

    Args:
        bases: One per input.
        domain: Their domain.

    Returns:
        One basis per input.
    """
    return tuple(
        basis_of([section.denominator for section in basis], sum(section.order for section in basis) - 1, domain)
        for basis in bases
    )


@lru_cache(maxsize=64)
def tap_slices(bases: Bases) -> tuple[slice, ...]:
    """Where each input's taps stand among all columns.

    Args:
        bases: One per input.

    Returns:
        One slice per input.
    """
    ends = np.cumsum([sum(len(section.taps) for section in basis) for basis in bases])
    return tuple(slice(int(end - n), int(end)) for end, n in zip(ends, np.diff([0, *ends]), strict=True))
