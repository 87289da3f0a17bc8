r"""How the members of a cascade are laid out for the pass over the samples.

A program holds the parameters of all members as they were fitted, each in its own scaled numbers. The pass reads and
writes channels in their units: what scales them stands in the weights. Where a member reads :math:`x = (u - o) / s`,
the weights :math:`W / s` act on :math:`u` itself, and the constants lose :math:`W o / s`; where it puts out :math:`y`
as :math:`s y + o`, its readouts, gates and linear part are :math:`s` times as large. So nothing is scaled sample by
sample, and what several members read stands there for all of them as soon as it is known.

Members run level by level. A level begins with networks that do not read each other at the same sample: they run side
by side, and what they wait for, such as the functions of their neurons, they wait for once. The sums that can
follow them do, one after the other; those that wait for nobody are the first level's. So what lies between two levels
is always a network, an equation, or an output that a channel limits, and never a sum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sysid.kernels.arrays import copy_numbers
from sysid.kernels.registers import LANES


class Equations(NamedTuple):
    """Members that are equations, as the register machine runs them (``sysid/kernels/register_machine.py``).

    Each has registers of its own among those of all, ``[numbers | regressors | results]``, and the instructions name
    them by their place there. Such a member has no neurons and no linear part; what it computes is added to its
    constant, which is 0.

    Attributes:
        is_one: Whether a member is an equation.
        code: Instructions of all, shape ``(n, 5)``.
        code_first: Where each member's begin; one more entry than members.
        registers: All registers, with the numbers in place.
        low: The first register of each member.
        given: Where its regressors begin.
        first: The first register that its instructions write.
        result: The register that is its output.
        widths: Of switches: all are exact.
        places: Of each table of each member its first row and its rows, shape ``(n_tables, 2)``.
        table: Rows of all tables, shape ``(n_rows, 2)``.
    """

    is_one: NDArray[np.bool_]
    code: NDArray[np.uint64]
    code_first: NDArray[np.int64]
    registers: NDArray[np.float64]
    low: NDArray[np.int64]
    given: NDArray[np.int64]
    first: NDArray[np.int64]
    result: NDArray[np.int64]
    widths: NDArray[np.float64]
    places: NDArray[np.int64]
    table: NDArray[np.float64]


class Program(NamedTuple):
    """Members and their wiring as flat tables.

    Attributes:
        theta: Parameters of all members, one after the other.
        theta_first: Where each member's begin; one more entry than members.
        neurons: Neurons of each member.
        kinds: Code of their kind (``sysid/kernels/neurons/table.py``).
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
        equations: Members that are neither networks nor sums.
    """

    theta: NDArray[np.float64]
    theta_first: NDArray[np.int64]
    neurons: NDArray[np.int64]
    kinds: NDArray[np.int64]
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
    equations: Equations


class Sums(NamedTuple):
    """Outputs of members without neurons that are held between two numbers, in the order in which they run.

    What the pass needs of one stands side by side, numbers in one array and indices at the same places of another:
    constant, low, high, then a weight for each term; and number of terms, channel that is written, position among the
    outputs, then a regressor for each term. There may be five of them for each network, and what they compute is so
    little that looking it up in the program would take longer.

    Attributes:
        first: Where each level begins among them; one more entry than levels.
        numbers: Between units.
        indices: Not negative.
        codes: What their bounds are called where they hold, shape ``(n_sums, 2)``.
    """

    first: NDArray[np.int64]
    numbers: NDArray[np.float64]
    indices: NDArray[np.uint64]
    codes: NDArray[np.int64]


class Layout(NamedTuple):
    """A program as the pass over the samples reads it.

    Attributes:
        theta: Parameters as they act between channels in their units, in the program's order.
        bounds: Of each output in its unit, shape ``(n_outputs, 2)``.
        networks: Members that have neurons, level by level.
        network_first: Where each level begins among them; one more entry than levels.
        neurons_first: Where each level begins among all their neurons, with their padding; one more entry than levels.
        weights: Of neurons and gates in blocks (``sysid/kernels/registers.py``), networks in that order.
        weights_first: Where those of each member begin.
        blocks: Blocks of neurons of each member.
        gate_blocks: Blocks of its gates: as many, or none.
        neuron_first: Where each member's neurons stand among all, with their padding.
        readout: Readouts of all outputs; gates write theirs anew at every sample.
        readout_first: Where each output's begin.
        sums: What is no more than a sum between two numbers.
        order_y: The other outputs level by level.
        level_first_y: Where each level begins among them; one more entry than levels.
        member: The member of each output.
        constant: Where the constant of each output stands in ``theta``.
        linear_first: Where its linear part begins in ``theta``; -1 for none.
        fixed: Whether bounds and limits of an output are a pair of numbers: no channel is among them, and they overlap.
        fixed_limits: Between what it is held then, by bounds and limits together, shape ``(n_outputs, 2)``.
        fixed_codes: And which of them that is.
    """

    theta: NDArray[np.float64]
    bounds: NDArray[np.float64]
    networks: NDArray[np.int64]
    network_first: NDArray[np.int64]
    neurons_first: NDArray[np.int64]
    weights: NDArray[np.float64]
    weights_first: NDArray[np.int64]
    blocks: NDArray[np.int64]
    gate_blocks: NDArray[np.int64]
    neuron_first: NDArray[np.int64]
    readout: NDArray[np.float64]
    readout_first: NDArray[np.int64]
    sums: Sums
    order_y: NDArray[np.int64]
    level_first_y: NDArray[np.int64]
    member: NDArray[np.int64]
    constant: NDArray[np.int64]
    linear_first: NDArray[np.int64]
    fixed: NDArray[np.bool_]
    fixed_limits: NDArray[np.float64]
    fixed_codes: NDArray[np.int64]


SUM_HEAD = 3
"""Numbers of a sum before its terms."""

FREE, LOW, HIGH, LOW_CHANNEL, HIGH_CHANNEL, LOST = 0, 1, 2, 3, 4, 5
"""What held an output at a sample: nothing; a constant limit; a limit that is a channel; the bound of the network."""


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
def _scaled(theta, first, n, scale):
    """Multiply ``n`` parameters from ``first`` on."""
    for i in range(first, first + n):
        theta[i] *= scale


@njit(cache=True, nogil=True, error_model="numpy")
def in_units(p):
    """All members' parameters as they act between channels in their units, laid out as ``theta``, and the bounds."""
    theta = p.theta.copy()
    for m in range(len(p.neurons)):
        n, at = p.neurons[m], p.theta_first[m]
        first_x, n_x = p.regressor_first[m], p.regressor_first[m + 1] - p.regressor_first[m]
        n_y = p.output_first[m + 1] - p.output_first[m]
        gates, readout = gates_at(p.theta_first, m, n, n_x, n_y), at + n * (n_x + 1)
        constants = readout + n * n_y
        linear = p.theta_first[m + 1] > constants + n_y
        for i in range(n_x):
            offset, scale = p.regressor_offset[first_x + i], p.regressor_scale[first_x + i]
            for k in range(n):
                theta[at + k * n_x + i] /= scale
                theta[at + n * n_x + k] -= theta[at + k * n_x + i] * offset
                if gates >= 0:
                    theta[gates + k * n_x + i] /= scale
                    theta[readout + k] -= theta[gates + k * n_x + i] * offset
            for j in range(n_y if linear else 0):
                theta[constants + n_y + j * n_x + i] /= scale
                theta[constants + j] -= theta[constants + n_y + j * n_x + i] * offset
        if gates >= 0:
            _scaled(theta, gates, n * n_x, p.output_scale[p.output_first[m]])
        for j in range(n_y):
            offset, scale = p.output_offset[p.output_first[m] + j], p.output_scale[p.output_first[m] + j]
            _scaled(theta, readout + j * n, n, scale)
            theta[constants + j] = theta[constants + j] * scale + offset
            if linear:
                _scaled(theta, constants + n_y + j * n_x, n_x, scale)
    bounds = np.empty_like(p.bounds)
    for o in range(len(bounds)):
        for side in range(2):
            bounds[o, side] = p.bounds[o, side] * p.output_scale[o] + p.output_offset[o]
    return theta, bounds


