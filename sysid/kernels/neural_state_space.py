r"""The recursion of a neural state space, its free run and its exact forward sensitivities, compiled.

With the state :math:`x_t` (``n`` numbers), the scaled inputs :math:`u_t` (``m``) and :math:`z_t = [x_t; u_t; 1]` one
step is

.. math::
    x_{t+1} = \mathrm{clip}\bigl(M z_t + V\,\sigma(W z_t)\bigr), \qquad
    \hat y_t = \mathrm{clip}\bigl(\rho(L z_t + \bar V \sigma(\bar W z_t))\bigr),

with ``k`` neurons in the state equation, ``q`` in the output's and ``o`` outputs; :math:`\sigma` is a kind of
neuron (``sysid/kernels/neurons``), :math:`\rho` the identity or the absolute value (what a sensor that counts pulses
makes of a speed). The sensitivities :math:`S_t = dx_t/d\theta` obey

.. math::
    S_{t+1} = F_t S_t + \partial x_{t+1}/\partial\theta, \qquad
    F_t = M_x + V\,\mathrm{diag}(\sigma'(W z_t))\,W_x,

and the rows of the Jacobian are :math:`\rho' (G_t S_t + \partial\hat y_t/\partial\theta)` with
:math:`G_t = L_x + \bar V \mathrm{diag}(\sigma'(\bar W z_t))\,\bar W_x` (real-time recurrent learning, Williams and
Zipser 1989). Only the parameters of the state equation and the initial state have sensitivities that live on, so a
sample costs some :math:`n^2 p + n k (n+m)` multiply-adds, and :math:`n p` more for each output: with few states this
yields the whole Jacobian, which Gauss-Newton methods need, for a few times the price of a free run.

Parameters are one flat vector ``[M (n, n+m+1) | W (k, n+m+1) | V (n, k) | L (o, n+m+1) | Wy (q, n+m+1) | v (o, q)]``;
what follows it (the map to the initial state) is not read here. A row of the Jacobian is
``[M, W, V | initial state (n) | L, Wy, v]``.

Limits: a clipped state stops what it remembers, and its sensitivities with it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sysid.kernels.arrays import copy_numbers, copy_rows
from sysid.kernels.neurons.neuron import FAST
from sysid.kernels.neurons.table import activate_with_slopes


@njit(cache=True, nogil=True, fastmath=FAST)
def _activate(weights_columns, z, kind, h, slope):
    """Activations and their derivatives for one ``z``; neurons stand side by side in a vector register."""
    k = len(h)
    for j in range(k):
        h[j] = 0.0
    for i in range(len(z)):
        value = z[i]
        column = weights_columns[i]
        for j in range(k):
            h[j] += column[j] * value
    activate_with_slopes(kind, h, slope)


@njit(cache=True, nogil=True)
def _clip(value, bound_low, bound_high):
    return min(max(value, bound_low), bound_high) if not math.isnan(value) else value


@njit(cache=True, nogil=True, fastmath=FAST)
def free_run(u, x, theta, k, q, kind, rectified, bound, low, high, y):
    """Run the model, writing ``y`` and leaving in ``x`` the state after the last sample.

    Args:
        u: Scaled inputs, shape ``(n_samples, n_inputs)``.
        x: State before the first sample, shape ``(n_states,)``; overwritten.
        theta: Parameters.
        k: Neurons in the state equation.
        q: Neurons in the output equation.
        kind: Code of the neurons' kind.
        rectified: Whether the output is an absolute value.
        bound: Bound of each state.
        low: Lower bound of the output.
        high: Upper bound of the output.
        y: Shape ``(n_samples, n_outputs)``, written.
    """
    n, m, n_y = len(x), u.shape[1], y.shape[1]
    r = n + m + 1
    M = theta[: n * r].reshape(n, r)
    W = np.ascontiguousarray(theta[n * r : (n + k) * r].reshape(k, r).T)
    at = (n + k) * r
    V = theta[at : at + n * k].reshape(n, k)
    at += n * k
    L = theta[at : at + n_y * r].reshape(n_y, r)
    at += n_y * r
    Wy = np.ascontiguousarray(theta[at : at + q * r].reshape(q, r).T)
    v = theta[at + q * r : at + q * r + n_y * q].reshape(n_y, q)
    z = np.ones(r)
    h, slope = np.empty(k), np.empty(k)
    hy, slope_y = np.empty(q), np.empty(q)
    for t in range(len(u)):
        for i in range(n):
            z[i] = x[i]
        for i in range(m):
            z[n + i] = u[t, i]
        _activate(Wy, z, kind, hy, slope_y)
        for o in range(n_y):
            total = 0.0
            for i in range(r):
                total += L[o, i] * z[i]
            for j in range(q):
                total += v[o, j] * hy[j]
            if rectified:
                total = abs(total)
            y[t, o] = _clip(total, low, high)
        _activate(W, z, kind, h, slope)
        for i in range(n):
            new = 0.0
            for j in range(r):
                new += M[i, j] * z[j]
            for j in range(k):
                new += V[i, j] * h[j]
            x[i] = _clip(new, -bound, bound)


@njit(cache=True, nogil=True, fastmath=FAST)
def _mixed(factors, S, out):
    """A weighted sum of rows, four at a time: each number of the sum is read and written once for four of them.

    Args:
        factors: Shape ``(n_states,)``.
        S: Shape ``(n_states, n)``.
        out: Shape ``(n,)``, written.
    """
    n, m = S.shape
    if n == 0:
        out[:m] = 0.0
    elif n < 4:
        a, first = factors[0], S[0]
        for p in range(m):
            out[p] = a * first[p]
    else:
        a, b, c, d = factors[0], factors[1], factors[2], factors[3]
        first, second, third, fourth = S[0], S[1], S[2], S[3]
        for p in range(m):
            out[p] = a * first[p] + b * second[p] + c * third[p] + d * fourth[p]
    at = min(n, 1) if n < 4 else 4
    while at + 3 < n:
        a, b, c, d = factors[at], factors[at + 1], factors[at + 2], factors[at + 3]
        first, second, third, fourth = S[at], S[at + 1], S[at + 2], S[at + 3]
        for p in range(m):
            out[p] += a * first[p] + b * second[p] + c * third[p] + d * fourth[p]
        at += 4
    while at + 1 < n:
        a, b = factors[at], factors[at + 1]
        first, second = S[at], S[at + 1]
        for p in range(m):
            out[p] += a * first[p] + b * second[p]
        at += 2
    if at < n:
        a, first = factors[at], S[at]
        for p in range(m):
            out[p] += a * first[p]


@njit(cache=True, nogil=True, fastmath=FAST)
def _output_row(row, S, z, o, sign, L, v, Wy, hy, slope, G):
    """Derivative of output ``o``, which nothing clips: through the state, and through the output's own parameters.

    Args:
        row: Shape ``(n_dynamic + n_states + n_output,)``, written.
        S: Derivative of the state, shape ``(n_states, n_dynamic + n_states)``.
        z: State, inputs and 1, shape ``(n_row,)``.
        o: Which output.
        sign: -1 where a rectified output was negative, else 1.
        L: Linear output weights, shape ``(n_outputs, n_row)``.
        v: Readout of the output's neurons, shape ``(n_outputs, n_output_neurons)``.
        Wy: Their weights, shape ``(n_output_neurons, n_row)``.
        hy: Their activations.
        slope: Derivatives of the activations.
        G: Room for the derivative by the state, shape ``(n_states,)``, written.
    """
    n, n_S = S.shape
    r, n_y, q = len(z), len(v), v.shape[1]
    for i in range(n):
        G[i] = sign * L[o, i]
        for j in range(q):
            G[i] += sign * v[o, j] * slope[j] * Wy[j, i]
    _mixed(G, S, row)
    if n_y > 1:  # of the other outputs' weights it is no function
        row[n_S:] = 0.0
    for i in range(r):
        row[n_S + o * r + i] = sign * z[i]
    hidden, readout = n_S + n_y * r, n_S + (n_y + q) * r + o * q
    for j in range(q):
        factor = sign * v[o, j] * slope[j]
        place = hidden + j * r
        for i in range(r):
            row[place + i] = factor * z[i]
        row[readout + j] = sign * hy[j]


@njit(cache=True, nogil=True, fastmath=FAST)
def _state_row(after, S, z, i, F, spread, slope_z, h):
    """Derivative of the next state ``i``, which nothing bounds.

    Args:
        after: Shape ``(n_dynamic + n_states,)``, written.
        S: As in :func:`_output_row`.
        z: As in :func:`_output_row`.
        i: The state.
        F: Derivative of the next states by the states, row by row, shape ``(n_states ** 2,)``.
        spread: Readout of the neurons, each repeated for the entries of ``z``, shape ``(n_states, n_neurons * n_row)``.
        slope_z: Derivatives of the activations by their weights, shape ``(n_neurons * n_row,)``.
        h: Activations.
    """
    n, r, k = len(S), len(z), len(h)
    at_W, at_V = n * r, (n + k) * r
    _mixed(F[i * n : (i + 1) * n], S, after)
    own = after[i * r : (i + 1) * r]
    for j in range(r):
        own[j] += z[j]
    weights, factors = after[at_W:at_V], spread[i]
    for j in range(k * r):
        weights[j] += factors[j] * slope_z[j]
    readout = after[at_V + i * k : at_V + (i + 1) * k]
    for o in range(k):
        readout[o] += h[o]


@njit(cache=True, nogil=True, fastmath=FAST)
def _products(V, W, n, r):
    """What does not change from sample to sample: the readout repeated, and how each neuron joins two states.

    Args:
        V: Readout of the neurons, shape ``(n_states, n_neurons)``.
        W: Their weights, shape ``(n_neurons, n_row)``.
        n: Number of states.
        r: Entries of a row.

    Returns:
        ``spread`` of :func:`_state_row`, and ``V[i, o] W[o, j]``, shape ``(n_neurons, n_states ** 2)``.
    """
    k = len(W)
    spread, joined = np.empty((n, k * r)), np.empty((k, n * n))
    for i in range(n):
        for o in range(k):
            spread[i, o * r : (o + 1) * r] = V[i, o]
            for j in range(n):
                joined[o, i * n + j] = V[i, o] * W[o, j]
    return spread, joined


@njit(cache=True, nogil=True, fastmath=FAST)
def sensitivities(u, x, S, theta, k, q, kind, rectified, bound, low, high, y, J):
    """Outputs of some samples and their derivatives; a record is walked in blocks that hand ``x`` and ``S`` on.

    Args:
        u: As in :func:`free_run`; the block's samples.
        x: As in :func:`free_run`.
        S: Derivative of the state, shape ``(n_states, n_dynamic + n_states)``; before the first sample of a record
            zeros and, in its last ``n_states`` columns, the identity. Overwritten.
        theta: As in :func:`free_run`.
        k: As in :func:`free_run`.
        q: As in :func:`free_run`.
        kind: As in :func:`free_run`.
        rectified: As in :func:`free_run`.
        bound: As in :func:`free_run`.
        low: As in :func:`free_run`.
        high: As in :func:`free_run`.
        y: As in :func:`free_run`.
        J: Shape ``(n_samples, n_outputs, n_dynamic + n_states + n_output)``, written.
    """
    n, m, n_y = len(x), u.shape[1], y.shape[1]
    r = n + m + 1
    M = theta[: n * r].reshape(n, r)
    plain_W = theta[n * r : (n + k) * r].reshape(k, r)
    W = np.ascontiguousarray(plain_W.T)
    at = (n + k) * r
    V = theta[at : at + n * k].reshape(n, k)
    at += n * k
    L = theta[at : at + n_y * r].reshape(n_y, r)
    at += n_y * r
    plain_Wy = theta[at : at + q * r].reshape(q, r)
    Wy = np.ascontiguousarray(plain_Wy.T)
    v = theta[at + q * r : at + q * r + n_y * q].reshape(n_y, q)
    following = np.empty_like(S)
    G = np.empty(n)
    z = np.ones(r)
    h, slope = np.empty(k), np.empty(k)
    hy, slope_y = np.empty(q), np.empty(q)
    new_x = np.empty(n)
    spread, joined = _products(V, plain_W, n, r)
    F, slope_z = np.empty(n * n), np.empty(k * r)
    for t in range(len(u)):
        for i in range(n):
            z[i] = x[i]
        for i in range(m):
            z[n + i] = u[t, i]
        # the outputs
        _activate(Wy, z, kind, hy, slope_y)
        for o in range(n_y):
            total = 0.0
            for i in range(r):
                total += L[o, i] * z[i]
            for j in range(q):
                total += v[o, j] * hy[j]
            sign = -1.0 if rectified and total < 0.0 else 1.0
            total *= sign
            bounded = _clip(total, low, high)
            y[t, o] = bounded
            row = J[t, o]
            if bounded != total:
                row[:] = 0.0
            else:
                _output_row(row, S, z, o, sign, L, v, plain_Wy, hy, slope_y, G)
        # the state
        _activate(W, z, kind, h, slope)
        for i in range(n):
            for j in range(n):
                F[i * n + j] = M[i, j]
        for o in range(k):
            factor, row = slope[o], joined[o]
            for j in range(n * n):
                F[j] += factor * row[j]
            place = o * r
            for j in range(r):
                slope_z[place + j] = factor * z[j]
        for i in range(n):
            new = 0.0
            for j in range(r):
                new += M[i, j] * z[j]
            for j in range(k):
                new += V[i, j] * h[j]
            new_x[i] = _clip(new, -bound, bound)
            after = following[i]
            if new_x[i] != new:
                after[:] = 0.0
                continue
            _state_row(after, S, z, i, F, spread, slope_z, h)
        copy_rows(following, S)
        copy_numbers(new_x, x)
