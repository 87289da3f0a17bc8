r"""The recursion of a lagged network, its free run and its prediction, compiled.

With the regressors :math:`x_t` (lagged inputs, then lagged outputs) one step is

.. math::
    \hat y_t = \mathrm{clip}\bigl(w^T x_t + c + \textstyle\sum_k g_{t,k} h_{t,k}\bigr),
    \qquad h_{t,k} = \sigma(W_k x_t + b_k), \qquad g_{t,k} = v_k + V_k x_t.

Without gates :math:`V = 0`: a layer of neurons of one kind (``sysid/kernels/neurons``; tanh, unless something else is
said) and its readout. With them each neuron switches a linear function
of the regressors on and off, which is what a valve does to a flow: the rate of a filling volume is a product, which a
plain layer has to put together out of many neurons.

In a free run the lagged outputs in :math:`x_t` are the recursion's own. Differentiated with respect to its parameters
it is a cascade of one (``sysid/kernels/cascade_sensitivities.py``).

Parameters are one flat vector ``[W (n_neurons, n_regressors) | b | v | c | w | V (n_neurons, n_regressors)]``. Gates
``V`` and linear part ``w`` stand last so that a network without them is a shorter vector (gates come with a linear part
only); no neurons at all leaves ``[c | w]``, an ARX model with an intercept. Everything is in the model's scaled
numbers. Time is extended to the left by ``depth`` past samples, so that ``u[depth + t]`` and ``y[depth + t]`` belong to
step ``t``.

Limits: one output.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sysid.kernels.arrays import FAST, copy_numbers
from sysid.kernels.cascade_layout import from_a_line, padded, put
from sysid.kernels.held_sums import bounded, weighted
from sysid.kernels.neurons.table import activate
from sysid.kernels.registers import LANES, affine, dot


@njit(cache=True, nogil=True)
def _packed(theta, n, n_x):
    """Weights of neurons and gates in blocks, how many of them are the gates', the readout and the linear part."""
    wide, constant = padded(n), n * (n_x + 2)
    gated, linear = n > 0 and len(theta) > constant + 1 + n_x, len(theta) > constant + 1
    weights, readout, w = from_a_line(2 * wide * (n_x + 1)), from_a_line(wide), np.zeros(n_x)
    gates_at = put(weights, 0, theta, 0, n * n_x, n, n_x)
    if gated:
        put(weights, gates_at, theta, constant + 1 + n_x, n * (n_x + 1), n, n_x)
    for k in range(n):
        readout[k] = theta[n * (n_x + 1) + k]
    for i in range(n_x if linear else 0):
        w[i] = theta[constant + 1 + i]
    return weights, wide // LANES if gated else 0, readout, w


# The pass of a whole (``_walk`` in ``sysid/kernels/cascade.py``) runs one network, too, and does not stand in for this
# one: its plan is some fifty arrays, which a call unpacks in 6 to 8 us (measured: 12 to 14 us for 10 samples; 5 to 7
# here), and the way through levels and limits takes 7 to 13 % longer a sample for up to 12 neurons. Their last digits
# differ, by the order in which constant, linear part and neurons are summed. What both compute is written once, in
# ``sysid/kernels/held_sums.py``, ``registers.py`` and ``neurons``.


@njit(cache=True, nogil=True, fastmath=FAST)
def _run(
    u, first, y, out, depth, n_steps, input_channel, input_lag, output_lag, weights, gate_blocks, readout, w, constant,
    kind, low, high, kept, held,
):  # fmt: skip
    """The recursion over the rows of ``y`` after the first ``depth``, which are rows ``first`` on of ``u``.

    Lags and channels are unsigned: of others numba looks at the sign, each time.
    """
    n_in, n_out, wide = np.uintp(len(input_lag)), np.uintp(len(output_lag)), len(readout)
    n_x = n_in + n_out
    x, h, g = np.empty(n_x), from_a_line(wide), from_a_line(wide)
    copy_numbers(readout, g)
    for t in range(n_steps):
        row, own = np.uintp(first + depth + t), np.uintp(depth + t)
        for i in range(n_in):
            x[i] = u[row - input_lag[i], input_channel[i]]
        for i in range(n_out):
            x[n_in + i] = y[own - output_lag[i]]
        total = weighted(constant, w, 0, x, 0, n_x)
        if wide > 0:
            affine(weights, 0, n_x, x, 0, h, 0, wide // LANES, g, 0, gate_blocks)
            activate(kind, h, 0, wide)
            total += dot(g, 0, h, 0, wide // LANES)
        out[depth + t], code = bounded(total, low, high)
        if len(held) > 0:
            held[t, 0] = code
            for k in range(kept.shape[1]):
                kept[t, k] = h[k]


@njit(cache=True, nogil=True)
def free_run(
    u, y, out, depth, n_steps, input_channel, input_lag, output_lag, theta, n_neurons, kind, low, high, kept, held
):
    """Run the recursion on its own output, or on a measured one.

    Args:
        u: Scaled inputs with history, shape ``(depth + n_steps, n_inputs)``.
        y: Scaled outputs with history that are read, shape ``(depth + n_steps,)``.
        out: Where outputs are written, from ``depth`` on: ``y`` itself in a free run, another array one step ahead.
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
        kept: Activations, shape ``(n_steps, n_neurons)``, written.
        held: Whether a bound held the output, ``FREE`` or ``LOST``, shape ``(n_steps, 1)``, written; without rows where
            nobody needs either.
    """
    n_x = len(input_lag) + len(output_lag)
    weights, gate_blocks, readout, w = _packed(theta, n_neurons, n_x)
    _run(
        u, 0, y, out, depth, n_steps, input_channel.view(np.uintp), input_lag.view(np.uintp), output_lag.view(np.uintp),
        weights, gate_blocks, readout, w, theta[n_neurons * (n_x + 2)], kind, low, high, kept, held,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def predict(
    u, measured, y, steps, depth, n_steps, input_channel, input_lag, output_lag, theta, n_neurons, kind, low, high,
    kept, held,
):  # fmt: skip
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
        kept: As in :func:`free_run`, without rows.
        held: As in :func:`free_run`, without rows.
    """
    n_x = len(input_lag) + len(output_lag)
    weights, gate_blocks, readout, w = _packed(theta, n_neurons, n_x)
    constant, window = theta[n_neurons * (n_x + 2)], np.empty(depth + steps)
    channels, lags, own_lags = input_channel.view(np.uintp), input_lag.view(np.uintp), output_lag.view(np.uintp)
    for t in range(n_steps):
        run = min(steps, t + 1)
        first = t + 1 - run
        for i in range(depth):
            window[i] = measured[first + i]
        _run(
            u, first, window, window, depth, run, channels, lags, own_lags, weights, gate_blocks, readout, w, constant,
            kind, low, high, kept, held,
        )  # fmt: skip
        y[depth + t] = window[depth + run - 1]
