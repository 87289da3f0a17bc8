"""A whole as few wide products: stages that do not wait for each other are computed together.

A runtime of graphs takes longer to call a node than for its arithmetic, so that a cascade of a hundred small models is
as fast as it has few nodes. Stages of one level, whose readings of the sample are all known, are one group: one table
over what any of them reads, with zeros where a stage does not, as long as multiplying by these zeros costs less than
nodes do. A zero times a number that is not one is not zero: what reads numbers that are not takes the exact plan, in
which every stage is a group of its own and reads nothing but its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import DTypeLike, NDArray

from sysid.export.forms.stage import Stage
from sysid.export.surrogate import Surrogate
from sysid.export.wide.blocks import Block, block_of, levels_of
from sysid.export.wide.terms import InputTerm, Now, Past, affine
from sysid.kernels.neurons import Neuron

WORTH = 3000
"""Multiplications by zero that cost as much as a group of its own, about: for one car more, for a hundred fewer."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """A delay line of a channel that is computed.

    Args:
        first: Where it begins in the state.
        length: Samples held.
        channel: The channel's place among what is computed.
        slope: From the scaled numbers of who computes it to those of the line.
        shift: The same.
    """

    first: int
    length: int
    channel: int
    slope: float
    shift: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Group:
    """Stages that are computed together. Rows of outputs come before those of states.

    Args:
        blocks: The stages.
        past: Columns of the state that they read.
        inputs: Terms of inputs that they read.
        now: What is computed before them that they read.
    """

    blocks: tuple[Block, ...]

    @cached_property
    def past(self) -> tuple[int, ...]:
        """Columns of the state that they read."""
        return tuple(sorted({one.column for block in self.blocks for one in block.readings if isinstance(one, Past)}))

    @cached_property
    def inputs(self) -> tuple[InputTerm, ...]:
        """Terms of inputs that they read."""
        return tuple(sorted({one for block in self.blocks for one in block.readings if isinstance(one, InputTerm)}))

    @cached_property
    def now(self) -> tuple[int, ...]:
        """What is computed before them that they read."""
        return tuple(sorted({channel for block in self.blocks for channel in block.now}))

    @property
    def neuron(self) -> Neuron:
        """What neurons make of their sums."""
        return next((block.neuron for block in self.blocks if block.neurons), self.blocks[0].neuron)

    @property
    def computes(self) -> bool:
        """Whether it is equations, which are a group of their own."""
        return self.blocks[0].computes

    @property
    def rectified(self) -> bool:
        """Whether outputs are absolute values."""
        return any(block.rectified for block in self.blocks)

    @property
    def gated(self) -> bool:
        """Whether a neuron has a gate."""
        return any(block.gates is not None for block in self.blocks)

    @property
    def n_outputs(self) -> int:
        """Rows that are outputs."""
        return sum(block.n_outputs for block in self.blocks)

    @property
    def rows(self) -> list[tuple[Block, int]]:
        """Block and row of every row."""
        outputs = [(block, j) for block in self.blocks for j in range(block.n_outputs)]
        return outputs + [(block, j) for block in self.blocks for j in range(block.n_outputs, block.rows)]

    @property
    def cost(self) -> int:
        """Multiplications of a sample, about."""
        neurons, rows = sum(block.neurons for block in self.blocks), sum(block.rows for block in self.blocks)
        reads = len(self.past) + len(self.inputs) + len(self.now)
        return (neurons * (2 if self.gated else 1) + rows) * reads + rows * neurons

    def fits(self, block: Block) -> bool:
        """Whether a block can be computed in the same nodes, and is better computed so."""
        if self.computes or block.computes:
            return False
        own, kinds = Group(blocks=(block,)), {one.neuron.name for one in self.blocks if one.neurons}
        if block.neurons and kinds | {block.neuron.name} != {block.neuron.name}:
            return False
        if self.rectified is not block.rectified:
            return False
        return Group(blocks=(*self.blocks, block)).cost - self.cost - own.cost <= WORTH

    def stacked(self, name: str) -> NDArray[np.float64]:
        """A table of all blocks over the terms of all, block after block, rows in order, constants last.

        Args:
            name: Of the table in :class:`Block`; ``gates`` that a block lacks let everything through.

        Returns:
            Shape ``(n_rows, n_terms + 1)``.
        """
        by_row = name not in {"hidden", "gates"}
        starts = np.cumsum([0, *(len(block.shift) for block in self.blocks)])
        found = []
        for at, block in enumerate(self.blocks):
            own = getattr(block, name)
            if own is None:
                own = np.zeros_like(block.hidden)
                own[:, -1] = 1.0
            table = np.zeros((len(own), starts[-1] + 1))
            table[:, starts[at] : starts[at + 1]], table[:, -1] = own[:, :-1], own[:, -1]
            found.append(table)
        if not by_row:
            return np.concatenate(found)
        place = {id(block): table for block, table in zip(self.blocks, found, strict=True)}
        return np.array([place[id(block)][row] for block, row in self.rows]).reshape(-1, starts[-1] + 1)

    def bounds(self, name: str) -> NDArray[np.float64]:
        """``low`` or ``high`` of every row."""
        return np.array([getattr(block, name)[row] for block, row in self.rows])

    @property
    def readout(self) -> NDArray[np.float64]:
        """Of rows over neurons."""
        starts = np.cumsum([0, *(block.neurons for block in self.blocks)])
        place = {id(block): slice(starts[i], starts[i + 1]) for i, block in enumerate(self.blocks)}
        table = np.zeros((len(self.rows), starts[-1]))
        for i, (block, row) in enumerate(self.rows):
            table[i, place[id(block)]] = block.readout[row]
        return table

    def selection(self, columns: dict[object, int], width: int) -> NDArray[np.float64]:
        """From what is laid before the group to its terms.

        Args:
            columns: Where each reading stands in it.
            width: How much is laid before it.

        Returns:
            Shape ``(n_terms + 1, width + 1)``: with constants, so that products with tables are tables.
        """
        rows = []
        for block in self.blocks:
            part = np.zeros((len(block.shift), width + 1))
            part[:, [columns[one] for one in block.readings]] = block.selection
            part[:, -1] = block.shift
            rows.append(part)
        unit = np.zeros((1, width + 1))
        unit[0, -1] = 1.0
        return np.concatenate([*rows, unit])


@dataclass(frozen=True, kw_only=True, eq=False)
class WideForm:
    """A surrogate as groups.

    Args:
        surrogate: The whole.
        groups: In the order in which they run.
        exact: Whether each stage reads nothing but its own.
        keeps: Whether what rounding takes from sums is kept: in float32.
    """

    surrogate: Surrogate
    groups: tuple[Group, ...]
    exact: bool
    keeps: bool

    @classmethod
    def of(cls, surrogate: Surrogate, dtype: DTypeLike, *, exact: bool = False) -> WideForm:
        """A surrogate in wide form.

        Args:
            surrogate: What is written.
            dtype: Of the numbers.
            exact: See :class:`WideForm`.

        Returns:
            The form.
        """
        keeps = np.dtype(dtype) == np.float32
        blocks = [block_of(surrogate, stage, keeps=keeps) for stage in surrogate.stages]
        exact = exact or len(blocks) == 1
        groups = [Group(blocks=(block,)) for block in blocks] if exact else _grouped(blocks)
        return cls(surrogate=surrogate, groups=tuple(groups), exact=exact, keeps=keeps)

    @cached_property
    def inputs(self) -> tuple[InputTerm, ...]:
        """All terms of inputs, in the order in which they are laid before a step."""
        return tuple(sorted({one for group in self.groups for one in group.inputs}))

    @cached_property
    def channels(self) -> dict[int, tuple[int, int]]:
        """Group and row in it of everything that is computed."""
        n = len(self.surrogate.inputs)
        found = {}
        for g, group in enumerate(self.groups):
            for at, (block, row) in enumerate(group.rows[: group.n_outputs]):
                found[block.stage.targets[row] - n] = (g, at)
        return found

    @cached_property
    def lines(self) -> tuple[Line, ...]:
        """Delay lines of what is computed."""
        surrogate, n, found = self.surrogate, len(self.surrogate.inputs), []
        for stage in surrogate.stages:
            for line, source in zip(stage.state.lines, (*stage.sources, *stage.targets), strict=False):
                if line.length and source >= n:
                    slope, shift = affine(surrogate, source, line.offset, line.scale)
                    first = stage.first + line.first
                    found.append(Line(first=first, length=line.length, channel=source - n, slope=slope, shift=shift))
        return tuple(found)

    @cached_property
    def input_lines(self) -> tuple[InputTerm, ...]:
        """Delay lines of inputs, each as a term of this sample."""
        n, found = len(self.surrogate.inputs), []
        for stage in self.surrogate.stages:
            for line, source in zip(stage.state.lines, (*stage.sources, *stage.targets), strict=False):
                if line.length and source < n:
                    place = (source, line.offset, line.scale, stage.first + line.first, line.length)
                    found.append(InputTerm(-1, 0, *place))
        return tuple(found)

    @cached_property
    def memory(self) -> tuple[int, ...]:
        """What a step hands to the next, as columns of the state: lines, hidden states, what rounding took."""
        lines = [line.first + lag for line in self.lines for lag in range(line.length)]
        states = [column for group in self.groups for column in self.state_columns(group)]
        kept = [column for group in self.groups for column in self.remainders(group).values()]
        return (*lines, *states, *kept)

    @cached_property
    def places(self) -> dict[int, int]:
        """Row of the memory of each column of the state that is in it."""
        return {column: row for row, column in enumerate(self.memory)}

    def state_columns(self, group: Group) -> list[int]:
        """Columns of the state that a group's rows of states are."""
        return [block.stage.first + row - block.n_outputs for block, row in group.rows[group.n_outputs :]]

    def remainders(self, group: Group) -> dict[int, int]:
        """Columns of the state where what rounding takes from rows is kept, by row of the group."""
        found: dict[int, int] = {}
        for at, (block, row) in enumerate(group.rows):
            back = row - (block.rows - block.stage.remainders)
            if self.keeps and back >= 0:
                found[at] = self.surrogate.state_size + block.stage.first_remainder + back
        return found

    @cached_property
    def reach(self) -> tuple[tuple[float, float], ...]:
        """Between what each channel is, inputs and what is computed, in its unit; infinite where nothing holds it."""
        reach = [(-np.inf, np.inf)] * len(self.surrogate.inputs)
        for stage in self.surrogate.stages:
            form = stage.form
            for offset, scale, sides in zip(
                form.offset[form.n_inputs :], form.scale[form.n_inputs :], stage.limits, strict=True
            ):
                least, most = form.low * scale + offset, form.high * scale + offset
                for side in sides:
                    hold = min if side.upper else max
                    low, high = (side.value, side.value) if side.column is None else reach[side.column]
                    least, most = hold(least, low), hold(most, high)
                reach.append((least, most))
        return tuple(reach)

    def idle_bounds(self, stage: Stage, row: int) -> tuple[bool, bool]:
        """Whether the bounds of an output can never be what holds it, below and above: declared limits do before.

        Args:
            stage: The stage.
            row: The output.

        Returns:
            Of the lower and of the upper bound; a bound that there is not is idle.
        """
        at = stage.form.n_inputs + row
        low, high = (
            bound * stage.form.scale[at] + stage.form.offset[at] for bound in (stage.form.low, stage.form.high)
        )
        held = {
            side.upper: (side.value,) * 2 if side.column is None else self.reach[side.column]
            for side in stage.limits[row]
        }
        below = held[False][0] > low if False in held else False
        above = held[True][1] < high and self.reach[stage.targets[row]][1] < high if True in held else False
        return below or not np.isfinite(low), above or not np.isfinite(high)


