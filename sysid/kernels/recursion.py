r"""The recursion of a lagged network, its free run and its exact forward sensitivities, compiled.

With the regressors :math:`x_t` (lagged inputs, then lagged outputs) one step is

.. math::
    \hat y_t = \mathrm{clip}\bigl(w^T x_t + c + \textstyle\sum_k g_{t,k} h_{t,k}\bigr),
    \qquad h_{t,k} = \sigma(W_k x_t + b_k), \qquad g_{t,k} = v_k + V_k x_t.

Without gates :math:`V = 0`: a layer of neurons of one kind (``sysid/kernels/neurons``; tanh, unless something else is
said) and its readout. With them each neuron switches a linear function
of the regressors on and off, which is what a valve does to a flow: the rate of a filling volume is a product, which a
plain layer has to put together out of many neurons.

In a free run the lagged outputs in :math:`x_t` are the recursion's own. Differentiating with respect to
the parameters :math:`\theta` gives, with :math:`s_{t,k} = g_{t,k}\,\sigma'(W_k x_t + b_k)`, which is
:math:`g_{t,k} (1 - h_{t,k}^2)` of tanh,

.. math::
    \frac{d \hat y_t}{d\theta} = \frac{\partial \hat y_t}{\partial\theta}
      + \sum_l c_{t,l}\,\frac{d \hat y_{t-l}}{d\theta},
    \qquad c_{t,l} = w_l + \sum_k (s_{t,k} W_{k,l} + h_{t,k} V_{k,l})

a linear recursion over the rows of the Jacobian (real-time recurrent learning, Williams and Zipser 1989):
exact, forward, one pass. With a single output it costs ``n_parameters * (1 + n_output_lags)`` multiply-adds a sample,
which is why it beats backpropagation through time for networks of this size: it yields the whole Jacobian that
Gauss-Newton methods need. A clipped sample has a zero row.

Between the free run and the prediction one step ahead stands the run over windows of ``horizon`` samples, each of which
begins from measured output: lagged outputs from before the window are measured, and do not depend on the parameters. A
horizon of 1 is one step ahead, one as long as the record the free run.

Parameters are one flat vector ``[W (n_neurons, n_regressors) | b | v | c | w | V (n_neurons, n_regressors)]``. Gates
``V`` and linear part ``w`` stand last so that a network without them is a shorter vector (gates come with a linear part
only); no neurons at all leaves ``[c | w]``, an ARX model with an intercept. Everything is in the model's scaled
numbers. Time is extended to the left by ``depth`` past samples, so that ``u[depth + t]`` and ``y[depth + t]`` belong to
step ``t``.

Limits: one output; the Jacobian of an unstable free run grows without bound, which the clip stops.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sysid.kernels.arrays import copy_numbers
from sysid.kernels.neurons.neuron import FAST
from sysid.kernels.neurons.table import activate, activate_with_slopes, slopes_of_sums, slopes_of_values


@njit(cache=True, nogil=True, fastmath=FAST)
def _affine(columns, constant, x, out):
    """One affine function of the regressors per neuron; neurons stand side by side in a vector register."""
    n = len(constant)
    for k in range(n):
        out[k] = constant[k]
    for i in range(len(x)):
        value = x[i]
        column = columns[i]
        for k in range(n):
            out[k] += column[k] * value


@njit(cache=True, nogil=True)
def _gates(theta, n_neurons, n_x):
    """``V`` by column, shape ``(n_regressors, n_neurons)``; no neurons where the network has no gates."""
    flat = theta[n_neurons * (n_x + 2) + 1 + n_x :]
    return np.ascontiguousarray(flat.reshape(n_neurons if len(flat) > 0 else 0, n_x).T)


@njit(cache=True, nogil=True, fastmath=FAST)
def free_run(u, y, depth, n_steps, input_channel, input_lag, output_lag, theta, n_neurons, kind, low, high):
    """Run the recursion on its own output, writing ``y[depth:]`` in place.

    Args:
        u: Scaled inputs with history, shape ``(depth + n_steps, n_inputs)``.
        y: Scaled outputs, shape ``(depth + n_steps,)``; the first ``depth`` are read, the rest written.
        depth: Past samples before step 0.
        n_steps: Steps to run.
        input_channel: Shape ``(n_input_regressors,)``.
        input_lag: Shape ``(n_input_regressors,)``.
        output_lag: Shape ``(n_output_regressors,)``.
        theta: Parameters; with or without the linear part and gates.
        n_neurons: Number of neurons.
        kind: Code of their kind.
        low: Lower bound of the output.
        high: Upper bound of the output.
    """
    n_in, n_out = len(input_lag), len(output_lag)
    n_x = n_in + n_out
    W = theta[: n_neurons * n_x].reshape(n_neurons, n_x)
    W_columns = np.ascontiguousarray(W.T)
    b = theta[n_neurons * n_x : n_neurons * (n_x + 1)]
    v = theta[n_neurons * (n_x + 1) : n_neurons * (n_x + 2)]
    linear = len(theta) > n_neurons * (n_x + 2) + 1
    constant = theta[n_neurons * (n_x + 2)]
    w = theta[n_neurons * (n_x + 2) + 1 : n_neurons * (n_x + 2) + 1 + n_x]
    V_columns = _gates(theta, n_neurons, n_x)
    gated = V_columns.shape[1] > 0
    x = np.empty(n_x)
    g = v.copy()
    h = np.empty(n_neurons)
    for t in range(depth, depth + n_steps):
        for i in range(n_in):
            x[i] = u[t - input_lag[i], input_channel[i]]
        for i in range(n_out):
            x[n_in + i] = y[t - output_lag[i]]
        total = constant
        if linear:
            for i in range(n_x):
                total += w[i] * x[i]
        _affine(W_columns, b, x, h)
        activate(kind, h, 0, n_neurons)
        if gated:
            _affine(V_columns, v, x, g)
        for k in range(n_neurons):
            total += g[k] * h[k]
        y[t] = min(max(total, low), high) if not math.isnan(total) else total


@njit(cache=True, nogil=True, fastmath=FAST)
def activations(
    u,
    y,
    measured,
    depth,
    n_steps,
    input_channel,
    input_lag,
    output_lag,
    theta,
    n_neurons,
    kind,
    low,
    high,
    horizon,
    out,
    h,
    c,
):
    """One pass that keeps what the sensitivities need.

    Args:
        u: As in :func:`free_run`.
        y: As in :func:`free_run`; ``y[depth:]`` is written.
        measured: Scaled measured output with history, shape ``(depth + n_steps,)``; read where a window's past is.
        depth: As in :func:`free_run`.
        n_steps: As in :func:`free_run`.
        input_channel: As in :func:`free_run`.
        input_lag: As in :func:`free_run`.
        output_lag: As in :func:`free_run`.
        theta: As in :func:`free_run`.
        n_neurons: As in :func:`free_run`.
        kind: As in :func:`free_run`.
        low: As in :func:`free_run`.
        high: As in :func:`free_run`.
        horizon: Samples after which the run begins anew from measured output: 1 for one step ahead, ``n_steps`` or more
            for a free run over the whole record.
        out: Predicted output, shape ``(n_steps,)``, written.
        h: Activations, shape ``(n_steps, n_neurons)``, written.
        c: Derivative with respect to each lagged output, shape ``(n_steps, n_output_regressors + 1)``, written;
            the last column is 0 where the output is clipped and 1 elsewhere.
    """
    n_in, n_out = len(input_lag), len(output_lag)
    n_x = n_in + n_out
    W = theta[: n_neurons * n_x].reshape(n_neurons, n_x)
    W_columns = np.ascontiguousarray(W.T)
    b = theta[n_neurons * n_x : n_neurons * (n_x + 1)]
    v = theta[n_neurons * (n_x + 1) : n_neurons * (n_x + 2)]
    linear = len(theta) > n_neurons * (n_x + 2) + 1
    constant = theta[n_neurons * (n_x + 2)]
    w = theta[n_neurons * (n_x + 2) + 1 : n_neurons * (n_x + 2) + 1 + n_x]
    V_columns = _gates(theta, n_neurons, n_x)
    gated = V_columns.shape[1] > 0
    x = np.empty(n_x)
    g = v.copy()
    slope, behind = np.empty(n_neurons), np.empty(n_neurons)
    for t in range(n_steps):
        window = depth + (t // horizon) * horizon
        for i in range(n_in):
            x[i] = u[depth + t - input_lag[i], input_channel[i]]
        for i in range(n_out):
            past = depth + t - output_lag[i]
            x[n_in + i] = y[past] if past >= window else measured[past]
        total = constant
        for i in range(n_out):
            c[t, i] = w[n_in + i] if linear else 0.0
        if linear:
            for i in range(n_x):
                total += w[i] * x[i]
        row = h[t]
        _affine(W_columns, b, x, row)
        activate_with_slopes(kind, row, slope)
        if gated:
            _affine(V_columns, v, x, g)
        # A loop that sums and writes is guarded by a check for overlapping memory, and takes another order of summation
        # where the guard, by where the arrays happen to lie, fires: results would depend on addresses.
        for k in range(n_neurons):
            total += g[k] * row[k]
        for k in range(n_neurons):
            behind[k] = g[k] * slope[k]
        for i in range(n_out):
            column = W_columns[n_in + i]
            derivative = 0.0
            for k in range(n_neurons):
                derivative += behind[k] * column[k]
            if gated:
                column = V_columns[n_in + i]
                for k in range(n_neurons):
                    derivative += row[k] * column[k]
            c[t, i] += derivative
        bounded = min(max(total, low), high) if not math.isnan(total) else total
        c[t, n_out] = 1.0 if bounded == total else 0.0
        out[t] = bounded
        y[depth + t] = bounded


@njit(cache=True, nogil=True, fastmath=FAST)
def sensitivities(
    u,
    y,
    measured,
    depth,
    first,
    n_rows,
    input_channel,
    input_lag,
    output_lag,
    theta,
    n_neurons,
    kind,
    horizon,
    h,
    c,
    carry,
    J,
):
    """Rows ``first`` to ``first + n_rows`` of the Jacobian of the output with respect to the parameters.

    The record is walked in blocks, so that a block of rows stays in cache until the normal equations have
    used it; ``J`` holds ``carry`` rows of the block before, which the caller moves to its head.

    Args:
        u: As in :func:`free_run`.
        y: As from :func:`activations`.
        measured: As in :func:`activations`.
        depth: As in :func:`free_run`.
        first: First step of the block.
        n_rows: Steps in the block.
        input_channel: As in :func:`free_run`.
        input_lag: As in :func:`free_run`.
        output_lag: As in :func:`free_run`.
        theta: As in :func:`free_run`.
        n_neurons: As in :func:`free_run`.
        kind: As in :func:`free_run`.
        horizon: As in :func:`activations`; with 1 the rows do not depend on each other.
        h: As from :func:`activations`.
        c: As from :func:`activations`.
        carry: Rows kept from the block before: the longest output lag.
        J: Shape ``(carry + n_rows, n_parameters)``; rows from ``carry`` on are written.
    """
    n_in, n_out = len(input_lag), len(output_lag)
    n_x = n_in + n_out
    n_p = len(theta)
    v = theta[n_neurons * (n_x + 1) : n_neurons * (n_x + 2)]
    bias_at = n_neurons * n_x
    constant_at = n_neurons * (n_x + 2)
    gates_at = constant_at + 1 + n_x
    linear = n_p > constant_at + 1
    V_columns = _gates(theta, n_neurons, n_x)
    gated = V_columns.shape[1] > 0
    x = np.empty(n_x)
    g = v.copy()
    sums, slope = np.empty(n_neurons), np.empty(n_neurons)
    for r in range(n_rows):
        t = first + r
        window = (t // horizon) * horizon
        row = J[carry + r]
        if c[t, n_out] == 0.0:
            row[:] = 0.0
            continue
        for i in range(n_in):
            x[i] = u[depth + t - input_lag[i], input_channel[i]]
        for i in range(n_out):
            past = t - output_lag[i]
            x[n_in + i] = y[depth + past] if past >= window else measured[depth + past]
        if gated:
            _affine(V_columns, v, x, g)
        if not slopes_of_values(kind, h[t], n_neurons, slope):
            slopes_of_sums(kind, theta, 0, n_neurons, x, n_x, sums, slope)
        for k in range(n_neurons):
            z, behind = h[t, k], g[k] * slope[k]
            at = k * n_x
            for i in range(n_x):
                row[at + i] = behind * x[i]
            row[bias_at + k] = behind
            row[bias_at + n_neurons + k] = z
            if gated:
                for i in range(n_x):
                    row[gates_at + at + i] = z * x[i]
        row[constant_at] = 1.0
        if linear:
            for i in range(n_x):
                row[constant_at + 1 + i] = x[i]
        for i in range(n_out):
            if t - output_lag[i] >= window:  # samples from before the window do not depend on the parameters
                factor = c[t, i]
                earlier = J[carry + r - output_lag[i]]
                for p in range(n_p):
                    row[p] += factor * earlier[p]


@njit(cache=True, nogil=True)
def predict(
    u, measured, y, steps, depth, n_steps, input_channel, input_lag, output_lag, theta, n_neurons, kind, low, high
):
    """Prediction ``steps`` ahead of every sample, writing ``y[depth:]``.

    Each sample is the end of a free run of ``steps`` steps that starts from measured output.

    Args:
        u: As in :func:`free_run`.
        measured: Scaled measured output with history, shape ``(depth + n_steps,)``.
        y: Shape ``(depth + n_steps,)``; ``y[depth:]`` is written.
        steps: How far ahead, at least 1.
        depth: As in :func:`free_run`.
        n_steps: As in :func:`free_run`.
        input_channel: As in :func:`free_run`.
        input_lag: As in :func:`free_run`.
        output_lag: As in :func:`free_run`.
        theta: As in :func:`free_run`.
        n_neurons: As in :func:`free_run`.
        kind: As in :func:`free_run`.
        low: As in :func:`free_run`.
        high: As in :func:`free_run`.
    """
    window = np.empty(depth + steps)
    for t in range(n_steps):
        run = min(steps, t + 1)
        first = t + 1 - run
        copy_numbers(measured[first : first + depth], window)
        free_run(u[first:], window, depth, run, input_channel, input_lag, output_lag, theta, n_neurons, kind, low, high)
        y[depth + t] = window[depth + run - 1]
