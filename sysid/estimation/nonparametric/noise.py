"""The colour of what a model leaves, as an autoregression that makes it white."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.nonparametric.segments import columns_of_lags

BLOCK = 65_536
"""Rows of a regression that are in memory at a time."""


def whitener(residuals: Sequence[NDArray[np.float64]], most: int, *, exact: bool = False) -> NDArray[np.float64]:
    """The filter that whitens some residuals.

    Args:
        residuals: Stretches; no lag crosses from one into the next.
        most: Largest order.
        exact: Take this order, in place of the one with the least BIC.

    Returns:
        Coefficients ``1, a1, ...`` of a filter without zeros on or outside the unit circle; 1 alone where they are
        white.
    """
    white = np.ones(1)
    rows = sum(max(len(e) - most, 0) for e in residuals)
    if most == 0 or rows <= 2 * most + 2:
        return white
    # Leading columns of one triangular factor hold every smaller order. It is brought up to date block by block.
    R = np.zeros((0, most + 1))
    for e in residuals:
        for first in range(most, len(e), BLOCK):
            some = slice(first, min(first + BLOCK, len(e)))
            block = np.column_stack([columns_of_lags(e, range(1, most + 1), some), e[some]])
            R = linalg.qr(np.concatenate([R, block]), mode="r")[0][: most + 1]
    left = np.append(np.cumsum(R[::-1, -1] ** 2)[::-1], 0.0)[: most + 1]
    scores = rows * np.log(np.maximum(left, np.finfo(np.float64).tiny) / rows) + np.log(rows) * np.arange(most + 1)
    order = most if exact else int(np.argmin(scores))
    if order == 0 or not np.all(np.abs(np.diag(R)[:order]) > 1e-12 * np.abs(R).max()):
        return white
    a = np.append(1.0, -linalg.solve_triangular(R[:order, :order], R[:order, -1]))
    roots = np.roots(a)
    # A residual that grows over its stretch: mirrored, it has the same spectrum.
    outside = np.abs(roots) >= 1.0
    roots[outside] = 0.999 / np.conj(roots[outside])
    return inside(roots.astype(np.complex128))


def inside(roots: NDArray[np.complex128]) -> NDArray[np.float64]:
    """The polynomial of some roots inside the unit circle, as it is computed.

    Where several lie close to the circle and to each other, their polynomial's digits no longer hold them inside: it is
    then that of roots drawn towards 0 by a thousandth, as often as it takes.

    Args:
        roots: Magnitudes below 1; complex ones in pairs.

    Returns:
        Coefficients ``1, a1, ...``.

    Example:
        >>> crowded = np.full(8, 0.999)
        >>> bool(np.abs(np.roots(np.poly(crowded))).max() < 1.0), bool(np.abs(np.roots(inside(crowded))).max() < 1.0)
        (False, True)
    """
    a = np.asarray(np.real(np.poly(roots)), dtype=np.float64)
    while np.abs(np.roots(a)).max(initial=0.0) >= 1.0:
        a = a * 0.999 ** np.arange(len(a))
    return a


LONGEST_MEMORY = 12
"""Order of an autoregression of errors, at most."""


def persistence(residuals: Sequence[NDArray[np.float64]]) -> float:
    r"""Integrated autocorrelation time of some errors in samples, from their autoregression.

    :math:`\tau = S(0)/r(0)`, the spectrum at frequency 0 over the variance. A fit takes the slowest part of its errors
    away, so that sums of the autocorrelations of what is left are too small, by half on a short record; a model of
    the errors reads it from their recursion.

    Args:
        residuals: Of each record, shape ``(n_samples,)``.

    Returns:
        At least 1.

    Example:
        >>> noise = np.random.default_rng(0).standard_normal(2_000)
        >>> from scipy.signal import lfilter
        >>> slow = lfilter([1.0], [1.0, -0.8], noise)
        >>> persistence([noise]) < 1.5, 7.0 < persistence([slow]) < 11.0
        (True, True)
    """
    rows = sum(map(len, residuals))
    finite = all(np.isfinite(e).all() for e in residuals)
    a = whitener(residuals, min(LONGEST_MEMORY, rows // 20)) if finite else np.ones(1)
    found = 1.0 / (float(a.sum()) ** 2 * power(a))
    return max(found, 1.0) if np.isfinite(found) else 1.0


def power(a: NDArray[np.float64]) -> float:
    """Variance of what an autoregression makes of white noise of variance 1.

    By its reflection coefficients, from the last one back (Levinson 1947): errors so smooth that roots are at the edge
    of the unit circle leave a Lyapunov equation nothing to be solved by.

    Args:
        a: Coefficients ``1, a1, ...``, its roots inside the unit circle.

    Returns:
        At least 1.

    Example:
        >>> round(power(np.array([1.0, -0.8])), 3)
        2.778
    """
    left = 1.0
    while len(a) > 1:
        reflection = float(a[-1] / a[0])
        share = max(1.0 - reflection**2, np.finfo(np.float64).eps)
        a, left = (a - reflection * a[::-1])[:-1] / share, left * share
    return 1.0 / left
