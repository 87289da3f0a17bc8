"""How the members of a cascade are laid out for the pass over the samples.

A program holds the parameters of all members as they were fitted, each in its own scaled numbers. The pass reads and
writes channels in their units: what scales them stands in the weights (``sysid/kernels/cascade_plan.py``). So nothing
is scaled sample by sample, and what several members read stands there for all of them as soon as it is known.

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
        free: Where what is estimated of its numbers begins.
        n_free: How many these are.
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
    free: NDArray[np.int64]
    n_free: NDArray[np.int64]
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
