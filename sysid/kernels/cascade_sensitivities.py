r"""Sensitivities of a cascade's outputs with respect to the parameters of its members, forward and exact.

With the notation of ``sysid/kernels/cascade.py``, let :math:`\theta` be the parameters of all members that are trained.
For output :math:`j` of a member, with :math:`s_{jk} = g_{jk}(1 - h_k^2)`, where :math:`g_{jk}` is what stands before
the activation (the readout, or the gate), and regressor :math:`i` being output :math:`\kappa(i)`, in the member's
scaled numbers, with lag :math:`l_i`,

.. math::
    \frac{d y_{j,t}}{d\theta} = \frac{\partial y_{j,t}}{\partial\theta}
      + \sum_i c_{ji,t}\,\frac{d y_{\kappa(i),\,t-l_i}}{d\theta},
    \qquad c_{ji,t} = w_{ji} + \sum_k \Bigl(s_{jk,t} W_{ki} + h_{k,t} \frac{\partial g_{jk,t}}{\partial x_i}\Bigr).

The sum runs over regressors that are an output of the cascade, the member's own or an upstream one: the
sensitivity of the upstream output is an input of the downstream recursion, scaled from the one's numbers to the
other's. Inputs of the whole contribute nothing. An output held by a constant has a zero row; held by a channel, it has
that channel's row.

Rows end after the parameters of the member itself: no output depends on members that run later.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sysid.kernels.cascade_layout import FREE, HIGH_CHANNEL, LOW_CHANNEL, gates_at

_FAST = {"reassoc", "contract", "arcp", "nsz"}


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _add(row, factor, past, n):
    for i in range(n):
        row[i] += factor * past[i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _add_four(row, f0, f1, f2, f3, p0, p1, p2, p3, n):
    for i in range(n):
        row[i] += f0 * p0[i] + f1 * p1[i] + f2 * p2[i] + f3 * p3[i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _gains(g, theta, readout, gates, n, n_x, x):
    """What stands before each activation: the readout, and the gate of a member that has gates."""
    for k in range(n):
        g[k] = theta[readout + k]
        if gates >= 0:
            for i in range(n_x):
                g[k] += theta[gates + k * n_x + i] * x[i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _own(row, at, gates, j, n, n_x, n_y, linear, x, h, g):
    """The part of a row that does not go through earlier samples; ``at`` is where the member's parameters stand."""
    for k in range(n):
        slope = g[k] * (1.0 - h[k] * h[k])
        for i in range(n_x):
            row[at + k * n_x + i] = slope * x[i]
        row[at + n * n_x + k] = slope
        row[at + n * (n_x + 1) + j * n + k] = h[k]
    constants = at + n * (n_x + 1 + n_y)
    row[constants + j] = 1.0
    if linear:
        for i in range(n_x):
            row[constants + n_y + j * n_x + i] = x[i]
    if gates >= 0:
        for k in range(n):
            for i in range(n_x):
                row[gates + k * n_x + i] = h[k] * x[i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _factors(c, theta, first, gates, j, n, n_x, n_y, linear, h, g):
    """Derivative of an output with respect to each regressor."""
    weights = first + n * (n_x + 1 + n_y) + n_y + j * n_x
    for i in range(n_x):
        c[i] = theta[weights + i] if linear else 0.0
    for k in range(n):
        slope = g[k] * (1.0 - h[k] * h[k])
        for i in range(n_x):
            c[i] += slope * theta[first + k * n_x + i]
        if gates >= 0:
            for i in range(n_x):
                c[i] += h[k] * theta[gates + k * n_x + i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _through_the_past(row, c, p, m, t, here, extent, source, J):
    """Add what earlier samples and upstream outputs pass on; regressors of one channel stand side by side."""
    first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
    i = 0
    while i < n_x:
        s, end = source[first_x + i], i + 1
        while end < n_x and p.regressor_channel[first_x + end] == p.regressor_channel[first_x + i]:
            end += 1
        stop = end
        # Samples before the first do not depend on the parameters.
        while end > i and t < p.regressor_lag[first_x + end - 1]:
            end -= 1
        if s >= 0 and extent[s] > 0:
            ratio = p.output_scale[s] / p.regressor_scale[first_x + i]
            while end - i >= 4:
                lag = p.regressor_lag[first_x + i : first_x + i + 4]
                _add_four(
                    row, ratio * c[i], ratio * c[i + 1], ratio * c[i + 2], ratio * c[i + 3],
                    J[s, here - lag[0]], J[s, here - lag[1]], J[s, here - lag[2]], J[s, here - lag[3]],
                    extent[s],
                )  # fmt: skip
                i += 4
            while i < end:
                _add(row, ratio * c[i], J[s, here - p.regressor_lag[first_x + i]], extent[s])
                i += 1
        i = stop


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivities(p, rest, first, n_rows, values, kept, held, own_first, extent, source, carry, J):
    """Rows ``first`` to ``first + n_rows`` of the Jacobians of all outputs, in their scaled numbers.

    The record is walked in blocks; ``J`` holds ``carry`` rows of the block before, which the caller moves to its head.

    Args:
        p: The members.
        rest: As in the pass over the samples.
        first: First sample of the block.
        n_rows: Samples in the block.
        values: As from the pass, shape ``(n_samples, n_channels)``.
        kept: As from the pass, shape ``(n_samples, n_neurons)``.
        held: As from the pass, shape ``(n_samples, n_outputs)``.
        own_first: Where each member's parameters stand in a row; -1 for a member that is not trained.
        extent: Length of each output's row: after it there are zeros, which are not written.
        source: Output that each regressor reads; -1 for an input of the whole.
        carry: Rows kept from the block before: the longest lag of a regressor with a source.
        J: Shape ``(n_outputs, carry + n_rows, n_parameters)``; rows from ``carry`` on are written.
    """
    members, width = len(p.neurons), 0
    for m in range(members):
        width = max(width, p.regressor_first[m + 1] - p.regressor_first[m])
    x, c, g = np.empty(width), np.empty(width), np.empty(p.neurons.max())
    for r in range(n_rows):
        t = first + r
        at_neuron = 0
        for m in range(members):
            n = p.neurons[m]
            first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
            first_y, n_y = p.output_first[m], p.output_first[m + 1] - p.output_first[m]
            h = kept[t, at_neuron : at_neuron + n]
            at_neuron += n
            for i in range(n_x):
                before, channel = t - p.regressor_lag[first_x + i], p.regressor_channel[first_x + i]
                value = values[before, channel] if before >= 0 else rest[channel]
                x[i] = (value - p.regressor_offset[first_x + i]) / p.regressor_scale[first_x + i]
            linear = p.theta_first[m + 1] - p.theta_first[m] > n * (n_x + 1 + n_y) + n_y
            gates = gates_at(p.theta_first, m, n, n_x, n_y)
            for j in range(n_y):
                o = first_y + j
                row = J[o, carry + r]
                row[: extent[o]] = 0.0
                code = held[t, o]
                if code != FREE:
                    if code in (LOW_CHANNEL, HIGH_CHANNEL):
                        channel = p.limit_channel[o, 0 if code == LOW_CHANNEL else 1]
                        for s in range(o):
                            if p.output_channel[s] == channel:
                                _add(row, p.output_scale[s] / p.output_scale[o], J[s, carry + r], extent[s])
                    continue
                if extent[o] == 0:
                    continue
                _gains(g, p.theta, p.theta_first[m] + n * (n_x + 1) + j * n, gates, n, n_x, x)
                if own_first[m] >= 0:
                    own_gates = own_first[m] + gates - p.theta_first[m] if gates >= 0 else -1
                    _own(row, own_first[m], own_gates, j, n, n_x, n_y, linear, x, h, g)
                _factors(c, p.theta, p.theta_first[m], gates, j, n, n_x, n_y, linear, h, g)
                _through_the_past(row, c, p, m, t, carry + r, extent, source, J)
