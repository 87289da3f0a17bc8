"""Linear algebra of small symmetric matrices, straight to LAPACK.

A fit of some ten neurons factors matrices of some 60 rows several times an iteration; what SciPy's wrappers look at
before and after took longer than the factorisation. The routines are theirs, and so are the results, to the last bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack


def add_to_diagonal(matrix: NDArray[np.float64], values: NDArray[np.float64] | float) -> None:
    """Add to a diagonal, in place.

    Args:
        matrix: Shape ``(n, n)``.
        values: Shape ``(n,)``, or one number for all.
    """
    diagonal = np.einsum("ii->i", matrix)  # a view that can be written
    diagonal += values


def cholesky(matrix: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The lower factor ``L`` with ``L L^T`` the matrix, of which the lower half is read.

    Args:
        matrix: Symmetric, shape ``(n, n)``.

    Returns:
        The factor, zeros above its diagonal; ``None`` where the matrix is not positive definite to working precision,
        or not finite.

    Example:
        >>> cholesky(np.diag([4.0, 9.0])).tolist(), cholesky(np.diag([1.0, -1.0]))
        ([[2.0, 0.0], [0.0, 3.0]], None)
    """
    if not np.isfinite(matrix).all():
        return None
    factor, wrong = lapack.dpotrf(matrix, lower=1, clean=1)
    return None if wrong else np.asarray(factor)


def solved(factor: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """The solution of ``L L^T x = right``.

    Args:
        factor: ``L``, shape ``(n, n)``.
        right: Finite, shape ``(n,)``.

    Returns:
        Shape ``(n,)``.
    """
    return np.asarray(lapack.dpotrs(factor, right, lower=1)[0])


def inverse_of(factor: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inverse of a lower factor.

    Args:
        factor: Shape ``(n, n)``, its diagonal positive.

    Returns:
        The same shape.
    """
    if not len(factor):  # LAPACK prints that it has an illegal value
        return factor
    return np.asarray(lapack.dtrtrs(factor, np.eye(len(factor)), lower=1)[0])
