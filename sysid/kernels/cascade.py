r"""A cascade of recursions in one compiled pass over the samples; one network alone is a cascade of one.

With the regressors :math:`x_t` of a member (lagged inputs, then lagged outputs) one step of it is

.. math::
    \hat y_t = \mathrm{clip}\bigl(w^T x_t + c + \textstyle\sum_k g_{t,k} h_{t,k}\bigr),
    \qquad h_{t,k} = \sigma(W_k x_t + b_k), \qquad g_{t,k} = v_k + V_k x_t,

in its own scaled numbers, with one or several outputs, or with one output and gates. Without gates :math:`V = 0`: a
layer of neurons of one kind (``sysid/kernels/neurons``; tanh, unless something else is said) and its readout. With them
each neuron switches a linear function of the regressors on and off, which is what a valve does to a flow: the rate of a
filling volume is a product, which a plain layer has to put together out of many neurons.

Parameters are one flat vector ``[W (n_neurons, n_regressors) | b | v | c | w | V (n_neurons, n_regressors)]`` for each
member. Gates ``V`` and linear part ``w`` stand last so that a network without them is a shorter vector (gates come with
a linear part only); no neurons at all leaves ``[c | w]``, an ARX model with an intercept.

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

from sysid.kernels import cascade_layout as layout
from sysid.kernels.arrays import FAST, copy_numbers, copy_rows, stands_apart
from sysid.kernels.cascade_layout import FREE, SUM_HEAD, from_a_line
from sysid.kernels.held_sums import bounded, limited, weighted
from sysid.kernels.neurons.table import activate
from sysid.kernels.register_machine import evaluate
from sysid.kernels.registers import LANES, affine, dot, tanh

ONE, TWO, HEAD = np.uintp(1), np.uintp(2), np.uintp(SUM_HEAD)
"""Of the same kind as the indices that they are added to: those cannot be negative, and numba looks at no sign."""


@njit(cache=True, nogil=True, error_model="numpy")
def _of(array, places, part):
    """One part of a plan, of its places or of its numbers."""
    return array[places[part] : places[part + 1]]


@njit(cache=True, nogil=True, error_model="numpy")
def acting(places, numbers, theta):
    """Parameters as they act between channels in their units, in the program's order.

    Args:
        places: Of a plan.
        numbers: Of a plan.
        theta: As for :func:`run`.

    Returns:
        Them, without the registers of equations.
    """
    divisor, factor, shift = (
        _of(numbers, places, layout.DIVISOR),
        _of(numbers, places, layout.FACTOR),
        _of(numbers, places, layout.SHIFT),
    )
    moved, times, found = _of(places, places, layout.MOVED), _of(numbers, places, layout.TIMES), np.empty(len(divisor))
    for i in range(len(found)):
        found[i] = theta[i] / divisor[i]
    for i in range(len(times)):
        found[moved[2 * i]] -= found[moved[2 * i + 1]] * times[i]
    for i in range(len(found)):
        found[i] = found[i] * factor[i] + shift[i]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _put(pairs, source, target):
    """Put parameters where they stand in the pass."""
    for i in range(0, len(pairs), 2):
        target[pairs[i]] = source[pairs[i + 1]]


@njit(cache=True, nogil=True, error_model="numpy")
def _laid_out(places, numbers, theta):
    """Acting parameters; those in blocks, as readouts, and in sums; and the registers of equations."""
    found, sizes = acting(places, numbers, theta), _of(places, places, layout.SIZES)
    weights, readouts = from_a_line(np.intp(sizes[0])), from_a_line(np.intp(sizes[1]))
    sums = _of(numbers, places, layout.SUM_NUMBERS).copy()
    _put(_of(places, places, layout.WEIGHTS), found, weights)
    _put(_of(places, places, layout.READOUTS), found, readouts)
    _put(_of(places, places, layout.TERMS), found, sums)
    return found, weights, readouts, sums, theta[len(found) :]


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
def _keep(kept, h, members):
    """Write the activations of one sample side by side, without their padding."""
    at = 0
    for m in range(0, len(members), 2):
        for k in range(members[m]):
            kept[at] = h[members[m + 1] + k]
            at += 1


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _walk(places, numbers, theta, weights, readouts, sums, registers, past, values, kept, held):
    """Run over the rows of ``values`` from ``past`` on; ``kept`` and ``held`` begin with the first of these."""
    stands_apart()
    networks, network_first = _of(places, places, layout.NETWORKS), _of(places, places, layout.NETWORK_FIRST)
    outputs, output_first = _of(places, places, layout.OUTPUTS), _of(places, places, layout.OUTPUT_FIRST)
    neurons_first, members = _of(places, places, layout.NEURONS_FIRST), _of(places, places, layout.KEPT)
    holds, sizes = _of(numbers, places, layout.HOLDS), _of(places, places, layout.SIZES)
    sum_first, codes = _of(places, places, layout.SUM_FIRST), _of(places, places, layout.SUM_CODES)
    steps = _of(places, places, layout.CODE).reshape(-1, 5)
    widths, tables = (
        _of(numbers, places, layout.WIDTHS),
        _of(places, places, layout.TABLES).view(np.intp).reshape(-1, 2),
    )
    table, lags = _of(numbers, places, layout.TABLE_ROWS).reshape(-1, 2), _of(places, places, layout.LAGS)
    flat, wide, plain = values.reshape(-1), values.shape[1], sizes[3] > 0
    back = lags * np.uintp(wide) - _of(places, places, layout.CHANNELS)
    indices = _placed(_of(places, places, layout.SUM_INDICES), back)
    # Of its own: gates and equations write theirs anew, and several threads run one plan.
    x, h, g, v = np.empty(len(lags)), from_a_line(np.intp(sizes[2])), from_a_line(len(readouts)), registers.copy()
    copy_numbers(readouts, g)
    for row in range(past, len(values)):
        here, t, at = np.uintp(row * wide), np.uintp(row - past), np.uintp(0)
        for level in range(np.uintp(len(network_first) - 1)):
            for q in range(network_first[level], network_first[level + ONE]):
                k = q * layout.NETWORK_ROW
                first_x, n_x = networks[k + layout.N_FIRST_X], networks[k + layout.N_N_X]
                for i in range(first_x, first_x + n_x):
                    x[i] = flat[here - back[i]]
                affine(
                    weights, networks[k + layout.N_WEIGHTS], n_x, x, first_x, h, networks[k + layout.N_NEURONS],
                    networks[k + layout.N_BLOCKS], g, networks[k + layout.N_GATES], networks[k + layout.N_GATE_BLOCKS],
                )  # fmt: skip
            # Where all are of one kind, a level's neurons are run through side by side.
            if plain and neurons_first[level + ONE] > neurons_first[level]:
                tanh(h, neurons_first[level], neurons_first[level + ONE] - neurons_first[level])
            elif not plain:
                for q in range(network_first[level], network_first[level + ONE]):
                    k = q * layout.NETWORK_ROW
                    first, blocks = networks[k + layout.N_NEURONS], networks[k + layout.N_BLOCKS]
                    activate(np.intp(networks[k + layout.N_KIND]), h, np.intp(first), np.intp(LANES * blocks))
            for q in range(output_first[level], output_first[level + ONE]):
                k, b = q * layout.OUTPUT_ROW, q * (TWO + TWO)
                what, o, total = (
                    outputs[k + layout.WHAT],
                    outputs[k + layout.POSITION],
                    theta[outputs[k + layout.CONSTANT]],
                )
                first_x, n_x, linear_at = (
                    outputs[k + layout.FIRST_X],
                    outputs[k + layout.N_X],
                    outputs[k + layout.LINEAR],
                )
                first, second, third = outputs[k + layout.FIRST], outputs[k + layout.SECOND], outputs[k + layout.THIRD]
                if what == layout.OF_A_NETWORK:
                    linear = 0.0
                    if linear_at > 0:
                        linear = weighted(0.0, theta, linear_at - ONE, x, first_x, n_x)
                    total += dot(g, first, h, second, third) + linear
                elif what == layout.OF_AN_EQUATION:
                    for i in range(n_x):
                        v[second + i] = flat[here - back[first_x + i]]
                    evaluate(steps, third, outputs[k + layout.END], v, first, widths, tables, table)
                    total += v[outputs[k + layout.RESULT]]
                elif linear_at > 0:
                    total += _linear(theta, linear_at - ONE, flat, back, first_x, here, n_x)
                code, low, high = FREE, holds[b], holds[b + ONE]
                low_code, high_code = np.intp(outputs[k + layout.LOW_CODE]), np.intp(outputs[k + layout.HIGH_CODE])
                if outputs[k + layout.FIXED] == 0:
                    total, code = bounded(total, holds[b + TWO], holds[b + TWO + ONE])
                    if outputs[k + layout.LOW_AT] > 0:
                        low = flat[here + outputs[k + layout.LOW_AT] - ONE]
                    if outputs[k + layout.HIGH_AT] > 0:
                        high = flat[here + outputs[k + layout.HIGH_AT] - ONE]
                total, held[t, o] = limited(total, code, low, high, low_code, high_code)
                flat[here + outputs[k + layout.CHANNEL]] = total
            for q in range(sum_first[level], sum_first[level + ONE]):
                total, low, high = sums[at], sums[at + ONE], sums[at + TWO]
                channel, o, end = indices[at + ONE], indices[at + TWO], at + HEAD + indices[at]
                at += HEAD
                while at < end:
                    total += sums[at] * flat[here - indices[at]]
                    at += ONE
                low_code, high_code = np.intp(codes[q + q]), np.intp(codes[q + q + ONE])
                flat[here + channel], held[t, o] = limited(total, FREE, low, high, low_code, high_code)
        if len(kept) > 0:
            _keep(kept[t], h, members)


@njit(cache=True, nogil=True, error_model="numpy")
def run(places, numbers, theta, depth, rest, values, kept, held):
    """Run all members over all samples, writing the outputs into ``values``.

    Samples whose past reaches before the first are run in an array of their own, then the others.

    Args:
        places: Of the members' plan (``sysid/kernels/cascade_plan.py``).
        numbers: Of it, too.
        theta: Parameters of all members, and behind them the registers of equations; read-only.
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
    laid_out = _laid_out(places, numbers, theta)
    _walk(places, numbers, *laid_out, depth, room, kept, held)
    copy_rows(room[depth:], values)
    _walk(places, numbers, *laid_out, first, values, kept[first:], held[first:])


@njit(cache=True, nogil=True, error_model="numpy")
def go_on(places, numbers, theta, past, values, kept, held):
    """Run all members from a row on, whatever stands in the rows before it.

    Args:
        places: As for :func:`run`.
        numbers: As for :func:`run`.
        theta: As for :func:`run`.
        past: The first row that is run, at least the longest lag.
        values: As for :func:`run`; its first ``past`` rows are the history.
        kept: As for :func:`run`.
        held: As for :func:`run`, from row ``past`` on.
    """
    _walk(places, numbers, *_laid_out(places, numbers, theta), past, values, kept, held)
