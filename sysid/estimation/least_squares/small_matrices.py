"""Linear algebra of small symmetric matrices, straight to LAPACK.

A fit of some ten neurons factors matrices of some 60 rows several times an iteration; what SciPy's wrappers look at
before and after took longer than the factorisation. The routines are theirs, and so are the results, to the last bit.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
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


def back_substituted(
    upper: NDArray[np.float64], right: NDArray[np.float64], *, transposed: bool = False
) -> NDArray[np.float64]:
    """The solution of ``R x = right``, or of ``R^T x = right``.

    Args:
        upper: ``R``, finite, shape ``(n, n)``; what stands below its diagonal is not read.
        right: Finite, shape ``(n,)`` or ``(n, m)``.
        transposed: Whether the transposed system is solved.

    Returns:
        The shape of ``right``.

    Raises:
        numpy.linalg.LinAlgError: If there is a zero on the diagonal.

    Example:
        >>> back_substituted(np.array([[2.0, 1.0], [0.0, 4.0]]), np.array([4.0, 8.0])).tolist()
        [1.0, 2.0]
    """
    if not right.size:  # LAPACK prints that it has an illegal value
        return right.copy()
    found, wrong = lapack.dtrtrs(upper, right, lower=0, trans=int(transposed))
    if wrong:
        raise np.linalg.LinAlgError(f"a zero on the diagonal, at {wrong - 1}")
    return np.asarray(found)


def orthogonal(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Orthonormal columns ``Q`` and an upper triangle ``R`` with ``Q R`` the matrix.

    Args:
        matrix: Finite, shape ``(m, n)``; may be overwritten.

    Returns:
        Shapes ``(m, k)`` and ``(k, n)``, where ``k`` is the less of both.
    """
    m, n = matrix.shape
    if m < n or not n:
        Q, R = linalg.qr(matrix, mode="economic", overwrite_a=True, check_finite=False)
        return np.asarray(Q), np.asarray(R)
    first, second, _ = _room(m, n)
    packed, tau, _, _ = lapack.dgeqrf(matrix, lwork=first, overwrite_a=1)
    R = np.triu(packed[:n])
    return np.asarray(lapack.dorgqr(packed, tau, lwork=second, overwrite_a=1)[0]), R


def singular(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Singular vectors and values.

    Args:
        matrix: Finite, shape ``(m, n)``, neither 0.

    Returns:
        ``U``, the values and ``V^T``, both of which are square.

    Raises:
        numpy.linalg.LinAlgError: If they are not found.

    Example:
        >>> singular(np.diag([3.0, 4.0]))[1].tolist()
        [4.0, 3.0]
    """
    U, sizes, Vt, wrong = lapack.dgesdd(matrix, compute_uv=1, full_matrices=1, lwork=_room(*matrix.shape)[2])
    if wrong:
        raise np.linalg.LinAlgError("singular values that do not converge")
    return U, sizes, Vt


@lru_cache(maxsize=256)
def _room(m: int, n: int) -> tuple[int, int, int]:
    """What LAPACK takes in blocks: for both parts of orthogonal factors, and for singular values."""
    like, tau = np.zeros((m, n), order="F"), np.zeros(min(m, n))
    first = lapack.dgeqrf(like, lwork=-1)[2][0]
    second = lapack.dorgqr(like[:, : min(m, n)], tau, lwork=-1)[1][0]
    third = lapack.dgesdd_lwork(m, n, compute_uv=1, full_matrices=1)[0]
    return int(first), int(second), int(third)
