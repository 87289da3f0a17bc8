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
other's. Inputs of the whole contribute nothing. An output held by a constant has a zero row; held by a channel, it has
that channel's row.

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

from sysid.kernels.cascade_layout import FREE, HIGH_CHANNEL, LOW_CHANNEL, gates_at
from sysid.kernels.neurons.table import slopes

_FAST = {"reassoc", "contract", "arcp", "nsz"}


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
def _own(row, at, gates, j, n, n_x, n_y, linear, x, h, s, g):
    """The part of a row that does not go through earlier samples; ``at`` is where the member's parameters stand."""
    for k in range(n):
        slope = g[k] * s[k]
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
def _factors(c, theta, first, gates, j, n, n_x, n_y, linear, h, s, g):
    """Derivative of an output with respect to each regressor."""
    weights = first + n * (n_x + 1 + n_y) + n_y + j * n_x
    for i in range(n_x):
        c[i] = theta[weights + i] if linear else 0.0
    for k in range(n):
        slope = g[k] * s[k]
        for i in range(n_x):
            c[i] += slope * theta[first + k * n_x + i]
        if gates >= 0:
            for i in range(n_x):
                c[i] += h[k] * theta[gates + k * n_x + i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _through_the_past(row, c, p, m, t, extent, source, rows, factors, others, reach):
    """Add what earlier samples and upstream outputs pass on, four rows at a time; whether there was anything."""
    found = 0
    for i in range(p.regressor_first[m], p.regressor_first[m + 1]):
        s, lag = source[i], p.regressor_lag[i]
        # Samples before the first do not depend on the parameters.
        if s < 0 or lag > t or extent[s] == 0:
            continue
        other = rows.first[s] + ((t - lag) & rows.mask[s])
        if rows.moves[other]:
            factors[found] = c[i - p.regressor_first[m]] * (p.output_scale[s] / p.regressor_scale[i])
            others[found], reach[found] = other, extent[s]
            found += 1
    i = 0
    while i < found:
        if i + 4 <= found and reach[i] == reach[i + 1] == reach[i + 2] == reach[i + 3]:
            _add_four(
                row, factors[i], factors[i + 1], factors[i + 2], factors[i + 3],
                rows.J[others[i]], rows.J[others[i + 1]], rows.J[others[i + 2]], rows.J[others[i + 3]], reach[i],
            )  # fmt: skip
            i += 4
        else:
            _add(row, factors[i], rows.J[others[i]], reach[i])
            i += 1
    return found > 0


@njit(cache=True, nogil=True, error_model="numpy")
def _limit(p, o, code, t, rows, extent, row):
    """Write the row of the channel that holds an output; whether it is more than zeros."""
    channel = p.limit_channel[o, 0 if code == LOW_CHANNEL else 1]
    for s in range(o):
        if p.output_channel[s] == channel:
            other = rows.first[s] + (t & rows.mask[s])
            if rows.moves[other]:
                row[: extent[o]] = 0.0
                _add(row, p.output_scale[s] / p.output_scale[o], rows.J[other], extent[s])
                return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def sensitivities(p, rest, first, n_rows, values, kept, held, own_first, extent, source, rows):
    """The Jacobians of all outputs at samples ``first`` to ``first + n_rows``, in their scaled numbers.

    A record is walked in blocks; what a block needs of the one before stands in ``rows``.

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
        rows: Of each output the rows that are read again; written.
    """
    members, width = len(p.neurons), 0
    for m in range(members):
        width = max(width, p.regressor_first[m + 1] - p.regressor_first[m])
    most = max(1, p.neurons.max())
    x, c, g, s, sums = np.empty(width), np.empty(width), np.empty(most), np.empty(most), np.empty(most)
    factors, others, reach = np.empty(width), np.empty(width, dtype=np.int64), np.empty(width, dtype=np.int64)
    for t in range(first, first + n_rows):
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
            slopes(p.kinds[m], p.theta, p.theta_first[m], n, x[:n_x], h, sums, s)
            linear = p.theta_first[m + 1] - p.theta_first[m] > n * (n_x + 1 + n_y) + n_y
            gates = gates_at(p.theta_first, m, n, n_x, n_y)
            for j in range(n_y):
                o = first_y + j
                at = rows.first[o] + (t & rows.mask[o])
                row, code = rows.J[at], held[t, o]
                rows.moves[at] = False
                if code != FREE:
                    if code in (LOW_CHANNEL, HIGH_CHANNEL):
                        rows.moves[at] = _limit(p, o, code, t, rows, extent, row)
                    continue
                if extent[o] == 0:
                    continue
                row[: extent[o]] = 0.0
                _gains(g, p.theta, p.theta_first[m] + n * (n_x + 1) + j * n, gates, n, n_x, x)
                if own_first[m] >= 0:
                    own_gates = own_first[m] + gates - p.theta_first[m] if gates >= 0 else -1
                    _own(row, own_first[m], own_gates, j, n, n_x, n_y, linear, x, h, s, g)
                _factors(c, p.theta, p.theta_first[m], gates, j, n, n_x, n_y, linear, h, s, g)
                passed = _through_the_past(row, c, p, m, t, extent, source, rows, factors, others, reach)
                rows.moves[at] = own_first[m] >= 0 or passed
