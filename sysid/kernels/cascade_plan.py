r"""The plan of a cascade: what its wiring says, once, for whatever parameters the pass is given.

Where everything stands in the pass over the samples follows from the wiring alone. A plan holds it as places: which
parameter goes where, what it is divided by and multiplied with on the way. The pass lays other parameters out itself.

Where a member reads :math:`x = (u - o) / s`, the weights :math:`W / s` act on :math:`u` itself, and the constants lose
:math:`W o / s`; where it puts out :math:`y` as :math:`s y + o`, its readouts, gates and linear part are :math:`s` times
as large.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid.kernels import cascade_layout as layout
from sysid.kernels.arrays import read_only
from sysid.kernels.cascade_layout import HIGH, HIGH_CHANNEL, LOST, LOW, LOW_CHANNEL, SUM_HEAD, Program
from sysid.kernels.registers import LANES

Array = NDArray[np.float64]
Places = NDArray[np.int64]


class Plan(NamedTuple):
    """Where everything of a program stands in the pass, whatever its parameters are.

    Attributes:
        places: Where each part begins, then the parts that are integers (``sysid/kernels/cascade_layout.py``).
        numbers: The parts that are numbers.
    """

    places: NDArray[np.uintp]
    numbers: Array

    @classmethod
    def of(cls, p: Program) -> Plan:
        """The plan of a program."""
        parts = _Planning(p).parts()
        integers, numbers = (
            [np.ravel(parts[part]) for part in range(*some)]
            for some in ((layout.N_INTEGERS,), (layout.N_INTEGERS + 1, layout.N_PARTS))
        )
        begins = [1 + layout.N_PARTS + firsts(map(len, integers)), firsts(map(len, numbers))]
        places = np.concatenate([some.astype(np.uintp) for some in (*begins, *integers)])
        return cls(read_only(places), read_only(np.concatenate(numbers)))

    def part(self, one: int) -> NDArray[np.uintp] | Array:
        """One part of it.

        Args:
            one: Which, as ``sysid/kernels/cascade_layout.py`` names them.

        Returns:
            It, flat.
        """
        return (self.places if one < layout.N_INTEGERS else self.numbers)[slice(*self.places[one : one + 2].tolist())]


@dataclass
class _Places:
    """Pairs of places that are gathered, a piece at a time."""

    to: list[Places] = field(default_factory=list)
    of: list[Places] = field(default_factory=list)

    def put(self, to: Places, of: Places) -> None:
        self.to.append(np.ravel(to))
        self.of.append(np.ravel(of))

    @property
    def pairs(self) -> Places:
        nothing = [np.empty(0, dtype=np.int64)]
        return np.column_stack([np.concatenate(self.to + nothing), np.concatenate(self.of + nothing)])


class _Member:
    """Where the parameters of one member stand."""

    def __init__(self, p: Program, m: int) -> None:
        self.x = slice(int(p.regressor_first[m]), int(p.regressor_first[m + 1]))
        self.y = slice(int(p.output_first[m]), int(p.output_first[m + 1]))
        self.n = n = int(p.neurons[m])
        self.n_x, self.n_y = self.x.stop - self.x.start, self.y.stop - self.y.start
        self.blocks = -(-n // LANES)
        at, end = int(p.theta_first[m]), int(p.theta_first[m + 1])
        sizes = np.array([n * self.n_x, n, n * self.n_y, self.n_y, self.n_y * self.n_x])
        weights, biases, readout, constant, linear = (at + np.concatenate([[0], np.cumsum(sizes)[:-1]])).tolist()
        self.weights = weights + np.arange(n * self.n_x).reshape(n, self.n_x)
        self.biases = biases + np.arange(n)
        self.readout = readout + np.arange(n * self.n_y).reshape(self.n_y, n)
        self.constant = constant + np.arange(self.n_y)
        self.is_linear = end > linear
        self.linear = linear + np.arange(self.n_y * self.n_x if self.is_linear else 0).reshape(-1, self.n_x)
        gates = int(at + sizes.sum())
        self.gates = gates + np.arange(n * self.n_x if end > gates else 0).reshape(-1, self.n_x)


class _Planning:
    """What a plan is made of."""

    def __init__(self, p: Program) -> None:
        self.p = p
        self.members = [_Member(p, m) for m in range(len(p.neurons))]
        self.bounds = p.bounds_in_units
        self._fix()
        self.is_sum = self.fixed.copy()
        for member, is_equation in zip(self.members, p.equations.is_one, strict=True):
            self.is_sum[member.y] &= member.n == 0 and not is_equation
        self._order()

    def _fix(self) -> None:
        """Which outputs are held between two numbers, which these are, and what each of them is."""
        p, bounds = self.p, self.bounds
        lost = np.column_stack([bounds[:, 0] >= p.limits[:, 0], bounds[:, 1] <= p.limits[:, 1]])
        between = np.where(lost, bounds, p.limits)
        # Where one is outside the other, what holds is a matter of order.
        self.fixed = (p.limit_channel < 0).all(axis=1) & (between[:, 0] <= between[:, 1])
        codes = np.where(p.limit_channel < 0, np.array([LOW, HIGH]), np.array([LOW_CHANNEL, HIGH_CHANNEL]))
        lost &= self.fixed[:, None]
        self.limits, self.codes = np.where(lost, bounds, p.limits), np.where(lost, LOST, codes).astype(np.int64)

    def _order(self) -> None:
        """Members level by level, each with its sums at the end, and where each level begins."""
        p, owner = self.p, {}
        for m, member in enumerate(self.members):
            owner.update(dict.fromkeys(p.output_channel[member.y].tolist(), m))
        self.last = [bool(self.is_sum[member.y].all()) for member in self.members]
        level: list[int] = []
        for m, member in enumerate(self.members):
            now = p.regressor_channel[member.x][p.regressor_lag[member.x] == 0]
            read = {owner.get(channel, m) for channel in (*now.tolist(), *p.limit_channel[member.y].ravel().tolist())}
            step = 0 if self.last[m] else 1
            level.append(max((level[other] + step for other in read if other < m), default=0))
        self.order = sorted(range(len(level)), key=lambda m: (level[m], self.last[m], m))
        self.levels = range(max(level) + 1)
        self.by_level = [[m for m in self.order if level[m] == one] for one in self.levels]

    def parts(self) -> dict[int, Places | Array]:
        """All of it."""
        p, members = self.p, self.members
        others = [self._outputs(some, sums=False) for some in self.by_level]
        networks = [[m for m in some if members[m].n] for some in self.by_level]
        pieces = self._networks([m for some in networks for m in some])
        return {
            **pieces,
            **self._others([o for some in others for o in some], pieces),
            **self._sums(),
            **self._units(),
            layout.NETWORK_FIRST: firsts(map(len, networks)),
            layout.NEURONS_FIRST: firsts(sum(LANES * members[m].blocks for m in some) for some in networks),
            layout.OUTPUT_FIRST: firsts(map(len, others)),
            layout.LAGS: p.regressor_lag,
            layout.CHANNELS: p.regressor_channel,
            layout.CODE: p.equations.code.astype(np.int64),
            layout.TABLES: p.equations.places,
            layout.WIDTHS: p.equations.widths,
            layout.TABLE_ROWS: p.equations.table,
        }

    def _outputs(self, members: list[int], *, sums: bool) -> list[int]:
        """The outputs of some members that are sums, or the others."""
        every = [o for m in members for o in range(self.members[m].y.start, self.members[m].y.stop)]
        return [o for o in every if self.is_sum[o] == sums]

    def _networks(self, order: list[int]) -> dict[int, Places | Array]:
        """Networks in the order in which they run: neurons and gates in blocks, and their readouts."""
        weights, readouts, at, at_neuron, at_readout = _Places(), _Places(), 0, 0, 0
        rows, kept = [], np.column_stack([self.p.neurons, np.zeros_like(self.p.neurons)])
        for m in order:
            one = self.members[m]
            wide = LANES * one.blocks
            gate_blocks, kept[m, 1] = one.blocks if len(one.gates) else 0, at_neuron
            rows.append([one.x.start, one.n_x, at, at_neuron, one.blocks, at_readout, gate_blocks, self.p.kinds[m]])
            for values, constants in ((one.weights, one.biases), (one.gates, one.readout[0])):
                if len(values):
                    k = np.arange(one.n)
                    own = at + k // LANES * LANES * (one.n_x + 1) + k % LANES
                    weights.put(own[:, None] + LANES * np.arange(one.n_x), values)
                    weights.put(own + LANES * one.n_x, constants)
                    at += wide * (one.n_x + 1)
            for j in range(one.n_y):
                readouts.put(at_readout + wide * j + np.arange(one.n), one.readout[j])
            at_neuron, at_readout = at_neuron + wide, at_readout + wide * one.n_y
        return {
            layout.NETWORKS: np.array(rows, dtype=np.int64).reshape(-1, int(layout.NETWORK_ROW)),
            layout.KEPT: kept,
            layout.SIZES: np.array([at, at_readout, at_neuron, not self.p.kinds.any()], dtype=np.int64),
            layout.WEIGHTS: weights.pairs,
            layout.READOUTS: readouts.pairs,
        }

    def _others(self, outputs: list[int], networks: dict[int, Places | Array]) -> dict[int, Places | Array]:
        """What the pass needs of each output that is more than a sum between two numbers."""
        p, e = self.p, self.p.equations
        of_network = {int(row[int(layout.N_FIRST_X)]): row for row in networks[layout.NETWORKS]}
        rows, holds = [], []
        for o in outputs:
            m = self._owner(o)
            one = self.members[m]
            j = o - one.y.start
            if one.n:
                row = of_network[one.x.start]
                first = int(row[int(layout.N_GATES)]) + LANES * one.blocks * j
                what, own = layout.OF_A_NETWORK, [first, int(row[int(layout.N_NEURONS)]), one.blocks, 0, 0]
            elif e.is_one[m]:
                what, own = layout.OF_AN_EQUATION, [e.first[m], e.given[m], *e.code_first[m : m + 2], e.result[m]]
            else:
                what, own = layout.OF_A_SUM, [0] * 5
            linear = 1 + int(one.linear[j, 0]) if one.is_linear and one.n_x else 0
            limits = 1 + p.limit_channel[o]
            rows.append(
                [what, p.output_channel[o], o, one.x.start, one.n_x, one.constant[j], linear, self.fixed[o],
                 *self.codes[o], *limits, *own]
            )  # fmt: skip
            holds.append([*self.limits[o], *self.bounds[o]])
        return {
            layout.OUTPUTS: np.array(rows, dtype=np.int64).reshape(-1, int(layout.OUTPUT_ROW)),
            layout.HOLDS: np.array(holds, dtype=np.float64),
        }

    def _owner(self, o: int) -> int:
        """The member of an output."""
        return int(np.searchsorted(self.p.output_first, o, side="right")) - 1

    def _sums(self) -> dict[int, Places | Array]:
        """Outputs that are sums, with what the pass needs of each side by side."""
        p, places, numbers, indices, codes = self.p, _Places(), list[float](), list[int](), list[Places]()
        by_level = [self._outputs(some, sums=True) for some in self.by_level]
        for o in (o for some in by_level for o in some):
            member = self.members[self._owner(o)]
            j, at = o - member.y.start, len(numbers)
            terms = member.linear[j] if member.is_linear else np.empty(0, dtype=np.int64)
            places.put(np.array([at]), member.constant[j : j + 1])
            places.put(at + SUM_HEAD + np.arange(len(terms)), terms)
            numbers += [0.0, *self.limits[o], *[0.0] * len(terms)]
            indices += [len(terms), int(p.output_channel[o]), o, *range(member.x.start, member.x.start + len(terms))]
            codes.append(self.codes[o])
        return {
            layout.SUM_FIRST: firsts(map(len, by_level)),
            layout.SUM_INDICES: np.array(indices, dtype=np.int64),
            layout.SUM_CODES: np.array(codes, dtype=np.int64),
            layout.SUM_NUMBERS: np.array(numbers, dtype=np.float64),
            layout.TERMS: places.pairs,
        }

    def _units(self) -> dict[int, Places | Array]:
        """What makes parameters act between channels in their units."""
        p, n = self.p, len(self.p.theta)
        divisor, factor, shift, lost, times = np.ones(n), np.ones(n), np.zeros(n), _Places(), list[Array]()
        for one in self.members:
            offset, scale = p.regressor_offset[one.x], p.regressor_scale[one.x]
            size = p.output_scale[one.y]
            for rows, constants in ((one.weights, one.biases), (one.gates, one.readout[0]), (one.linear, one.constant)):
                if len(rows):
                    divisor[rows] = scale
                    moved = np.flatnonzero(offset)
                    lost.put(np.repeat(constants[None, :], len(moved), axis=0), rows[:, moved].T)
                    times.append(np.repeat(offset[moved], len(rows)))
            factor[one.gates] = size[0]
            factor[one.readout], factor[one.linear] = size[:, None], size[: len(one.linear), None]
            factor[one.constant], shift[one.constant] = size, p.output_offset[one.y]
        return {
            layout.MOVED: lost.pairs,
            layout.TIMES: np.concatenate([*times, np.empty(0)]),
            layout.DIVISOR: divisor,
            layout.FACTOR: factor,
            layout.SHIFT: shift,
        }


def firsts(counts: Iterable[int]) -> Places:
    """Where each of some things begins that stand one after the other, and where the last ends; by how long each is."""
    return np.concatenate([[0], np.cumsum([*counts])]).astype(np.int64)


def planned(p: Program) -> tuple[NDArray[np.uintp], Array, Array]:
    """What the pass is given of a program: places and numbers of its plan, and its own numbers."""
    return *Plan.of(p), p.numbers