@njit(cache=True, nogil=True, error_model="numpy")
def _reads(p, m, other):
    """Whether a member reads another at the same sample."""
    for o in range(p.output_first[other], p.output_first[other + 1]):
        for i in range(p.regressor_first[m], p.regressor_first[m + 1]):
            if p.regressor_lag[i] == 0 and p.regressor_channel[i] == p.output_channel[o]:
                return True
        for i in range(p.output_first[m], p.output_first[m + 1]):
            if p.limit_channel[i, 0] == p.output_channel[o] or p.limit_channel[i, 1] == p.output_channel[o]:
                return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _levels(p, is_sum):
    """Members level by level, each with its sums at the end, and where each level begins."""
    members = len(p.neurons)
    level, last = np.zeros(members, dtype=np.int64), np.empty(members, dtype=np.bool_)
    for m in range(members):
        last[m] = True
        for o in range(p.output_first[m], p.output_first[m + 1]):
            last[m] &= is_sum[o]
        for other in range(m):
            if _reads(p, m, other):
                level[m] = max(level[m], level[other] + (0 if last[m] else 1))
    at, levels = 0, 1
    for m in range(members):
        levels = max(levels, level[m] + 1)
    order, first = np.empty(members, dtype=np.int64), np.zeros(levels + 1, dtype=np.int64)
    for one in range(len(first) - 1):
        for sums in (False, True):
            for m in range(members):
                if level[m] == one and last[m] == sums:
                    order[at] = m
                    at += 1
        first[one + 1] = at
    return order, first


