r"""A cascade of recursions in one compiled pass over the samples.

Each member is :math:`y_t = \mathrm{clip}(w x_t + c + V\tanh(W x_t + b))` in its own scaled numbers, with one or several
outputs, or with one output and gates (``sysid/kernels/recursion.py`` has the single one and its derivation). Members
run in order within a sample: one that reads an upstream output with lag 0 reads the value of the same sample. One may
also read the past of what is computed after it: models that stand in a circle, as reservoirs that feed each other do.

``values`` holds every channel once, in its unit, and a regressor is one of them and a lag, whatever it means. What
scales it stands in the weights: where a member reads :math:`x = (u - o) / s`, the weights :math:`W / s` act on
:math:`u` itself, and the constants lose :math:`W o / s`. So nothing is scaled sample by sample, and what several
members read stands there for all of them as soon as it is known.

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

# In the pass over samples no function takes the Program itself: a call would copy the descriptions of its fifteen
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
        regressor_channel: Column of ``values`` that each regressor reads.
        regressor_lag: Its lag in samples.
        regressor_offset: In the channel's unit.
        regressor_scale: In the channel's unit.
        output_first: Where each member's outputs begin among all; one more entry than members.
        output_channel: Column of ``values`` of each output.
        output_offset: In the channel's unit.
        output_scale: In the channel's unit.
        bounds: Lower and upper bound of each output in scaled numbers, shape ``(n_outputs, 2)``.
        limits: Lower and upper limit of each output in its unit, shape ``(n_outputs, 2)``; infinite for none.
        limit_channel: Column of ``values`` that is the limit instead, shape ``(n_outputs, 2)``; -1 for none.
    """

    theta: NDArray[np.float64]
    theta_first: NDArray[np.int64]
    neurons: NDArray[np.int64]
    regressor_first: NDArray[np.int64]
    regressor_channel: NDArray[np.int64]
    regressor_lag: NDArray[np.int64]
    regressor_offset: NDArray[np.float64]
    regressor_scale: NDArray[np.float64]
    output_first: NDArray[np.int64]
    output_channel: NDArray[np.int64]
    output_offset: NDArray[np.float64]
    output_scale: NDArray[np.float64]
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
def in_units(p):
    """The parameters of all members as they act on channels in their units; laid out as ``theta``."""
    theta = p.theta.copy()
    for m in range(len(p.neurons)):
        n, at = p.neurons[m], p.theta_first[m]
        first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
        n_y = p.output_first[m + 1] - p.output_first[m]
        gates, constants = gates_at(p.theta_first, m, n, n_x, n_y), at + n * (n_x + 1 + n_y)
        linear = p.theta_first[m + 1] > constants + n_y
        for i in range(n_x):
            offset, scale = p.regressor_offset[first_x + i], p.regressor_scale[first_x + i]
            for k in range(n):
                theta[at + k * n_x + i] /= scale
                theta[at + n * n_x + k] -= theta[at + k * n_x + i] * offset
                if gates >= 0:
                    theta[gates + k * n_x + i] /= scale
                    theta[at + n * (n_x + 1) + k] -= theta[gates + k * n_x + i] * offset
            for j in range(n_y if linear else 0):
                theta[constants + n_y + j * n_x + i] /= scale
                theta[constants + j] -= theta[constants + n_y + j * n_x + i] * offset
    return theta


@njit(cache=True, nogil=True, error_model="numpy")
def _side_by_side(p, theta):
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
                weights[m, i, k] = theta[at + k * n_x + i]
                if gates >= 0:
                    weights[m, i, beside + k] = theta[gates + k * n_x + i]
            weights[m, n_x, k] = theta[at + n * n_x + k]
            for j in range(n_y):
                row, column = (n_x, beside + k) if gates >= 0 else (n_x + 1 + j, k)
                weights[m, row, column] = theta[at + n * (n_x + 1) + j * n + k]
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


