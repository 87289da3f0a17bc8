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

from sysid.kernels.arrays import read_only
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

    @property
    def bounds_in_units(self) -> NDArray[np.float64]:
        """The bounds of each output in its unit, shape ``(n_outputs, 2)``."""
        return self.bounds * self.output_scale[:, None] + self.output_offset[:, None]

    @property
    def numbers(self) -> NDArray[np.float64]:
        """What the pass is given: parameters of all members, and behind them the registers of equations."""
        return read_only(np.concatenate([self.theta, self.equations.registers]))


# A plan is two flat arrays, one of integers and one of numbers: a call of the pass unpacks two of them, and not fifty,
# which took it 6 to 8 us. The integers begin with where each part of either array begins. A part is a stretch of one of
# them, often rows of a fixed width: what the pass needs at once stands side by side.
(
    NETWORKS,  # a row for each member that has neurons, level by level
    NETWORK_FIRST,  # where each level begins among them; one more entry than levels, as below
    NEURONS_FIRST,  # where each level begins among all their neurons, with their padding
    OUTPUTS,  # a row for each output that is more than a sum between two numbers, level by level
    OUTPUT_FIRST,  # where each level begins among them
    SUM_FIRST,  # where each level begins among the sums
    SUM_INDICES,  # of the sums; see SUM_HEAD
    SUM_CODES,  # what the two numbers are called where they hold, a pair for each sum
    LAGS,  # of every regressor
    CHANNELS,  # of every regressor
    KEPT,  # of every member how many neurons, and where they stand among all with their padding
    CODE,  # instructions of equations, five numbers each
    TABLES,  # of each of their tables its first row and its rows
    SIZES,  # weights, readouts, neurons with their padding, and whether neurons are all of the first kind
    MOVED,  # pairs of places: a constant that loses a multiple of a parameter, and this
    WEIGHTS,  # pairs of places: among the weights of neurons and gates, and of the parameter that stands there
    READOUTS,  # likewise among the readouts
    TERMS,  # likewise among the numbers of sums
    N_INTEGERS,
    DIVISOR,  # of each parameter the scale of what it acts on
    TIMES,  # the multiples that constants lose
    FACTOR,  # of each parameter the scale of what it acts for
    SHIFT,  # what is added to it
    HOLDS,  # four numbers a row of OUTPUTS: between what it is held, by its limits alone unless FIXED; its bounds
    SUM_NUMBERS,  # of the sums, without parameters
    WIDTHS,  # of the switches of equations
    TABLE_ROWS,  # rows of all tables, two numbers each
    N_PARTS,
) = range(28)

(N_FIRST_X, N_N_X, N_WEIGHTS, N_NEURONS, N_BLOCKS, N_GATES, N_GATE_BLOCKS, N_KIND, NETWORK_ROW) = map(
    np.uintp, range(9)
)
"""A row of networks: first regressor, regressors, first weight, first neuron, blocks of neurons, where its gates are
written among the readouts, blocks of gates (as many, or none), kind."""
(
    WHAT,  # OF_A_NETWORK, OF_AN_EQUATION or OF_A_SUM
    CHANNEL,  # the column that it is
    POSITION,  # among the outputs
    FIRST_X,  # first regressor
    N_X,  # regressors
    CONSTANT,  # place of its constant
    LINEAR,  # one more than where its linear part begins; 0 for none
    FIXED,  # whether bounds and limits are a pair of numbers: no channel is among them, and they overlap
    LOW_CODE,  # what the lower of the pair, or limit, is called
    HIGH_CODE,  # what the upper is
    LOW_AT,  # one more than the channel that is its lower limit; 0 for none
    HIGH_AT,  # likewise its upper limit
    FIRST,  # of a network its first readout; of an equation the first register that is written
    SECOND,  # its first neuron; where regressors begin among the registers
    THIRD,  # its blocks of neurons; its first instruction
    END,  # of an equation one more than its last instruction
    RESULT,  # of an equation the register that is the output
    OUTPUT_ROW,
) = map(np.uintp, range(18))
"""A row of outputs."""
OF_A_NETWORK, OF_AN_EQUATION, OF_A_SUM = 0, 1, 2

SUM_HEAD = 3
"""Numbers of a sum before its terms.

Outputs of members without neurons that are held between two numbers stand in the order in which they run, numbers in
one part and indices at the same places of another: constant, low, high, then a weight for each term; and number of
terms, channel that is written, position among the outputs, then a regressor for each term. There may be five of them
for each network, and what they compute is so little that looking it up elsewhere would take longer."""

FREE, LOW, HIGH, LOW_CHANNEL, HIGH_CHANNEL, LOST = 0, 1, 2, 3, 4, 5
"""What held an output at a sample: nothing; a constant limit; a limit that is a channel; the bound of the network."""


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