@njit(cache=True, nogil=True, error_model="numpy")
def from_a_line(size):
    """Zeros from the beginning of a line of the cache on, which is as wide as a block: no block lies in two."""
    room = np.zeros(size + LANES)
    skipped = (LANES - (room.ctypes.data // room.itemsize) % LANES) % LANES
    return room[skipped : skipped + size]


@njit(cache=True, nogil=True, error_model="numpy")
def put(weights, first, theta, rows_at, constants_at, n, n_x):
    """Put weights and constants of neurons or gates into blocks; where the next begin."""
    for k in range(n):
        own = first + k // LANES * LANES * (n_x + 1) + k % LANES
        for i in range(n_x):
            weights[own + LANES * i] = theta[rows_at + k * n_x + i]
        weights[own + LANES * n_x] = theta[constants_at + k]
    return first + padded(n) * (n_x + 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _in_blocks(p, theta, order):
    """Weights and readouts of all members in the order in which they run, in blocks of neurons padded with zeros."""
    members, size, read = len(p.neurons), 0, 0
    for m in range(members):
        n, n_x = padded(p.neurons[m]), p.regressor_first[m + 1] - p.regressor_first[m]
        size += 2 * n * (n_x + 1)
        read += n * (p.output_first[m + 1] - p.output_first[m])
    weights, readout = from_a_line(size), from_a_line(read)
    readout_first = np.zeros(len(p.output_channel), dtype=np.int64)
    weights_first, gate_blocks, neuron_first = np.zeros_like(order), np.zeros_like(order), np.zeros_like(order)
    at, at_neuron, at_readout = 0, 0, 0
    for m in order:
        n_x, n_y = p.regressor_first[m + 1] - p.regressor_first[m], p.output_first[m + 1] - p.output_first[m]
        n, own = p.neurons[m], p.theta_first[m]
        gates, v = gates_at(p.theta_first, m, n, n_x, n_y), own + n * (n_x + 1)
        weights_first[m], neuron_first[m] = at, at_neuron
        at = put(weights, at, theta, own, own + n * n_x, n, n_x)
        at_neuron += padded(n)
        if gates >= 0:
            gate_blocks[m] = padded(n) // LANES
            at = put(weights, at, theta, gates, v, n, n_x)
        for j in range(n_y):
            readout_first[p.output_first[m] + j] = at_readout
            copy_numbers(theta[v + j * n : v + (j + 1) * n], readout[at_readout:])
            at_readout += padded(n)
    return weights, weights_first, gate_blocks, neuron_first, readout, readout_first


@njit(cache=True, nogil=True, error_model="numpy")
def _by_output(p, order, level_first):
    """Outputs level by level, where each level begins, and of each its member, its constant and its linear part."""
    order_y, level_first_y = np.empty_like(p.output_channel), np.zeros_like(level_first)
    member, constant, linear_first = np.empty_like(order_y), np.empty_like(order_y), np.empty_like(order_y)
    at = 0
    for level in range(len(level_first) - 1):
        for m in order[level_first[level] : level_first[level + 1]]:
            n, n_x = p.neurons[m], p.regressor_first[m + 1] - p.regressor_first[m]
            n_y = p.output_first[m + 1] - p.output_first[m]
            own = p.theta_first[m] + n * (n_x + 1 + n_y)
            for j in range(n_y):
                o = p.output_first[m] + j
                order_y[at], member[o], constant[o] = o, m, own + j
                linear_first[o] = own + n_y + j * n_x if p.theta_first[m + 1] > own + n_y else -1
                at += 1
        level_first_y[level + 1] = at
    return order_y, level_first_y, member, constant, linear_first


@njit(cache=True, nogil=True, error_model="numpy")
def _networks(blocks, order, level_first):
    """Members that have neurons, level by level, and where each level begins among them and among their neurons."""
    network_first, neurons_first = np.zeros_like(level_first), np.zeros_like(level_first)
    networks, found, neurons = np.empty_like(order), 0, 0
    for level in range(len(level_first) - 1):
        for at in range(level_first[level], level_first[level + 1]):
            if blocks[order[at]] > 0:
                networks[found] = order[at]
                found += 1
                neurons += LANES * blocks[order[at]]
        network_first[level + 1], neurons_first[level + 1] = found, neurons
    return networks[:found], network_first, neurons_first


@njit(cache=True, nogil=True, error_model="numpy")
def _fixed(p, bounds):
    """Which outputs are held between two numbers, which these are, and what each of them is."""
    limits, codes = p.limits.copy(), np.empty(bounds.shape, dtype=np.int64)
    fixed = np.empty(len(bounds), dtype=np.bool_)
    for o in range(len(bounds)):
        codes[o, 0], codes[o, 1] = LOW, HIGH
        fixed[o] = p.limit_channel[o, 0] < 0 and p.limit_channel[o, 1] < 0
        if bounds[o, 0] >= limits[o, 0]:
            limits[o, 0], codes[o, 0] = bounds[o, 0], LOST
        if bounds[o, 1] <= limits[o, 1]:
            limits[o, 1], codes[o, 1] = bounds[o, 1], LOST
        fixed[o] &= limits[o, 0] <= limits[o, 1]  # else one outside the other, which is a matter of order
    return fixed, limits, codes


@njit(cache=True, nogil=True, error_model="numpy")
def _part(order_y, level_first_y, is_sum, wanted):
    """The outputs that are sums, or the others, in their order, and where each level begins among them."""
    first, part, found = np.zeros_like(level_first_y), np.empty_like(order_y), 0
    for level in range(len(first) - 1):
        for at in range(level_first_y[level], level_first_y[level + 1]):
            if is_sum[order_y[at]] == wanted:
                part[found] = order_y[at]
                found += 1
        first[level + 1] = found
    return part[:found], first


@njit(cache=True, nogil=True, error_model="numpy")
def _sums(p, theta, order_y, first, member, constant, linear_first, limits, codes):
    """The outputs that are sums, with what the pass needs of each side by side."""
    size = 0
    for o in order_y:
        size += SUM_HEAD + p.regressor_first[member[o] + 1] - p.regressor_first[member[o]]
    numbers, indices, at = np.zeros(size), np.zeros(size, dtype=np.uint64), 0
    for o in order_y:
        first_x = p.regressor_first[member[o]]
        n_x = p.regressor_first[member[o] + 1] - first_x if linear_first[o] >= 0 else 0
        numbers[at], numbers[at + 1], numbers[at + 2] = theta[constant[o]], limits[o, 0], limits[o, 1]
        indices[at], indices[at + 1], indices[at + 2] = n_x, p.output_channel[o], o
        for i in range(n_x):
            numbers[at + SUM_HEAD + i] = theta[linear_first[o] + i]
            indices[at + SUM_HEAD + i] = first_x + i
        at += SUM_HEAD + n_x
    return Sums(first, numbers, indices, codes[order_y])


@njit(cache=True, nogil=True, error_model="numpy")
def laid_out(p):
    """The layout of a program."""
    theta, bounds = in_units(p)
    fixed, fixed_limits, fixed_codes = _fixed(p, bounds)
    blocks = padded(p.neurons) // LANES
    is_sum = fixed.copy()
    for m in range(len(blocks)):
        for o in range(p.output_first[m], p.output_first[m + 1]):
            is_sum[o] &= blocks[m] == 0 and not p.equations.is_one[m]
    order, level_first = _levels(p, is_sum)
    networks, network_first, neurons_first = _networks(blocks, order, level_first)
    weights, weights_first, gate_blocks, neuron_first, readout, readout_first = _in_blocks(p, theta, order)
    order_y, level_first_y, member, constant, linear_first = _by_output(p, order, level_first)
    sum_y, first = _part(order_y, level_first_y, is_sum, True)
    sums = _sums(p, theta, sum_y, first, member, constant, linear_first, fixed_limits, fixed_codes)
    order_y, level_first_y = _part(order_y, level_first_y, is_sum, False)
    return Layout(
        theta,
        bounds,
        networks,
        network_first,
        neurons_first,
        weights,
        weights_first,
        blocks,
        gate_blocks,
        neuron_first,
        readout,
        readout_first,
        sums,
        order_y,
        level_first_y,
        member,
        constant,
        linear_first,
        fixed,
        fixed_limits,
        fixed_codes,
    )
