r"""A cascade of recursions in one compiled pass over the samples.

Each member is :math:`y_t = \mathrm{clip}(w x_t + c + V\tanh(W x_t + b))` in its own scaled numbers, with one or several
outputs (``sysid/kernels/recursion.py`` has the single one and its derivation). Members run in order within a sample:
one that reads an upstream output with lag 0 reads the value of the same sample.

All members' columns stand side by side in one array ``z``: for each member its scaled inputs, then its scaled outputs,
extended to the left by ``depth`` past samples. A regressor is a column of ``z`` and a lag, whatever it means; a
channel that two members read stands there twice, scaled for each. ``values`` holds every channel once, in its unit.

Limits hold an output between two values in its unit, each a constant or another channel at the same sample. The held
value is the channel's: the member itself reads it as its past output.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sysid.kernels.recursion import tanh_in_place

_FAST = {"reassoc", "contract", "arcp", "nsz"}

FREE, LOW, HIGH, LOW_CHANNEL, HIGH_CHANNEL, LOST = 0, 1, 2, 3, 4, 5
"""What held an output at a sample: nothing; a constant limit; a limit that is a channel; the bound of the network."""

LANES = 8
"""Neurons are padded to a multiple of a vector register: scalar remainders of tanh cost as much as a whole register."""


class Program(NamedTuple):
    """Members and their wiring as flat tables.

    Attributes:
        theta: Parameters of all members, one after the other.
        theta_first: Where each member's begin; one more entry than members.
        neurons: Neurons of each member.
        regressor_first: Where each member's regressors begin; one more entry than members.
        regressor_column: Column of ``z`` that each regressor reads.
        regressor_lag: Its lag in samples.
        column_first: Where each member's columns of ``z`` begin; one more entry than members.
        column_channel: Column of ``values`` behind each column of ``z``.
        column_offset: In the channel's unit.
        column_scale: In the channel's unit.
        output_first: Where each member's outputs begin among all; one more entry than members.
        output_column: Column of ``z`` of each output.
        output_channel: Column of ``values`` of each output.
        bounds: Lower and upper bound of each output in scaled numbers, shape ``(n_outputs, 2)``.
        limits: Lower and upper limit of each output in its unit, shape ``(n_outputs, 2)``; infinite for none.
        limit_channel: Column of ``values`` that is the limit instead, shape ``(n_outputs, 2)``; -1 for none.
    """

    theta: NDArray[np.float64]
    theta_first: NDArray[np.int64]
    neurons: NDArray[np.int64]
    regressor_first: NDArray[np.int64]
    regressor_column: NDArray[np.int64]
    regressor_lag: NDArray[np.int64]
    column_first: NDArray[np.int64]
    column_channel: NDArray[np.int64]
    column_offset: NDArray[np.float64]
    column_scale: NDArray[np.float64]
    output_first: NDArray[np.int64]
    output_column: NDArray[np.int64]
    output_channel: NDArray[np.int64]
    bounds: NDArray[np.float64]
    limits: NDArray[np.float64]
    limit_channel: NDArray[np.int64]


@njit(cache=True, nogil=True)
def padded(n):
    """Neurons with their padding."""
    return (n + LANES - 1) // LANES * LANES


@njit(cache=True, nogil=True)
def _unpacked(p):
    """Hidden weights by column, biases and readouts of all members, padded with zeros; where each begins; sizes."""
    members = len(p.neurons)
    width, rows = 0, 0
    first = np.zeros(members + 1, dtype=np.int64)
    for m in range(members):
        n_x = p.regressor_first[m + 1] - p.regressor_first[m]
        n_y = p.output_first[m + 1] - p.output_first[m]
        first[m + 1] = first[m] + (n_x + 1 + n_y) * padded(p.neurons[m])
        width = max(width, n_x)
        rows = max(rows, padded(p.neurons[m]))
    flat = np.zeros(first[members])
    for m in range(members):
        n_x = p.regressor_first[m + 1] - p.regressor_first[m]
        n_y = p.output_first[m + 1] - p.output_first[m]
        n, wide, at = p.neurons[m], padded(p.neurons[m]), p.theta_first[m]
        part = flat[first[m] : first[m + 1]].reshape(n_x + 1 + n_y, wide) if wide > 0 else flat[:0].reshape(0, 0)
        for k in range(n):
            for i in range(n_x):
                part[i, k] = p.theta[at + k * n_x + i]
            part[n_x, k] = p.theta[at + n * n_x + k]
            for j in range(n_y):
                part[n_x + 1 + j, k] = p.theta[at + n * (n_x + 1) + j * n + k]
    return flat, first, width, rows


@njit(cache=True, nogil=True, fastmath=_FAST)
def _neurons(part, n_x, x, h):
    """Activations of one member: part holds the hidden weights by column, then the biases."""
    n = len(h)
    bias = part[n_x]
    for k in range(n):
        h[k] = bias[k]
    for i in range(n_x):
        value = x[i]
        column = part[i]
        for k in range(n):
            h[k] += column[k] * value
    tanh_in_place(h)


@njit(cache=True, nogil=True, fastmath=_FAST)
def _dot(a, b, n):
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total


@njit(cache=True, nogil=True)
def _held(p, o, y, values, t):
    """An output within its bound and limits: its scaled value, its value in its unit, and what held it."""
    code = FREE
    if y < p.bounds[o, 0]:
        y, code = p.bounds[o, 0], LOST
    elif y > p.bounds[o, 1]:
        y, code = p.bounds[o, 1], LOST
    column = p.output_column[o]
    value = y * p.column_scale[column] + p.column_offset[column]
    low, high = p.limits[o, 0], p.limits[o, 1]
    below, above = LOW, HIGH
    if p.limit_channel[o, 0] >= 0:
        low, below = values[t, p.limit_channel[o, 0]], LOW_CHANNEL
    if p.limit_channel[o, 1] >= 0:
        high, above = values[t, p.limit_channel[o, 1]], HIGH_CHANNEL
    # The lower limit comes last, so that it wins where the two cross.
    limited, held = value, code
    if limited > high:
        limited, held = high, above
    if limited < low:
        limited, held = low, below
    if held != code:
        return (limited - p.column_offset[column]) / p.column_scale[column], limited, held
    return y, value, code


@njit(cache=True, nogil=True, fastmath=_FAST)
def run(p, depth, rest, values, z, kept, held):
    """Run all members over all samples, writing the outputs into ``values``.

    Args:
        p: The members.
        depth: Past samples before sample 0: the longest lag.
        rest: Value of every channel before sample 0, in its unit, shape ``(n_channels,)``.
        values: Shape ``(n_samples, n_channels)``, in units; inputs are read, outputs written.
        z: Shape ``(depth + n_samples, n_columns)``, written.
        kept: Activations of all members side by side, shape ``(n_samples, n_neurons)``, written; shape ``(0, 0)``
            where nobody needs them.
        held: What held each output at each sample, shape ``(n_samples, n_outputs)``, written.
    """
    flat, first, width, rows = _unpacked(p)
    x = np.empty(width)
    h_all = np.empty(rows)
    members = len(p.neurons)
    for t in range(depth):
        for column in range(len(p.column_channel)):
            z[t, column] = (rest[p.column_channel[column]] - p.column_offset[column]) / p.column_scale[column]
    for t in range(len(values)):
        now = depth + t
        at_neuron = 0
        for m in range(members):
            n, wide = p.neurons[m], padded(p.neurons[m])
            first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
            first_y, n_y = p.output_first[m], p.output_first[m + 1] - p.output_first[m]
            for column in range(p.column_first[m], p.column_first[m + 1] - n_y):
                value = values[t, p.column_channel[column]]
                z[now, column] = (value - p.column_offset[column]) / p.column_scale[column]
            for i in range(n_x):
                x[i] = z[now - p.regressor_lag[first_x + i], p.regressor_column[first_x + i]]
            h = h_all[:wide]
            if n > 0:
                part = flat[first[m] : first[m + 1]].reshape(n_x + 1 + n_y, wide)
                _neurons(part, n_x, x, h)
            at = p.theta_first[m] + n * (n_x + 1 + n_y)
            linear = p.theta_first[m + 1] > at + n_y
            for j in range(n_y):
                total = p.theta[at + j]
                if linear:
                    total += _dot(p.theta[at + n_y + j * n_x :], x, n_x)
                if n > 0:
                    total += _dot(part[n_x + 1 + j], h, wide)
                o = first_y + j
                scaled, value, code = _held(p, o, total, values, t)
                z[now, p.output_column[o]] = scaled
                values[t, p.output_channel[o]] = value
                held[t, o] = code
            if len(kept) > 0:
                kept[t, at_neuron : at_neuron + n] = h[:n]
            at_neuron += n
