"""Records over frequency that a transfer function is fitted to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.records import AbstractRecord, Bases, tap_slices
from sysid.models.converting.orthonormal_basis import BasisSection, Domain, powers_of, responses


@dataclass(frozen=True, kw_only=True, eq=False)
class SpectralRecord(AbstractRecord):
    """A record over frequency, in scaled numbers; real parts of all points, then imaginary parts.

    Args:
        inputs: Input spectra with their dead times, shape ``(n_points, n_inputs)``.
        variable: ``1/z`` or ``s`` at each point, shape ``(n_points,)``.
        target: Output spectrum, real then imaginary parts, shape ``(2 n_points,)``.
        root_weights: Square root of each row's weight, shape ``(2 n_points,)``.
        domain: Of the bases.
    """

    inputs: NDArray[np.complex128]
    variable: NDArray[np.complex128]
    target: NDArray[np.float64]
    root_weights: NDArray[np.float64]
    domain: Domain

    def private(self, bases: Bases) -> int:  # noqa: ARG002 - spectra are those of a steady state
        """None; see the base class."""
        return 0

    def columns(self, bases: Bases) -> NDArray[np.float64]:
        """Frequency responses of the taps; see the base class."""
        return _stacked(np.concatenate([self._taps(j, basis) for j, basis in enumerate(bases)], axis=1))

    def tangents(self, bases: Bases, columns: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """One more factor per section; see the base class."""
        parts = []
        n = len(self.variable)
        for basis, at in zip(bases, tap_slices(bases), strict=True):
            y = columns[:, at] @ weights[at]
            complex_y = y[:n] + 1j * y[n:]
            for section in basis:
                powers = powers_of(self.variable, section.order)
                v = -complex_y / (powers @ section.denominator)
                discrete = self.domain is Domain.DISCRETE
                chosen = range(1, section.order + 1) if discrete else range(section.order - 1, -1, -1)
                parts += [v * powers[:, k] for k in chosen]
        return _stacked(np.column_stack(parts))

    def _taps(self, j: int, basis: tuple[BasisSection, ...]) -> NDArray[np.complex128]:
        return responses(basis, self.variable) * self.inputs[:, j : j + 1]


def _stacked(table: NDArray[np.complex128]) -> NDArray[np.float64]:
    return np.concatenate([table.real, table.imag])
