r"""Sensitivities of a cascade's outputs with respect to the parameters of its members, forward and exact.

With the notation of ``sysid/kernels/cascade.py``, let :math:`\theta` be the parameters of all members that are trained.
For output :math:`j` of a member, with :math:`s_{jk} = g_{jk}\,\sigma'_k`, where :math:`g_{jk}` is what stands before
the activation (the readout, or the gate), and regressor :math:`i` being output :math:`\kappa(i)`, in the member's
scaled numbers, with lag :math:`l_i`,

.. math::
    \frac{d y_{j,t}}{d\theta} = \frac{\partial y_{j,t}}{\partial\theta}
      + \sum_i c_{ji,t}\,\frac{d y_{\kappa(i),\,t-l_i}}{d\theta},
    \qquad c_{ji,t} = w_{ji} + \sum_k \Bigl(s_{jk,t} W_{ki} + h_{k,t} \frac{\partial g_{jk,t}}{\partial x_i}\Bigr).

The sum runs over regressors that are an output of the cascade, the member's own or an upstream one: the
sensitivity of the upstream output is an input of the downstream recursion, scaled from the one's numbers to the
other's. Of a member that is an equation the factors :math:`c_{ji,t}` are the derivatives of its operations, taken back
through them (``sysid/kernels/register_machine.py``), and so is :math:`\partial y_{j,t} / \partial\theta`, where some
of its numbers are estimated. Inputs of the whole contribute nothing. An output held by a
constant has a zero row; held by a channel, it has that channel's row.

Rows end after the parameters of the member itself: no output depends on members that run later.

Of each output only so many rows are kept as somebody reads again: those of a switch that is read at the same sample, or
one sample later, stay in the cache, where as many rows of every output as the longest lag needs would go through main
memory. Rows of zeros, such as those of a switch at its stop, are marked and neither written nor added.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sysid.kernels.arrays import FAST
from sysid.kernels.cascade_layout import FREE, HIGH_CHANNEL, LOW_CHANNEL, gates_at
from sysid.kernels.neurons.table import slopes_of_sums, slopes_of_values
from sysid.kernels.register_machine import evaluate, moves_of, partials

ONE = np.uintp(1)
_u = np.uintp


class Rows(NamedTuple):
    """The newest rows of the Jacobians of all outputs; that of sample ``t`` stands at ``first + (t & mask)``.

    Attributes:
        J: Shape ``(n_rows, n_parameters)``.
        moves: Whether a row is more than zeros; where it is not, ``J`` holds anything. Shape ``(n_rows,)``.
        first: Where each output's rows begin.
        mask: One less than how many rows each output has, which is a power of two.
    """

    J: NDArray[np.float64]
    moves: NDArray[np.bool_]
    first: NDArray[np.int64]
    mask: NDArray[np.int64]


def rows_for(kept: NDArray[np.int64], n_parameters: int) -> Rows:
    """Room for some rows of each output.

    Args:
        kept: How many rows of each output are read again, its newest among them.
        n_parameters: Length of a row.

    Returns:
        The rows, all of them zeros.
    """
    size = np.array([1 << int(n - 1).bit_length() for n in kept], dtype=np.int64)
    total = int(size.sum())
    return Rows(np.empty((total, n_parameters)), np.zeros(total, dtype=np.bool_), np.cumsum(size) - size, size - 1)


# What is called for every sample takes flat arrays and where in them something begins, and calls nothing itself: to cut
# a piece out of an array, or to hand it on, is to count who holds it, which took more than half of the time. Places are
# unsigned: of others numba looks at the sign, each time, and no loop is vectorised.


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _clear(J, first, end):
    for i in range(first, end):
        J[i] = 0.0


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _add(J, row, n, factor, other):
    for i in range(n):
        J[row + i] += factor * J[other + i]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _add_two(J, row, n, f0, f1, p0, p1):
    for i in range(n):
        J[row + i] += f0 * J[p0 + i] + f1 * J[p1 + i]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _add_four(J, row, n, f0, f1, f2, f3, p0, p1, p2, p3):
    for i in range(n):
        J[row + i] += f0 * J[p0 + i] + f1 * J[p1 + i] + f2 * J[p2 + i] + f3 * J[p3 + i]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _gains(g, theta, readout, gated, gates, n, n_x, x):
    """What stands before each activation: the readout, and the gate of a member that has gates."""
    for k in range(n):
        total = theta[readout + k]
        if gated:
            for i in range(n_x):
                total += theta[gates + k * n_x + i] * x[i]
        g[k] = total


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _own(J, at, gated, gates, j, n, n_x, n_y, linear, x, h, s, g):
    """The part of a row that does not go through earlier samples; ``at`` is where the member's parameters stand."""
    biases = at + n * n_x
    readout = biases + n * (ONE + j)
    constants = at + n * (n_x + ONE + n_y)
    weights = constants + n_y + j * n_x
    for k in range(n):
        slope = g[k] * s[k]
        for i in range(n_x):
            J[at + k * n_x + i] = slope * x[i]
        J[biases + k] = slope
        J[readout + k] = h[k]
    J[constants + j] = 1.0
    if linear:
        for i in range(n_x):
            J[weights + i] = x[i]
    if gated:
        for k in range(n):
            for i in range(n_x):
                J[gates + k * n_x + i] = h[k] * x[i]


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def _factors(c, theta, first, gated, gates, j, n, n_x, n_y, linear, h, s, g):
    """Derivative of an output with respect to each regressor."""
    weights = first + n * (n_x + ONE + n_y) + n_y + j * n_x
    for i in range(n_x):
        c[i] = theta[weights + i] if linear else 0.0
    for k in range(n):
        slope = g[k] * s[k]
        for i in range(n_x):
            c[i] += slope * theta[first + k * n_x + i]
        if gated:
            for i in range(n_x):
                c[i] += h[k] * theta[gates + k * n_x + i]