def _grouped(blocks: Sequence[Block]) -> list[Group]:
    """Blocks of a level together, as far as that is worth it; networks first, then what fits to them."""
    levels, groups = levels_of(blocks), []
    for level in range(max(levels) + 1):
        own = [block for block, at in zip(blocks, levels, strict=True) if at == level]
        found: list[Group] = []
        for block in sorted(own, key=lambda one: -one.neurons):
            at = next((i for i, group in enumerate(found) if group.fits(block)), None)
            if at is None:
                found.append(Group(blocks=(block,)))
            else:
                found[at] = Group(blocks=(*found[at].blocks, block))
        groups += found
    return groups


def readings_of(form: WideForm, group: Group) -> tuple[list[int], list[int], list[tuple[int, list[int] | None]]]:
    """What is laid before a group.

    Args:
        form: The whole.
        group: The group.

    Returns:
        Rows of the memory; rows of the inputs' terms; and groups before it, with the rows that are read of their
        outputs and states, ``None`` for all.
    """
    past = [form.places[column] for column in group.past]
    inputs = [form.inputs.index(one) for one in group.inputs]
    if inputs and not form.exact:
        inputs = list(range(len(form.inputs)))
    by_group: dict[int, list[int]] = {}
    for channel in group.now:
        g, row = form.channels[channel]
        by_group.setdefault(g, []).append(row)
    whole = {g: len(form.groups[g].rows) for g in by_group}
    rows = [(g, None if not form.exact or own == [*range(whole[g])] else own) for g, own in sorted(by_group.items())]
    return past, inputs, rows


def columns_of(form: WideForm, group: Group) -> tuple[dict[object, int], int]:
    """Where each reading of a group stands in what is laid before it, and how much that is."""
    past, inputs, rows = readings_of(form, group)
    columns: dict[object, int] = {Past(form.memory[row]): at for at, row in enumerate(past)}
    columns |= {form.inputs[row]: len(past) + at for at, row in enumerate(inputs)}
    width, at_channel = len(past) + len(inputs), {place: channel for channel, place in form.channels.items()}
    for g, own in rows:
        for row in range(len(form.groups[g].rows)) if own is None else own:
            if (g, row) in at_channel:
                columns[Now(at_channel[g, row])] = width
            width += 1
    return columns, width
