"""A linear state space in coordinates in which its last states are sums."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import linalg


def summed(matrices: tuple[NDArray[np.float64], ...], count: int) -> tuple[NDArray[np.float64], ...]:
    r"""A linear model whose poles nearest 1 are moved there, their states last: nothing before them reads one.

    The real Schur form of :math:`A^T`, these poles last, gives orthogonal coordinates in which
    :math:`A = \begin{pmatrix} A_0 & 0 \\ A_1 & S \end{pmatrix}`; :math:`S` then becomes the identity, and what of it a
    sum gives to those after it. Of a double integrator the singular vectors of :math:`S - 1`, the largest value first,
    say which one feeds which.

    Args:
        matrices: ``A``, ``B``, ``C``, ``D`` and the outputs' constants.
        count: How many poles.

    Returns:
        The same for the new coordinates.
    """
    A, B, C, D, constant = matrices
    first = len(A) - count
    if count == 0:
        return matrices
    away = np.sort(np.abs(linalg.eigvals(A) - 1.0))
    edge = away[-1] + 1.0 if first == 0 else (away[count - 1] + away[count]) / 2.0
    T, Q, _ = linalg.schur(A.T, output="real", sort=lambda real, imaginary: abs(complex(real, imaginary) - 1.0) > edge)
    _, _, rows = linalg.svd(T[first:, first:].T - np.eye(count))
    turned = Q @ linalg.block_diag(np.eye(first), rows.T)
    A = turned.T @ A @ turned
    A[:first, first:] = 0.0
    A[first:, first:] = np.eye(count) + np.tril(A[first:, first:], -1)
    return A, turned.T @ B, C @ turned, D, constant