@njit(cache=True, nogil=True, error_model="numpy")
def _linear(theta, first, flat, back, first_x, here, n_x):
    """The linear part of a member without neurons, from where its regressors stand.

    Term by term: there are few, and to gather them into vector registers takes longer.
    """
    total = 0.0
    for i in range(n_x):
        total += theta[first + i] * flat[np.uintp(here - back[first_x + i])]
    return total


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _walk(p, theta, weights, across, values, past, at_sample, kept, held):
    """Run over the rows of ``values`` from ``past`` on, the first of which is sample ``at_sample``."""
    x, sums = np.empty(weights.shape[1]), np.empty(weights.shape[2])
    flat, wide = values.reshape(-1), values.shape[1]
    back = p.regressor_lag * wide - p.regressor_channel
    for row in range(past, len(values)):
        here, t = row * wide, at_sample + row - past
        at_neuron = 0
        for m in range(len(p.neurons)):
            n, lanes = p.neurons[m], padded(p.neurons[m])
            first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
            first_y, n_y = p.output_first[m], p.output_first[m + 1] - p.output_first[m]
            h, g = sums[:lanes], sums[lanes : across[m]]
            if n > 0:
                for i in range(n_x):
                    x[i] = flat[np.uintp(here - back[first_x + i])]
                _affine(weights, m, n_x, x, sums[: across[m]])
                tanh_in_place(h)
            at = p.theta_first[m] + n * (n_x + 1 + n_y)
            linear = p.theta_first[m + 1] > at + n_y
            gated = across[m] > lanes
            for j in range(n_y):
                total = theta[at + j]
                if gated:
                    for k in range(lanes):
                        total += g[k] * h[k]
                else:
                    for k in range(lanes):
                        total += weights[m, n_x + 1 + j, k] * h[k]
                if n == 0:
                    total += _linear(theta, at + n_y + j * n_x, flat, back, first_x, here, n_x)
                elif linear:
                    for i in range(n_x):
                        total += theta[at + n_y + j * n_x + i] * x[i]
                o = first_y + j
                scaled, code = _bounded(total, p.bounds[o, 0], p.bounds[o, 1])
                low, high, low_code, high_code = p.limits[o, 0], p.limits[o, 1], LOW, HIGH
                if p.limit_channel[o, 0] >= 0:
                    low, low_code = flat[here + p.limit_channel[o, 0]], LOW_CHANNEL
                if p.limit_channel[o, 1] >= 0:
                    high, high_code = flat[here + p.limit_channel[o, 1]], HIGH_CHANNEL
                value = scaled * p.output_scale[o] + p.output_offset[o]
                limited, held_by = _limited(value, code, low, high, low_code, high_code)
                flat[np.uintp(here + p.output_channel[o])] = limited
                held[t, o] = held_by
            if len(kept) > 0:
                for k in range(n):
                    kept[t, at_neuron + k] = h[k]
            at_neuron += n


@njit(cache=True, nogil=True, error_model="numpy")
def run(p, depth, rest, values, kept, held):
    """Run all members over all samples, writing the outputs into ``values``.

    Args:
        p: The members.
        depth: Past samples before sample 0: the longest lag.
        rest: Value of every channel before sample 0, in its unit, shape ``(n_channels,)``.
        values: Shape ``(n_samples, n_channels)``, in units; inputs are read, outputs written.
        kept: Activations of all members side by side, shape ``(n_samples, n_neurons)``, written; shape ``(0, 0)``
            where nobody needs them.
        held: What held each output at each sample, shape ``(n_samples, n_outputs)``, written.
    """
    theta = in_units(p)
    weights, across = _side_by_side(p, theta)
    # Samples whose past reaches before the first run in an array of their own, which begins with that past.
    first = min(depth, len(values))
    room = np.empty((depth + first, values.shape[1]))
    room[:depth], room[depth:] = rest, values[:first]
    _walk(p, theta, weights, across, room, depth, 0, kept, held)
    values[:first] = room[depth:]
    _walk(p, theta, weights, across, values, first, first, kept, held)
