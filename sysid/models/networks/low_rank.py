"""Matrices of a given rank: the nearest one, and in what directions one may move and keep its rank to first order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def nearest(matrix: Array, rank: int) -> Array:
    """The matrix of at most some rank that is nearest to another (Eckart and Young 1936).

    Args:
        matrix: The other one.
        rank: The rank, 1 or more.

    Returns:
        The same shape; the matrix itself where its rank cannot be above that.
    """
    if rank >= min(matrix.shape):
        return matrix
    left, values, right = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray((left[:, :rank] * values[:rank]) @ right[:rank])


def normal(matrix: Array, rank: int) -> Array:
    r"""The projector on what leaves the matrices of a rank at once.

    At :math:`X = U S Q^T` these are the :math:`(1 - U U^T) Z (1 - Q Q^T)` (Absil, Mahony and Sepulchre 2008, section
    3.5). Any other move keeps the rank to first order, and :func:`nearest` then leads back to it.

    Args:
        matrix: One of that rank, shape ``(n, m)``.
        rank: The rank.

    Returns:
        Shape ``(n * m, n * m)``, for matrices whose rows stand one after the other; zero where any rank is that.
    """
    n, m = matrix.shape
    if rank >= min(n, m):
        return np.zeros((n * m, n * m))
    left, _, right = np.linalg.svd(matrix, full_matrices=False)
    U, Q = left[:, :rank], right[:rank].T
    return np.kron(np.eye(n) - U @ U.T, np.eye(m) - Q @ Q.T)


def dimension(shape: tuple[int, int], rank: int) -> int:
    """Numbers that say which matrix of a shape and of at most some rank it is.

    Args:
        shape: Rows and columns.
        rank: The rank.

    Returns:
        How many.

    Example:
        >>> dimension((5, 4), 1), dimension((5, 4), 4)
        (8, 20)
    """
    n, m = shape
    rank = min(rank, n, m)
    return rank * (n + m - rank)
