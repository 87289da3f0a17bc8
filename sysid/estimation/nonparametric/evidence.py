r"""The evidence of a regularised regression, from one triangular factor of the data (Chen and Ljung 2013).

For :math:`y = \Phi g + v` with :math:`g \sim N(0, \sigma^2 L L^T)` and white :math:`v` of variance
:math:`\sigma^2`, everything that depends on the data is in the triangular factor :math:`[R\; z]` of
:math:`[\Phi\; y]`, however many samples there are. The noise variance, which the prior is counted in, is eliminated:
at its maximum the logarithm of the marginal likelihood is

.. math:: -\tfrac12\Bigl(N\ln\frac{r^2}{N} + 2\ln|\det R_a| + N(1 + \ln 2\pi)\Bigr),

where :math:`R_a` is the triangular factor of :math:`[R L;\, I]` and :math:`r^2` what is left of :math:`[z;\, 0]`
("Implementation of algorithms for tuning parameters in regularized least squares problems in system identification",
Automatica 49).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.linalg.blas import dtrmm
from scipy.linalg.lapack import dpotrf

from sysid.estimation.least_squares.small_matrices import add_to_diagonal, back_substituted

NOTHING = 1e-200
"""Least square that is said to be left of a target: of one that is 0 throughout, evidence stays a number."""
CHUNK = 2048
"""Rows that are taken into the factor at a time: memory does not grow with the record."""


WELL_SCALED, LEFT = 1e8, 1e-4
"""Largest entry of a matrix of products, and least part of the target that is left: with these, rounding (which is
squared in products) changes the evidence by less than 1e-8 of itself."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Triangle:
    """A regression as its triangular factor.

    Args:
        R: Of the columns, shape ``(n_rows, n_columns)``, no more rows than columns and one.
        z: Of the target, shape ``(n_rows,)``.
        samples: Rows of the regression, less those that unregularised columns have used up.
        floor: What rounding leaves of the target, squared, where it was once longer; 0 where it was not.
    """

    R: NDArray[np.float64]
    z: NDArray[np.float64]
    samples: int
    floor: float = 0.0

    @cached_property
    def gram(self) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Products of the columns with each other, with the target, and of the target with itself."""
        return self.R.T @ self.R, self.R.T @ self.z, float(self.z @ self.z)

    def columns(self, kept: NDArray[np.bool_]) -> Triangle:
        """The regression with some of its columns.

        Args:
            kept: Which, shape ``(n_columns,)``.

        Returns:
            The regression.
        """
        if kept.all():
            return self
        some = replace(self, R=self.R[:, kept])
        both, target, size = self.gram
        some.__dict__["gram"] = (both[np.ix_(kept, kept)], target[kept], size)
        return some

    @property
    def least(self) -> float:
        """What rounding leaves of the target, squared: of noise-free data it must not become an infinite reward."""
        return max(self.floor, float(np.finfo(np.float64).eps ** 2) * self.gram[2], NOTHING)

    def beside(self, others: NDArray[np.bool_], L: NDArray[np.float64]) -> tuple[Triangle, float]:
        """What is left for some columns once others and their prior have had their part.

        Where only those columns change, the evidence of all is that of what is left, less a constant: it costs what
        few columns cost.

        Args:
            others: Which, shape ``(n_columns,)``.
            L: The factor of their prior, as for :func:`factored`.

        Returns:
            The rest of the regression on all other columns, and the constant.
        """
        n = L.shape[1]
        if n == 0:
            return self, 0.0
        top = np.column_stack([self.R[:, others] @ L, self.R[:, ~others], self.z])
        R = linalg.qr(np.concatenate([top, np.eye(n, top.shape[1])]), mode="r", check_finite=False, overwrite_a=True)[0]
        determinant = float(np.sum(np.log(np.abs(np.diag(R)[:n]))))
        size = self.R.shape[1] + 1
        left = Triangle(R=R[n:size, n:-1], z=R[n:size, -1], samples=self.samples, floor=self.least)
        return left, determinant


def triangle(blocks: Iterable[NDArray[np.float64]], *, free: int) -> Triangle:
    """The triangular factor of a regression whose rows come in blocks.

    Args:
        blocks: Columns that are not regularised (levels), those that are, and the target, side by side.
        free: How many come first that are not regularised; what they explain is taken out.

    Returns:
        The factor of what is left.
    """
    R: NDArray[np.float64] | None = None
    samples = 0
    for block in blocks:
        samples += len(block)
        for first in range(0, len(block), CHUNK):
            part = block[first : first + CHUNK]
            stacked = part if R is None else np.concatenate([R, part])
            R = linalg.qr(stacked, mode="r", check_finite=False)[0][: stacked.shape[1]]
    assert R is not None  # noqa: S101 - callers have rows
    return Triangle(R=R[free:, free:-1], z=R[free:, -1], samples=samples - free)


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """What data and prior say together.

    Args:
        mean: Shape ``(n_columns,)``.
        covariance: Shape ``(n_columns, n_columns)``.
        noise_variance: Of the target's noise.
        log_evidence: Logarithm of the marginal likelihood.
        effective: Number of parameters that the data determine.
    """

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    noise_variance: float
    log_evidence: float
    effective: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Factored:
    """Data and prior in one triangular factor.

    Args:
        R: :math:`R_a`, shape ``(n_columns, n_columns)``.
        z: Its target, shape ``(n_columns,)``.
        rest: What is left of the target, squared; never less than rounding leaves of it.
        samples: As in the data.
    """

    R: NDArray[np.float64]
    z: NDArray[np.float64]
    rest: float
    samples: int

    @property
    def log_evidence(self) -> float:
        """Logarithm of the marginal likelihood at the best noise variance."""
        N = self.samples
        determinant = 2.0 * float(np.log(np.abs(self.R.diagonal())).sum())
        return float(-0.5 * (N * np.log(self.rest / N) + determinant + N * (1.0 + np.log(2.0 * np.pi))))


def factored(data: Triangle, L: NDArray[np.float64]) -> Factored:
    """Take the prior into the factor of the data.

    Args:
        data: The regression.
        L: Lower triangular factor of the prior's covariance in units of the noise variance, shape
            ``(n_columns, n_columns)``.

    Returns:
        The factor.
    """
    n = L.shape[1]
    quick = _from_products(data, L)
    if quick is not None:
        return quick
    top = np.column_stack([data.R @ L, data.z])
    stacked = np.concatenate([top, np.eye(n, n + 1)])
    R = linalg.qr(stacked, mode="r", check_finite=False, overwrite_a=True)[0]
    rest = max(float(np.sum(R[n:, n] ** 2)), data.least)
    return Factored(R=R[:n, :n], z=R[:n, n], rest=rest, samples=data.samples)


def _from_products(data: Triangle, L: NDArray[np.float64]) -> Factored | None:
    """The same from products, at a third of the price; ``None`` where rounding would show in them."""
    both, target, size = data.gram
    M = dtrmm(1.0, L.T, from_the_left(L, both), side=1, lower=0, trans_a=1, overwrite_b=1)
    if not M.diagonal().max(initial=0.0) < WELL_SCALED:
        return None
    add_to_diagonal(M, 1.0)
    R, wrong = dpotrf(M, lower=0, clean=1, overwrite_a=1) if len(M) else (M, 0)
    if wrong:
        return None
    z = back_substituted(R, L.T @ target, transposed=True)
    rest = size - float(z @ z)
    seen = rest > max(LEFT * size, data.floor)
    return Factored(R=R, z=z, rest=rest, samples=data.samples) if seen else None


def from_the_left(L: NDArray[np.float64], both: NDArray[np.float64]) -> NDArray[np.float64]:
    """The product ``L.T @ both``, at half the price since ``L`` is lower triangular."""
    return np.asarray(dtrmm(1.0, L.T, both, side=0, lower=0))


def posterior(data: Triangle, L: NDArray[np.float64]) -> Posterior:
    """Mean and covariance under a prior.

    Args:
        data: The regression.
        L: As for :func:`factored`.

    Returns:
        The posterior.
    """
    whole = factored(data, L)
    Ra, n = whole.R, len(whole.R)
    variance = whole.rest / data.samples
    half = back_substituted(Ra, L.T, transposed=True)  # Ra^-T L^T
    inverse = back_substituted(Ra, np.eye(n))
    return Posterior(
        mean=L @ back_substituted(Ra, whole.z),
        covariance=variance * half.T @ half,
        noise_variance=variance,
        log_evidence=whole.log_evidence,
        effective=float(n - np.sum(inverse**2)),
    )
