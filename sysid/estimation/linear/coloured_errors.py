r"""What errors that hang together say about parameters: the sandwich in place of the inverse.

The free run of a model without a model of its noise leaves what noise there is, with its colour. The estimate is right
all the same, since that does not depend on the inputs, but :math:`\sigma^2 (J^T J)^{-1}` is not its covariance: that is
:math:`(J^T J)^{-1} J^T R J (J^T J)^{-1}` with the covariance :math:`R` of the errors (Ljung 1999, "System
identification", section 9.4; White 1982, "Maximum likelihood estimation of misspecified models"). With an
autoregression :math:`A(q) v = e` of the errors, :math:`J^T R J` is the sum of squares of :math:`J` filtered by
:math:`1/A`: exactly, if the filter goes on after the last sample until it has died away.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.nonparametric.noise import LONGEST_MEMORY, power, whitener

Array = NDArray[np.float64]

DIED, LONGEST_TAIL = 1e-6, 20_000
"""Share of a response that no longer counts, and samples after which it is not followed any more."""


def colour(residuals: Sequence[Array], counts: Sequence[NDArray[np.bool_]]) -> Array:
    """The autoregression of some errors, ``1, a1, ...``; 1 alone where they are white.

    Args:
        residuals: Of each record, shape ``(n_samples,)``.
        counts: Which samples count.

    Returns:
        Its coefficients.
    """
    stretches = []
    for residual, counted in zip(residuals, counts, strict=True):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], counted, [False]]).astype(np.int8)))
        stretches += [residual[first:last] for first, last in edges.reshape(-1, 2)]
    rows = sum(map(len, stretches))
    if not all(np.isfinite(one).all() for one in stretches):
        return np.ones(1)
    return whitener(stretches, min(LONGEST_MEMORY, rows // 20))


def information(blocks: Iterable[Array], a: Array) -> Array:
    """``J' R J`` of one record over the variance of its errors.

    Args:
        blocks: Derivatives of the errors, shape ``(n_rows, n_parameters)`` each, one after the other.
        a: The errors' autoregression.

    Returns:
        Shape ``(n_parameters, n_parameters)``; of white errors ``J' J``.
    """
    total, state = np.zeros((0, 0)), np.zeros((0, 0))
    for J in (*blocks, None):
        if J is None:  # what goes on after the last sample
            J = np.zeros((_tail(a), total.shape[1]))  # noqa: PLW2901
        if not total.size:
            total, state = np.zeros((J.shape[1], J.shape[1])), np.zeros((len(a) - 1, J.shape[1]))
        through, state = (J, state) if len(a) == 1 else scipy.signal.lfilter([1.0], a, J, axis=0, zi=state)
        total += through.T @ through
    return np.asarray(total / power(a))


def sandwich(half: Array, coloured: Array, n_samples: int) -> Array:
    """A factor of the covariance where errors hang together.

    Args:
        half: A factor of the inverse of ``J' J``, shape ``(n_parameters, n_directions)``.
        coloured: ``J' R J`` over the errors' variance.
        n_samples: Errors that count. As many parameters take more away of slow errors than one each: the trace of the
            sandwich over that of white errors.

    Returns:
        The factor, over the same directions; times the errors' deviation, as if they were white, it is that of the
        covariance.
    """
    sizes, vectors = scipy.linalg.eigh(half.T @ coloured @ half)
    taken = min(float(sizes.sum()), 0.5 * n_samples)
    lost = max(n_samples - half.shape[1], 1) / max(n_samples - taken, 1.0)
    return np.asarray(half @ (vectors * np.sqrt(lost * np.maximum(sizes, 0.0))))


def _tail(a: Array) -> int:
    radius = float(np.abs(np.roots(a)).max(initial=0.0))
    return 0 if radius == 0.0 else min(int(np.log(DIED) / np.log(radius)) + 1, LONGEST_TAIL)
