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

from sysid.kernels.arrays import FAST, copy_numbers, copy_rows
from sysid.kernels.neurons.table import activate_with_slopes

ONE, TWO = np.uintp(1), np.uintp(2)


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


# What is called for every sample calls nothing itself, and takes flat arrays with the place where something begins in
# them: numba counts who holds an array that is handed on, or that is a piece of another, which took a quarter of the
# time. Places are unsigned: of others it looks at the sign, each time.


@njit(cache=True, nogil=True, fastmath=FAST)
def _mixed(factors, first, S, n, m, out, place):
    """Write a weighted sum of ``n`` rows of length ``m``, four at a time: each number is then read and written once.

    Args:
        factors: Flat.
        first: Where the rows' begin.
        S: The rows, one after the other.
        n: How many.
        m: How long they are.
        out: Flat, written.
        place: Where from.
    """
    for p in range(m):
        out[place + p] = 0.0
    at, fours = np.uintp(0), n // np.uintp(4)
    for _ in range(fours):
        a, b, c, d = factors[first], factors[first + ONE], factors[first + TWO], factors[first + TWO + ONE]
        second, third, fourth = at + m, at + TWO * m, at + (TWO + ONE) * m
        for p in range(m):
            out[place + p] += a * S[at + p] + b * S[second + p] + c * S[third + p] + d * S[fourth + p]
        at, first = at + TWO * TWO * m, first + TWO * TWO
    for _ in range(n - TWO * TWO * fours):
        a = factors[first]
        for p in range(m):
            out[place + p] += a * S[at + p]
        at, first = at + m, first + ONE


@njit(cache=True, nogil=True, fastmath=FAST)
def _output_slopes(o, sign, L, v, Wy, slope, G):
    """Derivative of output ``o`` by the state, written to ``G``; the rest as in :func:`_output_row`."""
    for i in range(len(G)):
        G[i] = sign * L[o, i]
        for j in range(v.shape[1]):
            G[i] += sign * v[o, j] * slope[j] * Wy[j, i]


@njit(cache=True, nogil=True, fastmath=FAST)
def _output_row(J, place, z, o, sign, v, hy, slope):
    """Derivative of output ``o``, which nothing clips, by the output's own parameters.

    Args:
        J: Flat.
        place: Where these parameters begin, shape ``(n_output,)``, written.
        z: State, inputs and 1, shape ``(n_row,)``.
        o: Which output.
        sign: -1 where a rectified output was negative, else 1.
        v: Readout of the output's neurons, shape ``(n_outputs, n_output_neurons)``.
        hy: Their activations.
        slope: Derivatives of the activations.
    """
    r, n_y, q = len(z), len(v), v.shape[1]
    if n_y > 1:  # of the other outputs' weights it is no function
        for i in range(n_y * (r + q) + q * r):
            J[place + np.uintp(i)] = 0.0
    weights, readout = place + np.uintp(o * r), place + np.uintp((n_y + q) * r + o * q)
    for i in range(r):
        J[weights + np.uintp(i)] = sign * z[i]
    for j in range(q):
        factor = sign * v[o, j] * slope[j]
        hidden = place + np.uintp((n_y + j) * r)
        for i in range(r):
            J[hidden + np.uintp(i)] = factor * z[i]
        J[readout + np.uintp(j)] = sign * hy[j]


@njit(cache=True, nogil=True, fastmath=FAST)
def _state_row(after, place, n, z, i, spread, slope_z, h):
    """Add the derivative of the next state ``i``, which nothing bounds, by the parameters of the state equation.

    Args:
        after: Flat.
        place: Where the row begins.
        n: Number of states.
        z: As in :func:`_output_row`.
        i: The state.
        spread: Readout of the neurons, each repeated for the entries of ``z``, shape ``(n_states, n_neurons * n_row)``.
        slope_z: Derivatives of the activations by their weights, shape ``(n_neurons * n_row,)``.
        h: Activations.
    """
    r, k = len(z), len(h)
    own, weights, readout = (
        place + np.uintp(i * r), place + np.uintp(n * r), place + np.uintp((n + k) * r + i * k),
    )  # fmt: skip
    for j in range(r):
        after[own + np.uintp(j)] += z[j]
    for j in range(k * r):
        after[weights + np.uintp(j)] += spread[i, j] * slope_z[j]
    for o in range(k):
        after[readout + np.uintp(o)] += h[o]


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
    following, columns, width = np.empty_like(S), np.uintp(S.shape[1]), J.shape[2]
    after, flat_S, flat_J = following.reshape(-1), S.reshape(-1), J.reshape(-1)
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
            row = np.uintp((t * n_y + o) * width)
            if bounded != total:
                for p in range(width):
                    flat_J[row + np.uintp(p)] = 0.0
            else:
                _output_slopes(o, sign, L, v, plain_Wy, slope_y, G)
                _mixed(G, np.uintp(0), flat_S, np.uintp(n), columns, flat_J, row)
                _output_row(flat_J, row + columns, z, o, sign, v, hy, slope_y)
        # the state
        _activate(W, z, kind, h, slope)
        for i in range(n):
            for j in range(n):
                F[i * n + j] = M[i, j]
        for o in range(k):
            factor = slope[o]
            for j in range(n * n):
                F[j] += factor * joined[o, j]
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
            row = np.uintp(i) * columns
            if new_x[i] != new:
                for p in range(columns):
                    after[row + p] = 0.0
                continue
            _mixed(F, np.uintp(i * n), flat_S, np.uintp(n), columns, after, row)
            _state_row(after, row, n, z, i, spread, slope_z, h)
        copy_rows(following, S)
        copy_numbers(new_x, x)
