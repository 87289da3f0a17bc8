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


def spaces(matrix: Array, rank: int) -> tuple[Array, Array]:
    """Orthonormal bases of the column space and of the row space of a matrix of some rank.

    Args:
        matrix: The matrix, shape ``(n, m)``.
        rank: The rank, at most ``n`` and ``m``.

    Returns:
        Shapes ``(n, rank)`` and ``(m, rank)``.
    """
    left, _, right = np.linalg.svd(matrix, full_matrices=False)
    return left[:, :rank], right[:rank].T


def leaving(moves: Array, spaces: tuple[Array, Array]) -> Array:
    r"""What of some moves from a matrix leaves the matrices of its rank at once.

    At :math:`X = U S Q^T` that is :math:`(1 - U U^T) Z (1 - Q Q^T)` of a move :math:`Z` (Absil, Mahony and Sepulchre
    2008, section 3.5). What is left keeps the rank to first order, and :func:`nearest` then leads back to it.

    Args:
        moves: Shape ``(..., n, m)``.
        spaces: :func:`spaces` of the matrix.

    Returns:
        The same shape as the moves.
    """
    U, Q = spaces
    off = moves - U @ (U.T @ moves)
    return np.asarray(off - (off @ Q) @ Q.T)


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
