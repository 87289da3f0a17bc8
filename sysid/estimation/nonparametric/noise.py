"""The colour of what a model leaves, as an autoregression that makes it white."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.nonparametric.segments import columns_of_lags


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
    blocks = [
        np.column_stack([columns_of_lags(e, range(1, most + 1), slice(most, None)), e[most:]])
        for e in residuals
        if len(e) > most
    ]
    rows = sum(map(len, blocks))
    if most == 0 or rows <= 2 * most + 2:
        return white
    # Leading columns of one triangular factor hold every smaller order.
    R = linalg.qr(np.concatenate(blocks), mode="r")[0][: most + 1]
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
    return np.asarray(np.real(np.poly(roots)), dtype=np.float64)
