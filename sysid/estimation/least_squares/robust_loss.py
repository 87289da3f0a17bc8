r"""What a trace counts in the loss where a few traces on which the free run is lost must not rule it.

A sum of squares is ruled by its largest terms. Where the free run loses its way on a few traces, their squares outweigh
those of all others: training works on these few, learns them by heart, and pays with the many. With a
scale :math:`m` a trace's mean squared residual :math:`S` over :math:`n` samples counts as

.. math:: \tfrac12\, n\, m^2 \ln\bigl(1 + S / m^2\bigr),

which is half its squares, :math:`n S / 2`, where :math:`S \ll m^2`, and where it is not, the logarithm of the error:
what the geometric mean over traces counts, by which states are chosen. It is Cauchy's loss (``loss="cauchy"`` of
SciPy's ``least_squares``) of a whole trace instead of a single residual: a free run is lost over minutes, not at a
sample.

Its gradient is that of the squares times :math:`w = 1 / (1 + S / m^2)`, and so is its Gauss-Newton matrix where the
logarithm's own curvature is left out, which is negative (Triggs et al. 1999, "Bundle adjustment: a modern synthesis",
section 4.3): the matrix stays positive, and the step a descent.

Limits: the noise that the evidence infers is that of this loss, smaller than that of the residuals. A scale far below
the errors of most traces makes the weights compete: what is best already gains most.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from operator import truediv

import numpy as np
from numpy.typing import NDArray

from sysid.kernels.arrays import read_only


def counted(
    residual: NDArray[np.float64],
    scale: float,
    samples: int | NDArray[np.int64],
    units: Sequence[float] | None = None,
) -> tuple[float, NDArray[np.float64]]:
    """What the residuals of one trace count.

    Args:
        residual: Residuals, shape ``(n_rows, n_targets)``; zero in rows that do not count.
        scale: Root mean square of a target's residuals from which on they count by its logarithm; infinity for plain
            squares.
        samples: Rows that count, ``n``; of each target where they differ, shape ``(n_targets,)``.
        units: What of each target's squares counts as one; 1 by default.

    Returns:
        The trace's part of the loss, summed over targets, and the weight of each target's squares in gradient and
        Gauss-Newton matrix, shape ``(n_targets,)``.

    Example:
        >>> loss, weights = counted(np.full((50, 1), 2.0), scale=2.0, samples=50)
        >>> round(loss, 2), weights.tolist()
        (69.31, [0.5])
    """
    # A sum over rows goes through memory row by row; and an array of so few takes as long as a run of 50 samples.
    squares = [column.dot(column) for column in residual.T]
    if units is not None:
        squares = list(map(truediv, squares, units))
    if math.isinf(scale):
        return 0.5 * float(sum(squares)), _ones(len(squares))
    within = np.maximum(samples, 1) * scale**2
    return 0.5 * float(np.sum(within * np.log1p(squares / within))), 1.0 / (1.0 + squares / within)


@cache
def _ones(n: int) -> NDArray[np.float64]:
    return read_only(np.ones(n))
