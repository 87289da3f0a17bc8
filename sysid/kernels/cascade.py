r"""A cascade of recursions in one compiled pass over the samples.

Each member is :math:`y_t = \mathrm{clip}(w x_t + c + V\sigma(W x_t + b))` in its own scaled numbers, with one or
several outputs, or with one output and gates (``sysid/kernels/recursion.py`` has the single one and its derivation).
Members run in order within a sample: one that reads an upstream output with lag 0 reads the value of the same sample.
One may also read the past of what is computed after it: models that stand in a circle, as reservoirs that feed each
other do.

A member may be an equation in the place of :math:`w x_t + c`, which the register machine runs
(``sysid/kernels/register_machine.py``).

``values`` holds every channel once, in its unit, and a regressor is one of them and a lag, whatever it means
(``sysid/kernels/cascade_layout.py``).

Limits hold an output between two values in its unit, each a constant or another channel at the same sample. The held
value is the channel's: the member itself reads it as its past output.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sysid.kernels.arrays import FAST, copy_numbers, copy_rows
from sysid.kernels.cascade_layout import (
    FREE,
    HIGH,
    HIGH_CHANNEL,
    LOW,
    LOW_CHANNEL,
    SUM_HEAD,
    Layout,
    Program,
    from_a_line,
)
from sysid.kernels.held_sums import bounded, limited, weighted
from sysid.kernels.neurons.table import activate
from sysid.kernels.register_machine import evaluate
from sysid.kernels.registers import LANES, affine, dot, tanh

Array = NDArray[np.float64]
Held = NDArray[np.int8]

ONE, TWO, HEAD = np.uintp(1), np.uintp(2), np.uintp(SUM_HEAD)
"""Of the same kind as the indices that they are added to."""

# In the pass over samples no function takes the program or its layout itself: a call would copy the descriptions of
# their arrays, which costs as much as the network (measured: 34 ms instead of 16 for four members over 20,000 samples).


@njit(cache=True, nogil=True, error_model="numpy")
def _linear(theta, first, flat, back, first_x, here, n_x):
    """The linear part of a member without neurons, from where its regressors stand.

    Term by term: there are few, and to gather them into vector registers takes longer.
    """
    total = 0.0
    for i in range(n_x):
        total += theta[first + i] * flat[here - back[first_x + i]]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _u(indices):
    """Indices as what cannot be negative: of others numba looks at the sign, each time."""
    return indices.view(np.uintp)


@njit(cache=True, nogil=True, error_model="numpy")
def _placed(indices, back):
    """The indices of sums with how far back each term stands in place of its regressor."""
    placed, at = indices.copy(), 0
    while at < len(placed):
        n = int(placed[at])
        for i in range(at + SUM_HEAD, at + SUM_HEAD + n):
            placed[i] = back[indices[i]]
        at += SUM_HEAD + n
    return placed


@njit(cache=True, nogil=True, error_model="numpy")
def _keep(kept, h, neurons, neuron_first):
    """Write the activations of one sample side by side, without their padding."""
    at = 0
    for m in range(len(neurons)):
        for k in range(neurons[m]):
            kept[at + k] = h[neuron_first[m] + k]
        at += neurons[m]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _walk(p, layout, values, past, kept, held):
    """Run over the rows of ``values`` from ``past`` on; ``kept`` and ``held`` begin with the first of these."""
    theta, bounds, weights = layout.theta, layout.bounds, layout.weights
    constant, linear_first, readout_first = _u(layout.constant), layout.linear_first, _u(layout.readout_first)
    networks, network_first, neurons_first = _u(layout.networks), _u(layout.network_first), _u(layout.neurons_first)
    order_y, level_first_y = _u(layout.order_y), _u(layout.level_first_y)
    fixed, fixed_limits, fixed_codes = layout.fixed, layout.fixed_limits, layout.fixed_codes
    weights_first, blocks, gate_blocks = _u(layout.weights_first), _u(layout.blocks), _u(layout.gate_blocks)
    neuron_first, member, g = _u(layout.neuron_first), _u(layout.member), from_a_line(len(layout.readout))
    copy_numbers(layout.readout, g)  # of its own: gates write theirs anew, and several threads run one layout
    sum_first, numbers, codes = _u(layout.sums.first), layout.sums.numbers, layout.sums.codes
    first_x_of, channel_y = _u(p.regressor_first), _u(p.output_channel)
    # Where all are of one kind, a level's neurons are run through side by side.
    kinds, plain = p.kinds, not p.kinds.any()
    to_g_of = readout_first[_u(p.output_first)[:-1]]
    x, h = np.empty(len(p.regressor_channel)), from_a_line(LANES * layout.blocks.sum())
    flat, wide = values.reshape(-1), values.shape[1]
    back = _u(p.regressor_lag * wide - p.regressor_channel)
    indices = _placed(layout.sums.indices, back)
    e = p.equations
    is_equation, steps_first, steps, v = e.is_one, e.code_first, e.code, e.registers.copy()
    given, first_of, result, widths, places, table = _u(e.given), e.first, e.result, e.widths, e.places, e.table
    for row in range(past, len(values)):
        here, t, at = np.uintp(row * wide), np.uintp(row - past), np.uintp(0)
        for level in range(np.uintp(len(network_first) - 1)):
            for q in range(network_first[level], network_first[level + ONE]):
                m = networks[q]
                first_x, n_x = first_x_of[m], first_x_of[m + ONE] - first_x_of[m]
                for i in range(first_x, first_x + n_x):
                    x[i] = flat[here - back[i]]
                affine(
                    weights, weights_first[m], n_x, x, first_x, h, neuron_first[m], blocks[m], g, to_g_of[m],
                    gate_blocks[m],
                )  # fmt: skip
            if plain and neurons_first[level + ONE] > neurons_first[level]:
                tanh(h, neurons_first[level], neurons_first[level + ONE] - neurons_first[level])
            elif not plain:
                for q in range(network_first[level], network_first[level + ONE]):
                    m = networks[q]
                    activate(kinds[m], h, np.intp(neuron_first[m]), np.intp(LANES * blocks[m]))
            for q in range(level_first_y[level], level_first_y[level + ONE]):
                o = order_y[q]
                m, total = member[o], theta[constant[o]]
                first_x, n_x = first_x_of[m], first_x_of[m + ONE] - first_x_of[m]
                if blocks[m] > 0:
                    linear = 0.0
                    if linear_first[o] >= 0:
                        linear = weighted(0.0, theta, np.uintp(linear_first[o]), x, first_x, n_x)
                    total += dot(g, readout_first[o], h, neuron_first[m], blocks[m]) + linear
                elif is_equation[m]:
                    for i in range(n_x):
                        v[given[m] + i] = flat[here - back[first_x + i]]
                    evaluate(steps, steps_first[m], steps_first[m + ONE], v, first_of[m], widths, places, table)
                    total += v[result[m]]
                else:
                    total += _linear(theta, np.uintp(linear_first[o]), flat, back, first_x, here, n_x)
                code = FREE
                low, high = fixed_limits[o, 0], fixed_limits[o, 1]
                low_code, high_code = fixed_codes[o, 0], fixed_codes[o, 1]
                if not fixed[o]:
                    total, code = bounded(total, bounds[o, 0], bounds[o, 1])
                    low, high, low_code, high_code = p.limits[o, 0], p.limits[o, 1], LOW, HIGH
                    if p.limit_channel[o, 0] >= 0:
                        low, low_code = flat[here + np.uintp(p.limit_channel[o, 0])], LOW_CHANNEL
                    if p.limit_channel[o, 1] >= 0:
                        high, high_code = flat[here + np.uintp(p.limit_channel[o, 1])], HIGH_CHANNEL
                flat[here + channel_y[o]], held[t, o] = limited(total, code, low, high, low_code, high_code)
            for q in range(sum_first[level], sum_first[level + ONE]):
                total, low, high = numbers[at], numbers[at + ONE], numbers[at + TWO]
                channel, o, end = indices[at + ONE], indices[at + TWO], at + HEAD + indices[at]
                at += HEAD
                while at < end:
                    total += numbers[at] * flat[here - indices[at]]
                    at += ONE
                flat[here + channel], held[t, o] = limited(total, FREE, low, high, codes[q, 0], codes[q, 1])
        if len(kept) > 0:
            _keep(kept[t], h, p.neurons, neuron_first)


@njit(cache=True, nogil=True, error_model="numpy")
def run(p: Program, layout: Layout, depth: int, rest: Array, values: Array, kept: Array, held: Held) -> None:
    """Run all members over all samples, writing the outputs into ``values``.

    Samples whose past reaches before the first are run in an array of their own, then the others.

    Args:
        p: The members.
        layout: Theirs, with their parameters (``sysid/kernels/cascade_plan.py``).
        depth: Past samples before sample 0: the longest lag.
        rest: Value of every channel before sample 0, in its unit, shape ``(n_channels,)``.
        values: Shape ``(n_samples, n_channels)``, in units; inputs are read, outputs written.
        kept: Activations of all members side by side, shape ``(n_samples, n_neurons)``, written; shape ``(0, 0)``
            where nobody needs them.
        held: What held each output at each sample, shape ``(n_samples, n_outputs)``, written.
    """
    first = min(depth, len(values))
    room = np.empty((depth + first, values.shape[1]))
    for row in range(depth):
        copy_numbers(rest, room[row])
    copy_rows(values[:first], room[depth:])
    _walk(p, layout, room, depth, kept, held)
    copy_rows(room[depth:], values)
    _walk(p, layout, values, first, kept[first:], held[first:])


def go_on(p: Program, layout: Layout, past: int, values: Array, kept: Array, held: Held) -> None:
    """Run all members from a row on, whatever stands in the rows before it.

    Args:
        p: The members.
        layout: As for :func:`run`.
        past: The first row that is run, at least the longest lag.
        values: As for :func:`run`; its first ``past`` rows are the history.
        kept: As for :func:`run`.
        held: As for :func:`run`, from row ``past`` on.
    """
    _walk(p, layout, values, past, kept, held)
