r"""Linear state spaces in innovations form, compiled: the one-step prediction and its sensitivities.

With :math:`\tilde A = A - K C` a prediction moves with the parameters through
:math:`\delta x_{t+1} = \tilde A\,\delta x_t + \sum_s \delta\theta_s\,s_t`, where each source :math:`s` is a state, an
input, an innovation or a constant that enters one row. Row :math:`i` of source :math:`s` reaches output :math:`o` by
:math:`c_o^T (qI - \tilde A)^{-1} e_i\, s_t`, a scalar, and so equals its transpose: one recursion
:math:`z_{t+1} = \tilde A^T z_t + c_o s_t` gives the response to all :math:`n` rows at once. The gradient over
:math:`n^2 + n(m + 2p)` parameters costs :math:`p\,(n + m + p + 1)` recursions.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sysid.kernels.arrays import FAST, copy_numbers


@njit(cache=True, nogil=True, fastmath=FAST)
def predict(A, B, C, D, K, c, u, y, x, states, predicted):
    """Run the one-step prediction ``yhat = C x + D u + c``, ``x(t+1) = A x + B u + K (y - yhat)``.

    Args:
        A: Shape ``(n_state, n_state)``.
        B: Shape ``(n_state, n_inputs)``.
        C: Shape ``(n_outputs, n_state)``.
        D: Shape ``(n_outputs, n_inputs)``.
        K: Shape ``(n_state, n_outputs)``.
        c: Shape ``(n_outputs,)``.
        u: Shape ``(n_samples, n_inputs)``.
        y: Measured output, shape ``(n_samples, n_outputs)``; one that is not a number moves nothing.
        x: State before the first sample, shape ``(n_state,)``; overwritten by the state after the last one.
        states: Shape ``(n_samples, n_state)``, written: the state that each prediction is made from.
        predicted: Shape ``(n_samples, n_outputs)``, written.
    """
    n, m, p = len(x), u.shape[1], y.shape[1]
    following, e = np.empty(n), np.empty(p)
    for t in range(len(u)):
        for i in range(p):
            total = c[i]
            for j in range(n):
                total += C[i, j] * x[j]
            for j in range(m):
                total += D[i, j] * u[t, j]
            predicted[t, i] = total
            e[i] = y[t, i] - total if np.isfinite(y[t, i]) else 0.0
        for i in range(n):
            states[t, i] = x[i]
            total = 0.0
            for j in range(n):
                total += A[i, j] * x[j]
            for j in range(m):
                total += B[i, j] * u[t, j]
            for j in range(p):
                total += K[i, j] * e[j]
            following[i] = total
        copy_numbers(following, x)


@njit(cache=True, nogil=True, fastmath=FAST)
def responses(At, C, sources, z, out):
    """Responses of every output to every source through every row of the state.

    Args:
        At: Transpose of the predictor's state matrix, shape ``(n_state, n_state)``, in rows.
        C: Shape ``(n_outputs, n_state)``.
        sources: Shape ``(n_samples, n_sources)``.
        z: Where the recursions stand, shape ``(n_outputs, n_sources, n_state)``; moved on.
        out: Shape ``(n_outputs, n_samples, n_sources * n_state)``, written.
    """
    p, k, n = z.shape
    following = np.empty(n)
    for o in range(p):
        for s in range(k):
            state = z[o, s]
            for t in range(len(sources)):
                value = sources[t, s]
                for i in range(n):
                    out[o, t, s * n + i] = state[i]
                    total = C[o, i] * value
                    for j in range(n):
                        total += At[i, j] * state[j]
                    following[i] = total
                copy_numbers(following, state)
