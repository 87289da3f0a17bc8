r"""The basis in which a network is trained: the incremental (delta) form in place of neighbouring samples.

Neighbouring samples of a fast-sampled signal are nearly equal, and what drives the next output is often their
difference, two or three orders of magnitude smaller. In the plain regressors a dependence on a rate takes two large
weights of opposite sign, which a random start does not have and any prior on the weights forbids; the network then
learns levels that happen to go with the outputs of the training record, and fails on the next record. Training
therefore sees

.. math:: x' = T (x - m)

where each input's newest sample stays, its older ones become divided differences of neighbours, the levels of the
inputs are rotated to be uncorrelated, and every entry is scaled by its largest magnitude in the training records.
:math:`T` is square and regular: the set of networks is the same, what changes is which of them are simple.
Parameters go back by :math:`W = W' T`, :math:`b = b' - W' T m`, and likewise for the linear part and the gates, so that
the finished model knows nothing of the basis.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.networks.initialise import Layout
from sysid.models import Lags

SMALLEST = 1e-6
"""Scale below which a regressor counts as constant, as a share of the scaled range: a feature that hardly moves must
not be blown up to full size."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RegressorBasis:
    """The change of regressors ``x' = matrix (x - centre)``.

    Args:
        matrix: ``T``, shape ``(n_regressors, n_regressors)``, regular.
        centre: ``m``, shape ``(n_regressors,)``.
    """

    matrix: NDArray[np.float64]
    centre: NDArray[np.float64]

    @classmethod
    def identity(cls, lags: Lags) -> RegressorBasis:
        """The plain regressors.

        Args:
            lags: The regressors.

        Returns:
            The basis that changes nothing.
        """
        return cls(matrix=np.eye(lags.n_regressors), centre=np.zeros(lags.n_regressors))

    @classmethod
    def incremental(cls, lags: Lags, regressors: NDArray[np.float64]) -> RegressorBasis:
        """Levels and rates, scaled to the training records.

        Args:
            lags: The regressors.
            regressors: Their scaled values over all records, shape ``(n_samples, n_regressors)``.

        Returns:
            The basis.
        """
        matrix, levels = _differences(lags)
        centre = regressors.mean(axis=0)
        away = regressors - centre
        matrix = _unit_peaks(matrix, away)
        if len(levels) > 1 and len(regressors) > 1:  # a single row has no directions
            _, rotation = linalg.eigh(np.cov((away @ matrix.T)[:, levels].T))
            matrix[levels] = rotation.T @ matrix[levels]
            matrix = _unit_peaks(matrix, away)
        return cls(matrix=matrix, centre=centre)

    def to_plain(self, layout: Layout) -> NDArray[np.float64]:
        """The linear map from parameters in this basis to parameters over the plain regressors.

        Args:
            layout: Where the parameters stand.

        Returns:
            Shape ``(n_parameters, n_parameters)``.
        """
        r, k = layout.lags.n_regressors, layout.neurons
        P = np.eye(layout.n_parameters)
        shift = self.matrix @ self.centre
        # Each row of weights with the constant that takes up the shift of its regressors.
        rows = [(neuron * r, k * r + neuron) for neuron in range(k)]
        if layout.gated:
            rows += [(layout.gates.start + neuron * r, layout.readout.start + neuron) for neuron in range(k)]
        if layout.linear:
            rows += [(layout.linear_part(j).start, layout.affine.start + j) for j in range(len(layout.outputs))]
        for first, constant in rows:
            weights = slice(first, first + r)
            P[weights, weights] = self.matrix.T
            P[constant, weights] = -shift
        return P


def _differences(lags: Lags) -> tuple[NDArray[np.float64], list[int]]:
    """Rows that leave each input's newest lag and turn its older ones into slopes; and which rows are input levels.

    Lags of the output stay: in a free run the output's rate carries the model's own error, and a basis that magnifies
    it makes the first steps of training unstable.
    """
    matrix = np.eye(lags.n_regressors)
    levels, row = [], 0
    for channel in lags.inputs:
        if channel:
            levels.append(row)
            for offset, (newer, older) in enumerate(pairwise(channel), start=row + 1):
                matrix[offset, offset - 1], matrix[offset, offset] = np.array([1.0, -1.0]) / (older - newer)
            row += len(channel)
    return matrix, levels


def _unit_peaks(matrix: NDArray[np.float64], away: NDArray[np.float64]) -> NDArray[np.float64]:
    peaks = np.abs(away @ matrix.T).max(axis=0)
    return np.asarray(matrix / np.where(peaks > SMALLEST, peaks, 1.0)[:, None])


@dataclass(frozen=True, kw_only=True, eq=False)
class RebasedProvider(AbstractProvider):
    """A provider whose parameters stand in another basis.

    Args:
        inner: The provider over plain regressors.
        to_plain: From parameters in the basis to plain ones, shape ``(n_parameters, n_in_basis)``.
        between: Least and greatest of each parameter in the basis; ``None`` for no bounds.
    """

    inner: AbstractProvider
    to_plain: NDArray[np.float64]
    between: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
    n_samples: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "n_samples", self.inner.n_samples)

    @property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Of the parameters in the basis; see the base class."""
        return self.between

    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; see the base class."""
        return self.inner.loss(self.to_plain @ theta)

    def linearise(self, theta: NDArray[np.float64], *, correlation: bool = True) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix with respect to the parameters in the basis."""
        P = self.to_plain
        at = self.inner.linearise(P @ theta, correlation=correlation)
        return replace(at, gradient=P.T @ at.gradient, gauss_newton=P.T @ at.gauss_newton @ P)
