r"""Linear filters, compiled: one all-pole section, and a whole state space.

A section of first or second order is :math:`v_t = x_t - c_1 v_{t-1} - c_2 v_{t-2}`. Its cost is the latency of one
multiply-add, so it is the fastest way to pass a record through many poles; products of such sections keep the digits
that the coefficients of one long polynomial lose (20 poles near 1 leave none).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sysid.kernels.arrays import FAST, copy_numbers, read_only


@njit(cache=True, nogil=True)
def all_pole(x, c1, c2, past, v):
    """Pass a record through one section.

    Args:
        x: Shape ``(n_samples,)``.
        c1: First coefficient.
        c2: Second coefficient; 0 for a section of first order.
        past: Value of the section's output at all times before the record.
        v: Output, shape ``(n_samples,)``, written.
    """
    v1 = past
    v2 = past
    for t in range(len(x)):
        # In this order the newest value enters last, and one multiply-add is all that the next sample waits for.
        new = (x[t] - c2 * v2) - c1 * v1
        v[t] = new
        v2 = v1
        v1 = new


def slowed(x: NDArray[np.float64], pole: float, past: float) -> NDArray[np.float64]:
    """What follows a record with a time constant: ``v(t) = (1 - pole) x(t) + pole v(t-1)``.

    Args:
        x: Shape ``(n_samples,)``.
        pole: ``exp(-1 / time constant in samples)``; 0 follows at once.
        past: Its value before the record.

    Returns:
        The same shape.
    """
    v = np.empty(len(x))
    all_pole((1.0 - pole) * np.ascontiguousarray(x), -pole, 0.0, past, v)
    return v


def state_space(
    A: NDArray[np.float64],
    B: NDArray[np.float64],
    C: NDArray[np.float64],
    D: NDArray[np.float64],
    u: NDArray[np.float64],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> None:
    """Run ``x(t+1) = A x(t) + B u(t)``, ``y(t) = C x(t) + D u(t)``.

    Callers have their matrices in seven ways of lying in memory; they are laid out in one, so that one kernel is
    compiled for all of them.

    Args:
        A: Shape ``(n_state, n_state)``.
        B: Shape ``(n_state, n_inputs)``.
        C: Shape ``(n_outputs, n_state)``.
        D: Shape ``(n_outputs, n_inputs)``.
        u: Shape ``(n_samples, n_inputs)``.
        x: State before the first sample, shape ``(n_state,)``; overwritten by the state after the last one.
        y: Shape ``(n_samples, n_outputs)``, written.
    """
    _state_space(*(read_only(np.ascontiguousarray(array)) for array in (A, B, C, D, u)), x, y)


@njit(cache=True, nogil=True, fastmath=FAST)
def _state_space(A, B, C, D, u, x, y):
    n, m, k = len(x), u.shape[1], y.shape[1]
    following = np.empty(n)
    for t in range(len(u)):
        for i in range(k):
            total = 0.0
            for j in range(n):
                total += C[i, j] * x[j]
            for j in range(m):
                total += D[i, j] * u[t, j]
            y[t, i] = total
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += A[i, j] * x[j]
            for j in range(m):
                total += B[i, j] * u[t, j]
            following[i] = total
        copy_numbers(following, x)
