r"""A cascade of recursions in one compiled pass over the samples.

Each member is :math:`y_t = \mathrm{clip}(w x_t + c + V\tanh(W x_t + b))` in its own scaled numbers, with one or several
outputs, or with one output and gates (``sysid/kernels/recursion.py`` has the single one and its derivation). Members
run in order within a sample: one that reads an upstream output with lag 0 reads the value of the same sample. One may
also read the past of what is computed after it: models that stand in a circle, as reservoirs that feed each other do.

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

# In the pass over samples no function takes the Program itself: a call would copy the descriptions of its sixteen
# arrays, which costs as much as the network (measured: 34 ms instead of 16 for four members over 20,000 samples).

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
        column_late: Whether the channel is computed after the member that reads it, so that it is known one sample
            later.
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
    column_late: NDArray[np.bool_]
    output_first: NDArray[np.int64]
    output_column: NDArray[np.int64]
    output_channel: NDArray[np.int64]
    bounds: NDArray[np.float64]
    limits: NDArray[np.float64]
    limit_channel: NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def padded(n):
    """Neurons with their padding."""
    return (n + LANES - 1) // LANES * LANES


@njit(cache=True, nogil=True, error_model="numpy")
def gates_at(theta_first, m, n, n_x, n_y):
    """Where the gates of a member stand in the parameters; -1 for a member without."""
    first = theta_first[m] + n * (n_x + 1 + n_y) + n_y + n_y * n_x
    return first if theta_first[m + 1] > first else -1


@njit(cache=True, nogil=True, error_model="numpy")
def _side_by_side(p):
    """All members' weights ``[member, row, neuron]``, padded with zeros, and how wide each member's rows are.

    A row for each regressor and one for the constants: hidden weights and biases, and beside them, where there are
    gates, those of the gates, so that one pass over the regressors serves both. Without gates the readouts follow, row
    by row.
    """
    members = len(p.neurons)
    rows, across = 0, np.empty(members, dtype=np.int64)
    for m in range(members):
        n_x, n_y = p.regressor_first[m + 1] - p.regressor_first[m], p.output_first[m + 1] - p.output_first[m]
        gated = gates_at(p.theta_first, m, p.neurons[m], n_x, n_y) >= 0
        rows, across[m] = max(rows, n_x + 1 + n_y), padded(p.neurons[m]) * (2 if gated else 1)
    weights = np.zeros((members, rows, across.max()))
    for m in range(members):
        n_x, n_y = p.regressor_first[m + 1] - p.regressor_first[m], p.output_first[m + 1] - p.output_first[m]
        n, at = p.neurons[m], p.theta_first[m]
        gates, beside = gates_at(p.theta_first, m, n, n_x, n_y), padded(n)
        for k in range(n):
            for i in range(n_x):
                weights[m, i, k] = p.theta[at + k * n_x + i]
                if gates >= 0:
                    weights[m, i, beside + k] = p.theta[gates + k * n_x + i]
            weights[m, n_x, k] = p.theta[at + n * n_x + k]
            for j in range(n_y):
                row, column = (n_x, beside + k) if gates >= 0 else (n_x + 1 + j, k)
                weights[m, row, column] = p.theta[at + n * (n_x + 1) + j * n + k]
    return weights, across


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _affine(weights, m, n_x, x, out):
    """The affine functions of the regressors of a member's neurons and gates.

    Four columns at a time, or loading and storing the sums would take most of it.
    """
    n = len(out)
    for k in range(n):
        out[k] = weights[m, n_x, k]
    fours = n_x // 4 * 4
    for i in range(0, fours, 4):
        x0, x1, x2, x3 = x[i], x[i + 1], x[i + 2], x[i + 3]
        for k in range(n):
            out[k] += (
                weights[m, i, k] * x0
                + weights[m, i + 1, k] * x1
                + weights[m, i + 2, k] * x2
                + weights[m, i + 3, k] * x3
            )
    for i in range(fours, n_x):
        value = x[i]
        for k in range(n):
            out[k] += weights[m, i, k] * value


@njit(cache=True, nogil=True, error_model="numpy")
def _bounded(y, low, high):
    """A scaled output within the network's bound, and whether that held it; NaN passes."""
    if y < low:
        return low, LOST
    if y > high:
        return high, LOST
    return y, FREE


@njit(cache=True, nogil=True, error_model="numpy")
def _limited(value, code, low, high, low_code, high_code):
    """A value within its limits, and what held it; the lower limit comes last, so that it wins where the two cross."""
    if value > high:
        value, code = high, high_code
    if value < low:
        value, code = low, low_code
    return value, code


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
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
    weights, across = _side_by_side(p)
    x = np.empty(weights.shape[1])
    flat, wide_z = z.reshape(-1), z.shape[1]
    back = p.regressor_lag * wide_z - p.regressor_column
    per_scale = 1.0 / p.column_scale
    sums = np.empty(weights.shape[2])
    for t in range(depth):
        for column in range(len(p.column_channel)):
            z[t, column] = (rest[p.column_channel[column]] - p.column_offset[column]) / p.column_scale[column]
    for t in range(len(values)):
        now = depth + t
        at_neuron = 0
        for m in range(len(p.neurons)):
            n, wide = p.neurons[m], padded(p.neurons[m])
            first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
            first_y, n_y = p.output_first[m], p.output_first[m + 1] - p.output_first[m]
            for column in range(p.column_first[m], p.column_first[m + 1] - n_y):
                late = 1 if p.column_late[column] else 0
                if late <= t:  # what came before sample 0 stands there already
                    value = values[t - late, p.column_channel[column]]
                    z[now - late, column] = (value - p.column_offset[column]) * per_scale[column]
            here = now * wide_z
            for i in range(n_x):
                x[i] = flat[here - back[first_x + i]]
            _affine(weights, m, n_x, x, sums[: across[m]])
            h, g = sums[:wide], sums[wide : across[m]]
            tanh_in_place(h)
            at = p.theta_first[m] + n * (n_x + 1 + n_y)
            linear = p.theta_first[m + 1] > at + n_y
            gated = across[m] > wide
            for j in range(n_y):
                total = p.theta[at + j]
                if gated:
                    for k in range(wide):
                        total += g[k] * h[k]
                else:
                    for k in range(wide):
                        total += weights[m, n_x + 1 + j, k] * h[k]
                if linear:
                    for i in range(n_x):
                        total += p.theta[at + n_y + j * n_x + i] * x[i]
                o = first_y + j
                column = p.output_column[o]
                scaled, code = _bounded(total, p.bounds[o, 0], p.bounds[o, 1])
                value = scaled * p.column_scale[column] + p.column_offset[column]
                low, high, low_code, high_code = p.limits[o, 0], p.limits[o, 1], LOW, HIGH
                if p.limit_channel[o, 0] >= 0:
                    low, low_code = values[t, p.limit_channel[o, 0]], LOW_CHANNEL
                if p.limit_channel[o, 1] >= 0:
                    high, high_code = values[t, p.limit_channel[o, 1]], HIGH_CHANNEL
                limited, held_by = _limited(value, code, low, high, low_code, high_code)
                if held_by != code:
                    scaled = (limited - p.column_offset[column]) * per_scale[column]
                z[now, column] = scaled
                values[t, p.output_channel[o]] = limited
                held[t, o] = held_by
            if len(kept) > 0:
                for k in range(n):
                    kept[t, at_neuron + k] = h[k]
            at_neuron += n
