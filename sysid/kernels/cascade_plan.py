r"""The layout of a cascade: what its wiring says, once, and what parameters say, each time they change.

Where everything stands in the pass over the samples follows from the wiring alone. A plan holds it as places: which
parameter goes where, what it is divided by and multiplied with on the way. So a layout for other parameters is a few
operations on whole arrays, and none of it has to be compiled.

Where a member reads :math:`x = (u - o) / s`, the weights :math:`W / s` act on :math:`u` itself, and the constants lose
:math:`W o / s`; where it puts out :math:`y` as :math:`s y + o`, its readouts, gates and linear part are :math:`s` times
as large.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.kernels.cascade_layout import HIGH, LOST, LOW, SUM_HEAD, Layout, Program, Sums, from_a_line
from sysid.kernels.registers import LANES

Array = NDArray[np.float64]
Places = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """Where everything of a program stands in its layout.

    Args:
        wired: The layout, with whatever hangs on parameters at zero.
        divisor: Of each parameter the scale of what it acts on.
        lost: Places of constants that lose a multiple of a weight, of these weights, and the multiples.
        factor: Of each parameter the scale of what it acts for.
        shift: What is added to it.
        weights: Places in the weights, and of the parameters that stand there.
        readout: Likewise in the readouts.
        numbers: Likewise in the numbers of sums.
    """

    wired: Layout
    divisor: Array
    lost: tuple[Places, Places, Array]
    factor: Array
    shift: Array
    weights: tuple[Places, Places]
    readout: tuple[Places, Places]
    numbers: tuple[Places, Places]

    @classmethod
    def of(cls, p: Program) -> Plan:
        """The plan of a program, whatever its parameters are."""
        return _Planning(p).plan()

    def laid_out(self, theta: Array) -> Layout:
        """The layout with some parameters.

        Args:
            theta: Parameters of all members, one after the other, as the program's.

        Returns:
            The layout.
        """
        acting = theta / self.divisor
        to, by, times = self.lost
        np.subtract.at(acting, to, acting[by] * times)
        acting *= self.factor
        acting += self.shift
        wired = self.wired
        weights, readout = from_a_line(len(wired.weights)), from_a_line(len(wired.readout))
        numbers = wired.sums.numbers.copy()
        for target, (places, sources) in (
            (weights, self.weights), (readout, self.readout), (numbers, self.numbers),
        ):  # fmt: skip
            target[places] = acting[sources]
        return wired._replace(theta=acting, weights=weights, readout=readout, sums=wired.sums._replace(numbers=numbers))


@dataclass
class _Places:
    """Pairs of places that are gathered, a piece at a time."""

    to: list[Places] = field(default_factory=list)
    of: list[Places] = field(default_factory=list)

    def put(self, to: Places, of: Places) -> None:
        self.to.append(np.ravel(to))
        self.of.append(np.ravel(of))

    @property
    def both(self) -> tuple[Places, Places]:
        nothing = [np.empty(0, dtype=np.int64)]
        return np.concatenate(self.to + nothing), np.concatenate(self.of + nothing)


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
        self.bounds = p.bounds * p.output_scale[:, None] + p.output_offset[:, None]
        self._fix()
        self.is_sum = self.fixed.copy()
        for member, is_equation in zip(self.members, p.equations.is_one, strict=True):
            self.is_sum[member.y] &= member.n == 0 and not is_equation
        self._order()

    def _fix(self) -> None:
        """Which outputs are held between two numbers, which these are, and what each of them is."""
        p, bounds = self.p, self.bounds
        lost = np.column_stack([bounds[:, 0] >= p.limits[:, 0], bounds[:, 1] <= p.limits[:, 1]])
        self.limits = np.where(lost, bounds, p.limits)
        self.codes = np.where(lost, LOST, np.array([LOW, HIGH])).astype(np.int64)
        # Where one is outside the other, what holds is a matter of order.
        self.fixed = (p.limit_channel < 0).all(axis=1) & (self.limits[:, 0] <= self.limits[:, 1])

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

    def plan(self) -> Plan:
        """All of it."""
        p = self.p
        weights, weights_first, gate_blocks, neuron_first, n_weights = self._blocks()
        readout, readout_first, n_readout = self._readouts()
        numbers, sums = self._sums()
        networks = [[m for m in some if self.members[m].n] for some in self.by_level]
        others = [self._outputs(some, sums=False) for some in self.by_level]
        divisor, lost, factor, shift = self._units()
        wired = Layout(
            theta=np.zeros(len(p.theta)),
            bounds=self.bounds,
            networks=_whole([m for some in networks for m in some]),
            network_first=firsts(map(len, networks)),
            neurons_first=firsts(sum(LANES * self.members[m].blocks for m in some) for some in networks),
            weights=np.zeros(n_weights),
            weights_first=weights_first,
            blocks=_whole([member.blocks for member in self.members]),
            gate_blocks=gate_blocks,
            neuron_first=neuron_first,
            readout=np.zeros(n_readout),
            readout_first=readout_first,
            sums=sums,
            order_y=_whole([o for some in others for o in some]),
            level_first_y=firsts(map(len, others)),
            member=np.repeat(np.arange(len(self.members)), np.diff(p.output_first)),
            constant=np.concatenate([member.constant for member in self.members]),
            linear_first=self._linear(),
            fixed=self.fixed,
            fixed_limits=self.limits,
            fixed_codes=self.codes,
        )
        return Plan(
            wired=wired, divisor=divisor, lost=lost, factor=factor, shift=shift, weights=weights, readout=readout,
            numbers=numbers,
        )  # fmt: skip

    def _outputs(self, members: list[int], *, sums: bool) -> list[int]:
        """The outputs of some members that are sums, or the others."""
        every = [o for m in members for o in range(self.members[m].y.start, self.members[m].y.stop)]
        return [o for o in every if self.is_sum[o] == sums]

    def _linear(self) -> Places:
        firsts = [
            member.linear[:, 0] if member.is_linear and member.n_x else np.full(member.n_y, -1)
            for member in self.members
        ]
        return np.concatenate(firsts).astype(np.int64)

    def _blocks(self) -> tuple[tuple[Places, Places], Places, Places, Places, int]:
        """Neurons and gates in blocks, members in the order in which they run."""
        places, at, at_neuron = _Places(), 0, 0
        first, gate_blocks, neuron_first = (np.zeros(len(self.members), dtype=np.int64) for _ in range(3))
        for m in self.order:
            one = self.members[m]
            first[m], neuron_first[m] = at, at_neuron
            at_neuron += LANES * one.blocks
            for rows, constants in ((one.weights, one.biases), (one.gates, one.readout[0])):
                if len(rows):
                    k = np.arange(one.n)
                    own = at + k // LANES * LANES * (one.n_x + 1) + k % LANES
                    places.put(own[:, None] + LANES * np.arange(one.n_x), rows)
                    places.put(own + LANES * one.n_x, constants)
                    at += LANES * one.blocks * (one.n_x + 1)
            gate_blocks[m] = one.blocks if len(one.gates) else 0
        return places.both, first, gate_blocks, neuron_first, at

    def _readouts(self) -> tuple[tuple[Places, Places], Places, int]:
        places, at = _Places(), 0
        first = np.zeros(len(self.p.output_channel), dtype=np.int64)
        for m in self.order:
            one = self.members[m]
            for j in range(one.n_y):
                first[one.y.start + j] = at
                places.put(at + np.arange(one.n), one.readout[j])
                at += LANES * one.blocks
        return places.both, first, at

    def _sums(self) -> tuple[tuple[Places, Places], Sums]:
        """Outputs that are sums, with what the pass needs of each side by side."""
        p, places, numbers, indices, codes = self.p, _Places(), list[float](), list[int](), list[Places]()
        by_level = [self._outputs(some, sums=True) for some in self.by_level]
        for o in (o for some in by_level for o in some):
            member = self.members[int(np.searchsorted(p.output_first, o, side="right")) - 1]
            j, at = o - member.y.start, len(numbers)
            terms = member.linear[j] if member.is_linear else np.empty(0, dtype=np.int64)
            places.put(np.array([at]), member.constant[j : j + 1])
            places.put(at + SUM_HEAD + np.arange(len(terms)), terms)
            numbers += [0.0, *self.limits[o], *[0.0] * len(terms)]
            indices += [len(terms), int(p.output_channel[o]), o, *range(member.x.start, member.x.start + len(terms))]
            codes.append(self.codes[o])
        sums = Sums(
            first=firsts(map(len, by_level)),
            numbers=np.array(numbers, dtype=np.float64),
            indices=np.array(indices, dtype=np.uint64),
            codes=np.array(codes, dtype=np.int64).reshape(-1, 2),
        )
        return places.both, sums

    def _units(self) -> tuple[Array, tuple[Places, Places, Array], Array, Array]:
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
        to, by = lost.both
        return divisor, (to, by, np.concatenate([*times, np.empty(0)])), factor, shift


def _whole(values: list[int]) -> Places:
    return np.array(values, dtype=np.int64)


def firsts(counts: Iterable[int]) -> Places:
    """Where each of some things begins that stand one after the other, and where the last ends; by how long each is."""
    return np.concatenate([[0], np.cumsum([*counts])]).astype(np.int64)
