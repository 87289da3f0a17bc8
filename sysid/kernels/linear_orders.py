r"""One-step losses of nested linear regressions, compiled.

All candidates of an order search choose their columns from one maximal regressor :math:`X`. One QR factorisation
:math:`[X\; y] = QR` replaces the :math:`N` rows by as many rows as there are columns, and loses nothing: the residual
sum of squares on any choice of columns is that of the same columns of :math:`R`. Orders are nested, so that a family of
candidates shares its work: inputs are reflected into the triangle column by column, one level of the search tree per
input, and at each leaf the past outputs follow one by one, each giving the loss of one more order.

Orthogonal reflections of :math:`R` are used, not Cholesky factors of :math:`X^T X`: neighbouring lags of a well-sampled
signal are nearly equal, and squaring their condition number would leave no digit of a small loss.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sysid.kernels.arrays import copy_numbers, copy_rows


@njit(cache=True, nogil=True)
def reflect(W, pivot, columns, n_columns, target, rank, tolerance):
    """Make column ``pivot`` zero below row ``rank`` by a Householder reflection, and apply it to others.

    Args:
        W: Transposed table, shape ``(n_columns_of_table, n_rows)``; overwritten.
        pivot: Column to eliminate.
        columns: Columns that follow; the first ``n_columns`` are reflected.
        n_columns: How many of them.
        target: Column of the target, reflected too.
        rank: Rows already used.
        tolerance: Length below which the column depends on the earlier ones and changes nothing.

    Returns:
        The new rank.
    """
    n = W.shape[1]
    x = W[pivot]
    total = 0.0
    for i in range(rank, n):
        total += x[i] * x[i]
    norm = np.sqrt(total)
    if norm <= tolerance or rank >= n:
        return rank
    alpha = -norm if x[rank] > 0.0 else norm
    head = x[rank] - alpha
    scale = 1.0 / (alpha * head)  # -2 / (v . v)
    x[rank] = head
    for c in range(n_columns + 1):
        other = W[columns[c]] if c < n_columns else W[target]
        dot = 0.0
        for i in range(rank, n):
            dot += x[i] * other[i]
        dot *= scale
        for i in range(rank, n):
            other[i] += dot * x[i]
    x[rank] = alpha
    return rank + 1


@njit(cache=True, nogil=True)
def residual_square(W, target, rank):
    """Sum of squares that is left of the target.

    Args:
        W: As in :func:`reflect`.
        target: Column of the target.
        rank: Rows already used.

    Returns:
        The residual sum of squares.
    """
    total = 0.0
    for i in range(rank, W.shape[1]):
        total += W[target, i] * W[target, i]
    return total


@njit(cache=True, nogil=True)
def nested_losses(base, rank, input_columns, least, most, output_columns, target, tolerance, losses):
    """Residual sums of squares for all orders with given dead times.

    Args:
        base: Transposed triangle, shape ``(n_columns, n_rows)``, with the first ``rank`` rows used (the intercept).
        rank: Rows already used.
        input_columns: For each input its columns from the dead time on, shape ``(n_inputs, longest)``; of each input
            as many are read as it has at most.
        least: Smallest number of columns per input, shape ``(n_inputs,)``, at least 0.
        most: Largest number of columns per input, likewise.
        output_columns: Columns of the past outputs, shape ``(n_outputs,)``.
        target: Column of the target.
        tolerance: As in :func:`reflect`, per column, shape ``(n_columns,)``.
        losses: Shape ``(n_leaves, n_outputs + 1)``; leaves in the order of an odometer over the numbers of columns,
            the last input fastest. Written.
    """
    m = len(input_columns)
    n_out = len(output_columns)
    levels = np.empty((m, base.shape[0], base.shape[1]))
    leaf_table = np.empty_like(base)
    ranks = np.zeros(m + 1, dtype=np.int64)
    counts = np.zeros(m, dtype=np.int64)
    following = np.empty(base.shape[0], dtype=np.int64)
    level, leaf = 0, 0
    fresh = True
    while level >= 0:
        source_rank = rank if level == 0 else ranks[level - 1]
        if fresh:
            copy_rows(base if level == 0 else levels[level - 1], levels[level])
            ranks[level] = source_rank
            counts[level] = -1
        counts[level] += 1
        if counts[level] > most[level]:
            level -= 1
            fresh = False
            continue
        if counts[level] > 0:
            pivot = input_columns[level, counts[level] - 1]
            n = 0
            for c in range(counts[level], most[level]):
                following[n] = input_columns[level, c]
                n += 1
            for i in range(level + 1, m):
                for c in range(most[i]):
                    following[n] = input_columns[i, c]
                    n += 1
            for c in range(n_out):
                following[n] = output_columns[c]
                n += 1
            ranks[level] = reflect(levels[level], pivot, following, n, target, ranks[level], tolerance[pivot])
        if counts[level] < least[level]:
            fresh = False
            continue
        if level < m - 1:
            level += 1
            fresh = True
            continue
        fresh = False
        used = ranks[level]
        for c in range(n_out):
            copy_numbers(levels[level, output_columns[c]], leaf_table[output_columns[c]])
        copy_numbers(levels[level, target], leaf_table[target])
        losses[leaf, 0] = residual_square(leaf_table, target, used)
        for a in range(n_out):
            pivot = output_columns[a]
            used = reflect(leaf_table, pivot, output_columns[a + 1 :], n_out - a - 1, target, used, tolerance[pivot])
            losses[leaf, a + 1] = residual_square(leaf_table, target, used)
        leaf += 1
