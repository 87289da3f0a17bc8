r"""A cascade over several records in lockstep, one in each lane of the vector registers.

A free run is a chain: each sample waits for the one before, each member for those upstream, and for one record much of
the time is spent waiting. Records in lockstep are chains that wait side by side, share the reading of weights and
tables, and fill whole registers whatever the number of neurons. What is computed for each is the same as in
``sysid/kernels/cascade.py``, but for the order of summation.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sysid.kernels.arrays import FAST, copy_numbers, copy_rows
from sysid.kernels.cascade_layout import FREE, HIGH, HIGH_CHANNEL, LOW, LOW_CHANNEL, gates_at
from sysid.kernels.held_sums import bounded, limited
from sysid.kernels.neurons.table import activate
from sysid.kernels.register_machine import evaluate

CHUNK = 128
"""Samples of which the past is kept at a time, so that it stays in the second-level cache."""

# The number of lanes is read from an array everywhere: loops of a small constant length are unrolled before they can be
# vectorised, which made this slower than one record at a time.


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _affine(theta, first, constants, n, n_x, x, h):
    """One affine function for each neuron in all lanes, two neurons and four regressors at a time."""
    lanes = x.shape[1]
    fours, pairs = n_x // 4 * 4, n // 2 * 2
    for k in range(n):
        b = theta[constants + k]
        for lane in range(lanes):
            h[k, lane] = b
    for k in range(0, pairs, 2):
        for i in range(0, fours, 4):
            p, q = first + k * n_x + i, first + (k + 1) * n_x + i
            p0, p1, p2, p3 = theta[p], theta[p + 1], theta[p + 2], theta[p + 3]
            q0, q1, q2, q3 = theta[q], theta[q + 1], theta[q + 2], theta[q + 3]
            for lane in range(lanes):
                h[k, lane] += p0 * x[i, lane] + p1 * x[i + 1, lane] + p2 * x[i + 2, lane] + p3 * x[i + 3, lane]
                h[k + 1, lane] += q0 * x[i, lane] + q1 * x[i + 1, lane] + q2 * x[i + 2, lane] + q3 * x[i + 3, lane]
    for k in range(n):
        for i in range(fours if k < pairs else 0, n_x):
            w = theta[first + k * n_x + i]
            for lane in range(lanes):
                h[k, lane] += w * x[i, lane]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _weighted(total, theta, first, n, a):
    """Add the weighted rows of ``a`` to the totals of all lanes."""
    for k in range(n):
        w = theta[first + k]
        for lane in range(len(total)):
            total[lane] += w * a[k, lane]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _products(total, g, n, h):
    """Add the sums of the products of two arrays to the totals of all lanes."""
    for k in range(n):
        for lane in range(len(total)):
            total[lane] += g[k, lane] * h[k, lane]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _outside(value, low_bound, high_bound, low, high):
    """Count the lanes in which something holds the value."""
    count = 0
    for lane in range(len(value)):
        # Written so that a value that is not a number counts: the slow way keeps it.
        inside = (value[lane] >= low_bound) & (value[lane] <= high_bound)
        inside &= (value[lane] >= low[lane]) & (value[lane] <= high[lane])
        count += 0 if inside else 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _hold(value, codes, low_bound, high_bound, low, high, low_code, high_code):
    """Hold values within bounds and limits, lane by lane."""
    for lane in range(len(value)):
        inside, code = bounded(value[lane], low_bound, high_bound)
        value[lane], codes[lane] = limited(inside, code, low[lane], high[lane], low_code, high_code)


@njit(cache=True, nogil=True, error_model="numpy")
def _limits(p, o, now_values, low, high):
    """Write the limits of an output into all lanes; what they would be called where they hold."""
    low[:], high[:] = p.limits[o, 0], p.limits[o, 1]
    low_code, high_code = LOW, HIGH
    if p.limit_channel[o, 0] >= 0:
        low_code = LOW_CHANNEL
        copy_numbers(now_values[p.limit_channel[o, 0]], low)
    if p.limit_channel[o, 1] >= 0:
        high_code = HIGH_CHANNEL
        copy_numbers(now_values[p.limit_channel[o, 1]], high)
    return low_code, high_code


@njit(cache=True, nogil=True, error_model="numpy")
def _add_equation(total, e, m, v, x, n_x):
    """Add what an equation gives to the totals of all lanes, one after the other."""
    for lane in range(len(total)):
        for i in range(n_x):
            v[e.given[m] + i] = x[i, lane]
        evaluate(e.code, e.code_first[m], e.code_first[m + 1], v, e.first[m], e.widths, e.places, e.table)
        total[lane] += v[e.result[m]]


@njit(cache=True, nogil=True, error_model="numpy")
def _sizes(p):
    width, neurons = 1, 1
    for m in range(len(p.neurons)):
        width = max(width, p.regressor_first[m + 1] - p.regressor_first[m])
        neurons = max(neurons, p.neurons[m])
    return width, neurons


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def run(p, theta, bounds, depth, rest, lanes, values, held):
    """Run all members over all samples of some records, writing the outputs into ``values``.

    Args:
        p: The members.
        theta: Their parameters as they act between channels in their units, as a layout has them.
        bounds: Of each output in its unit, likewise.
        depth: Past samples before sample 0: the longest lag.
        rest: Value of every channel before sample 0 in each record, in its unit, shape ``(n_records, n_channels)``.
        lanes: At least as many as records; a multiple of four leaves no remainder beside the registers.
        values: Shape ``(n_records, n_samples, n_channels)``, in units; inputs are read, outputs written.
        held: What held each output at each sample, shape ``(n_records, n_samples, n_outputs)``, written.
    """
    width, most = _sizes(p)
    records, samples, channels = values.shape
    x, hidden = np.zeros((width, lanes)), np.zeros(most * lanes)
    h, g = hidden.reshape(most, lanes), np.zeros((most, lanes))
    low, high, codes = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes, dtype=np.int8)
    registers = p.equations.registers.copy()
    # Lanes without a record of their own repeat the last one.
    record = np.minimum(np.arange(lanes), records - 1)
    past = np.zeros((depth + CHUNK, channels, lanes))
    for lane in range(lanes):
        for row in range(depth):
            copy_numbers(rest[record[lane]], past[row, :, lane])
    is_output = np.zeros(channels, dtype=np.bool_)
    is_output[p.output_channel] = True
    for t in range(samples):
        if t > 0 and t % CHUNK == 0:
            last = past[CHUNK : CHUNK + depth].copy()
            for row in range(depth):
                copy_rows(last[row], past[row])
        now = depth + t % CHUNK
        now_values = past[now]
        for channel in range(channels):
            if not is_output[channel]:
                for lane in range(lanes):
                    now_values[channel, lane] = values[record[lane], t, channel]
        for m in range(len(p.neurons)):
            n = p.neurons[m]
            first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
            first_y, n_y = p.output_first[m], p.output_first[m + 1] - p.output_first[m]
            for i in range(n_x):
                copy_numbers(past[now - p.regressor_lag[first_x + i], p.regressor_channel[first_x + i]], x[i])
            own, gates = p.theta_first[m], gates_at(p.theta_first, m, n, n_x, n_y)
            _affine(theta, own, own + n * n_x, n, n_x, x, h)
            activate(p.kinds[m], hidden, 0, n * lanes)
            if gates >= 0:
                _affine(theta, gates, own + n * (n_x + 1), n, n_x, x, g)
            at = own + n * (n_x + 1 + n_y)
            linear = p.theta_first[m + 1] > at + n_y
            for j in range(n_y):
                o = first_y + j
                channel = p.output_channel[o]
                low_code, high_code = _limits(p, o, now_values, low, high)
                value = now_values[channel]
                value[:] = theta[at + j]
                if gates >= 0:
                    _products(value, g, n, h)
                else:
                    _weighted(value, theta, own + n * (n_x + 1) + j * n, n, h)
                if linear:
                    _weighted(value, theta, at + n_y + j * n_x, n_x, x)
                elif p.equations.is_one[m]:
                    _add_equation(value, p.equations, m, registers, x, n_x)
                codes[:] = FREE
                if _outside(value, bounds[o, 0], bounds[o, 1], low, high):
                    _hold(value, codes, bounds[o, 0], bounds[o, 1], low, high, low_code, high_code)
                for lane in range(records):
                    values[lane, t, channel] = value[lane]
                    held[lane, t, o] = codes[lane]