@njit(cache=True, nogil=True, error_model="numpy")
def _limit(p, o, code, t, rows, extent, J, row):
    """Write the row of the channel that holds an output; whether it is more than zeros."""
    channel = p.limit_channel[o, 0 if code == LOW_CHANNEL else 1]
    for s in range(o):
        if p.output_channel[s] == channel:
            other = rows.first[s] + (t & rows.mask[s])
            if rows.moves[other]:
                _clear(J, row, row + _u(extent[o]))
                scale = p.output_scale[s] / p.output_scale[o]
                _add(J, row, _u(extent[s]), scale, _u(other * rows.J.shape[1]))
                return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivities(p, past, first, n_rows, values, kept, held, own_first, extent, source, rows):
    """The Jacobians of all outputs at samples ``first`` to ``first + n_rows``, in their scaled numbers.

    A record is walked in blocks; what a block needs of the one before stands in ``rows``.

    Args:
        p: The members.
        past: Rows of ``values`` before the first sample, at least the longest lag; no parameter moves them.
        first: First sample of the block.
        n_rows: Samples in the block.
        values: As from the pass, shape ``(past + n_samples, n_channels)``.
        kept: As from the pass, shape ``(n_samples, n_neurons)``.
        held: As from the pass, shape ``(n_samples, n_outputs)``.
        own_first: Where each member's parameters stand in a row; -1 for a member that is not trained.
        extent: Length of each output's row: after it there are zeros, which are not written.
        source: Output that each regressor reads; -1 for an input of the whole.
        rows: Of each output the rows that are read again; written.
    """
    widest = 0
    for m in range(len(p.neurons)):
        widest = max(widest, p.regressor_first[m + 1] - p.regressor_first[m])
    most = max(1, p.neurons.max())
    h, g, s, sums = np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    x, c, factors = np.empty(widest), np.empty(widest), np.empty(widest)
    others, reach = np.empty(widest, dtype=np.uintp), np.empty(widest, dtype=np.uintp)
    J, length, moves, firsts, masks = rows.J.reshape(-1), rows.J.shape[1], rows.moves, rows.first, rows.mask
    theta, lags, scales, regressor_scale = p.theta, p.regressor_lag, p.output_scale, p.regressor_scale
    flat, wide = values.reshape(-1), values.shape[1]
    back = (lags * wide - p.regressor_channel).view(np.uintp)
    e = p.equations
    is_equation, steps_first, steps, v = e.is_one, e.code_first, e.code, e.registers.copy()
    given, first_of, low, result, widths, places, table = e.given, e.first, e.low, e.result, e.widths, e.places, e.table
    free, n_free = e.free, e.n_free
    d, bar = np.empty((len(steps), 3)), np.empty(len(v))
    for t in range(first, first + n_rows):
        here, at_neuron = _u((past + t) * wide), 0
        for m in range(len(p.neurons)):
            n, at = p.neurons[m], p.theta_first[m]
            first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
            first_y, n_y = p.output_first[m], p.output_first[m + 1] - p.output_first[m]
            for i in range(n):
                h[i] = kept[t, at_neuron + i]
            at_neuron += n
            for i in range(n_x):
                x[i] = (flat[here - back[first_x + i]] - p.regressor_offset[first_x + i]) / regressor_scale[first_x + i]
            if not slopes_of_values(p.kinds[m], h, n, s):
                slopes_of_sums(p.kinds[m], theta, at, n, x, n_x, sums, s)
            size = p.theta_first[m + 1] - at if not is_equation[m] else n_free[m]
            linear = size > n * (n_x + 1 + n_y) + n_y and not is_equation[m]
            gates = gates_at(p.theta_first, m, n, n_x, n_y)
            gated, to_gates = gates >= 0, _u(max(gates - at, 0))
            k, r, y = _u(n), _u(n_x), _u(n_y)
            for j in range(n_y):
                o = first_y + j
                place = firsts[o] + (t & masks[o])
                row, code = _u(place * length), held[t, o]
                moves[place] = False
                if code != FREE:
                    if code in (LOW_CHANNEL, HIGH_CHANNEL):
                        moves[place] = _limit(p, o, code, t, rows, extent, J, row)
                    continue
                if extent[o] == 0:
                    continue
                _gains(g, theta, _u(at + n * (n_x + 1 + j)), gated, _u(at) + to_gates, k, r, x)
                whole = own_first[m] >= 0 and n_y == 1  # its own part is written anew, number by number
                _clear(J, row, row + _u(own_first[m] if whole else extent[o]))
                if own_first[m] >= 0 and not is_equation[m]:
                    own = row + _u(own_first[m])
                    _own(J, own, gated, own + to_gates, _u(j), k, r, y, linear, x, h, s, g)
                if whole:
                    _clear(J, row + _u(own_first[m] + size), row + _u(extent[o]))
                _factors(c, theta, _u(at), gated, _u(at) + to_gates, _u(j), k, r, y, linear, h, s, g)
                if is_equation[m]:
                    begin, end = steps_first[m], steps_first[m + 1]
                    for i in range(n_x):
                        v[given[m] + i] = x[i]
                    evaluate(steps, begin, end, v, first_of[m], widths, places, table)
                    partials(steps, begin, end, v, first_of[m], widths, places, table, d)
                    moves_of(steps, begin, end, d, result[m], low[m], first_of[m], bar)
                    for i in range(n_x):
                        c[i] = bar[given[m] + i]
                    for i in range(size if own_first[m] >= 0 else 0):
                        J[row + _u(own_first[m] + i)] = bar[free[m] + i]
                found = 0
                for i in range(first_x, first_x + n_x):
                    of = source[i]
                    if of < 0 or extent[of] == 0:
                        continue
                    other = firsts[of] + ((t - lags[i]) & masks[of])
                    if moves[other]:
                        factors[found] = c[i - first_x] * (scales[of] / regressor_scale[i])
                        others[found], reach[found] = _u(other * length), _u(extent[of])
                        found += 1
                i = 0
                while i < found:  # as many rows at a time as are equally long
                    if i + 4 <= found and reach[i] == reach[i + 1] == reach[i + 2] == reach[i + 3]:
                        _add_four(
                            J, row, reach[i], factors[i], factors[i + 1], factors[i + 2], factors[i + 3],
                            others[i], others[i + 1], others[i + 2], others[i + 3],
                        )  # fmt: skip
                        i += 4
                    elif i + 2 <= found and reach[i] == reach[i + 1]:
                        _add_two(J, row, reach[i], factors[i], factors[i + 1], others[i], others[i + 1])
                        i += 2
                    else:
                        _add(J, row, reach[i], factors[i], others[i])
                        i += 1
                moves[place] = own_first[m] >= 0 or found > 0
