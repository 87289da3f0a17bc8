"""What lies around the step in both graphs: terms of inputs before it; outputs in units, and flags, after it.

All of it has channels along the first axis; behind that lie samples and cars, or cars alone.
"""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.export.flags import MEANING, Flag
from sysid.export.onnx_core import bounded, join, within
from sysid.export.onnx_nodes import Nodes
from sysid.export.stage import Port, Side, Stage
from sysid.export.surrogate import Surrogate
from sysid.export.wide_form import WideForm

STATE_TEXT = "past samples, scaled; the layout stands in model.json under state"
FLAGS_TEXT = "the sum of: " + "; ".join(f"{int(flag)}: {text}" for flag, text in MEANING.items())
INT32, INT64 = 6, 7
"""``TensorProto.INT32`` and ``INT64``."""


def ends(nodes: Nodes, surrogate: Surrogate, leading: list[str]) -> tuple[list[Any], list[Any]]:
    """Descriptions of the graph's inputs and outputs.

    Args:
        nodes: The graph.
        surrogate: What is written.
        leading: Axes before the channels.

    Returns:
        Those of the inputs, and those of the outputs.
    """
    size = surrogate.state_length(nodes.dtype)
    inputs, outputs = surrogate.inputs, surrogate.outputs
    return (
        [
            nodes.value("u", [*leading, len(inputs)], _channels(inputs)),
            nodes.value("state", ["batch", size], STATE_TEXT),
        ],
        [
            nodes.value("y", [*leading, len(outputs)], _channels(outputs)),
            nodes.value("state_out", ["batch", size], STATE_TEXT),
            nodes.value("flags", [*leading, 1], FLAGS_TEXT, dtype=np.int32),
        ],
    )


def _channels(ports: tuple[Port, ...]) -> str:
    return ", ".join(f"{port.name} [{port.unit}]" for port in ports)


def known_inputs(nodes: Nodes, given: str) -> tuple[str, str]:
    """The inputs, with what is infinite as not a number: nothing times it is none, and adds nothing to all others.

    Args:
        nodes: The graph.
        given: The inputs in units.

    Returns:
        Their name, and that of nothing times each.
    """
    nothing = nodes.add("Mul", [given, nodes.numbers("nothing_of", 0.0)], "u_nothing")
    return nodes.add("Add", [given, nothing], "u_known"), nothing


def scaled_inputs(
    nodes: Nodes, form: WideForm, u: str, parts: Sequence[str]
) -> tuple[str, dict[tuple[int, float, float, int], int]]:
    """Inputs in the numbers of everybody who reads them, and the row of each.

    Args:
        nodes: The graph.
        form: The whole.
        u: The inputs in units.
        parts: What they are the sum of.

    Returns:
        The name, and rows by column, offset, scale and delay line; ``""`` where nobody reads an input.
    """
    readers = sorted({reader(one) for one in (*form.inputs, *form.input_lines)})
    if not readers:
        return "", {}
    columns, offsets = [one[0] for one in readers], np.array([one[1] for one in readers])
    if columns == [*range(len(form.surrogate.inputs))]:  # in one node
        centred = nodes.add("Sum", [*parts, nodes.column("input_offset", -offsets)], "u_centred")
    else:
        values = nodes.rows(u, columns, len(form.surrogate.inputs), "u_by_reader")
        centred = nodes.add("Sub", [values, nodes.column("input_offset", offsets)], "u_centred")
    scaled = nodes.add("Div", [centred, nodes.column("input_scale", [one[2] for one in readers])], "u_scaled")
    return scaled, {one: row for row, one in enumerate(readers)}


def reader(one: Any) -> tuple[int, float, float, int]:
    """Who reads an input: in which numbers, and with which delay line."""
    return one.column, one.offset, one.scale, one.first


@dataclass(frozen=True, kw_only=True)
class Units:
    """Names of what comes out, in units, and of what the flags are made from.

    Args:
        outputs: What comes out.
        raw: Rows of all groups, before declared limits.
        at_limit: Rows that are at a declared limit, and what each raises: nothing, where it is not told.
        at_bound: Rows that are held at a bound of the model itself, by side or both in one.
        counts: Numbers of rows of raw, and of those at a bound.
        alone: Of one output that no declared limit holds: its scaled number, and their offset and scale.
    """

    outputs: str
    raw: str
    at_limit: tuple[tuple[str, tuple[Flag | None, ...]], ...]
    at_bound: tuple[str, ...]
    counts: tuple[int, int]
    alone: tuple[str, float, float] | None


@dataclass(frozen=True, kw_only=True)
class _Row:
    """A channel that is computed: its stage, which output of it, and whether its bounds can be what holds it."""

    stage: Stage
    output: int
    low: float
    high: float

    @property
    def sides(self) -> tuple[Side, ...]:
        return self.stage.limits[self.output]

    @property
    def told(self) -> bool:
        return self.stage.told[self.output] and bool(self.sides)

    @property
    def limit_flag(self) -> Flag:
        return Flag.IN_DOUBT if self.stage.doubts[self.output] else Flag.AT_LIMIT

    @property
    def bounded(self) -> bool:
        return bool(np.isfinite(self.low) or np.isfinite(self.high))


def _rows(form: WideForm) -> dict[int, _Row]:
    """The channels that are needed in units, by place among what is computed."""
    n, every = len(form.surrogate.inputs), []
    for stage in form.surrogate.stages:
        for j in range(stage.form.n_outputs):
            below, above = form.idle_bounds(stage, j)
            low, high = -np.inf if below else stage.form.low, np.inf if above else stage.form.high
            every.append(_Row(stage=stage, output=j, low=low, high=high))
    needed = {c - n for c in form.surrogate.columns} | {i for i, row in enumerate(every) if row.told or row.bounded}
    for i in reversed(range(len(every))):  # what limits a channel is computed before it
        if i in needed:
            needed |= {side.column - n for side in every[i].sides if side.column is not None and side.column >= n}
    return {i: every[i] for i in sorted(needed)}


def in_units(nodes: Nodes, form: WideForm, raw: str, u: str) -> Units:
    """What is computed, in units, held within declared limits to the last digit.

    Args:
        nodes: The graph.
        form: The whole.
        raw: Rows of all groups, before declared limits.
        u: The inputs in units.

    Returns:
        The names.
    """
    rows, n = _rows(form), len(form.surrogate.inputs)
    starts = np.cumsum([0, *(len(group.rows) for group in form.groups)])
    places = [form.channels[channel] for channel in rows]
    numbers = nodes.rows(raw, [int(starts[g]) + at for g, at in places], int(starts[-1]), "numbers")
    low, high = (np.array([getattr(row, side) for row in rows.values()]) for side in ("low", "high"))
    if not form.exact:
        numbers = within(nodes, numbers, low, high, "within_bounds")
    at = [row.stage.form.n_inputs + row.output for row in rows.values()]
    offset, scale = (
        nodes.column(
            f"output_{name}", [getattr(row.stage.form, name)[i] for row, i in zip(rows.values(), at, strict=True)]
        )
        for name in ("offset", "scale")
    )
    values = nodes.add("Add", [nodes.add("Mul", [numbers, scale], "y_centred"), offset], "in_units")
    limits = _Limits(nodes, rows, u, n, values)
    order = [*rows]
    outputs = limits.values([order.index(column - n) for column in form.surrogate.columns], "outputs")
    at_limit = limits.raised({i: row.limit_flag for i, row in enumerate(rows.values()) if row.told})
    bounded = [i for i, row in enumerate(rows.values()) if row.bounded]
    at_bound: tuple[str, ...] = ()
    if bounded:
        numbers_held = nodes.rows(numbers, bounded, len(rows), "bounded")
        at_bound = _at_bound(nodes, numbers_held, low[bounded], high[bounded])
        at_limits = limits.reached(bounded, "bounded")
        if at_limits:
            either = at_bound[0] if len(at_bound) == 1 else nodes.add("Or", at_bound, "at_either_bound")
            at_bound = (nodes.add("And", [either, nodes.add("Not", [at_limits], "free")], "at_bound"),)
    count = int(starts[-1])
    if any(group.computes for group in form.groups):  # a state may be lost a sample before it is read
        own = [int(starts[g]) + at for g, group in enumerate(form.groups) for at in range(group.n_outputs)]
        raw, count = nodes.rows(raw, own, count, "raw_outputs"), len(own)
    alone = None
    if len(rows) == len(form.surrogate.columns) == 1 and not any(row.sides for row in rows.values()):
        ((row, i),) = zip(rows.values(), at, strict=True)
        alone = (numbers, float(row.stage.form.offset[i]), float(row.stage.form.scale[i]))
    return Units(
        outputs=outputs,
        raw=raw,
        at_limit=at_limit,
        at_bound=at_bound,
        counts=(count, len(bounded)),
        alone=alone,
    )


def _at_bound(nodes: Nodes, numbers: str, low: NDArray[np.float64], high: NDArray[np.float64]) -> tuple[str, ...]:
    """Where scaled numbers are at a bound of the model, below and above."""
    sides = {"LessOrEqual": low, "GreaterOrEqual": high}
    return tuple(
        nodes.add(
            operator,
            [numbers, nodes.column(f"bound_{operator}", np.where(np.isfinite(side), side, np.nan))],
            f"at_bound_{operator}",
        )
        for operator, side in sides.items()
        if np.isfinite(side).any()
    )


class _Limits:
    """Channels held within their declared limits, in units: numbers first, then channels, each after what holds it.

    Args:
        nodes: The graph.
        rows: The channels.
        u: The inputs in units.
        n_inputs: Their number.
        values: The channels, not yet held.
    """

    def __init__(self, nodes: Nodes, rows: Dict[int, _Row], u: str, n_inputs: int, values: str) -> None:
        self.nodes, self.rows, self.n_inputs = nodes, rows, n_inputs
        self.order, count = [*rows], len(rows)
        self.sides = {
            upper: [next((one for one in row.sides if one.upper is upper), None) for row in rows.values()]
            for upper in (True, False)
        }
        self.known = [(u, n_inputs), (values, count)]
        self.places = [(1, i) for i in range(count)]
        self.marks: list[tuple[str, int]] = []
        self.marked: dict[int, tuple[int, int]] = {}
        for turn, own in enumerate(self._turns()):
            self._turn(nodes.within(f"{nodes.prefix}turn{turn}_"), own)

    def values(self, own: Sequence[int], name: str) -> str:
        """Some channels, held."""
        return self._taken(self.nodes, [self.places[i] for i in own], name)

    def reached(self, own: Sequence[int], name: str) -> str:
        """Which of some channels are at a limit; ``""`` where none has one."""
        found = [self.marked.get(i) for i in own]
        if not any(found):
            return ""
        if None in found:
            nothing = self.nodes.truths("never", [False])
            if not any(mark == nothing for mark, _ in self.marks):
                first, count = self.marks[0]
                one = self.nodes.rows(first, [0], count, "any_mark")
                self.marks.append((self.nodes.add("And", [one, nothing], "never_reached"), 1))
        spare = (len(self.marks) - 1, 0)
        return self.nodes.rows_of(*_used(self.marks, [place or spare for place in found]), f"{name}_at_limit")

    def raised(self, flags: Dict[int, Flag]) -> tuple[tuple[str, tuple[Flag | None, ...]], ...]:
        """Which channels are at a limit, with the flag of each; all that is known, where most of it is asked for."""
        places = {self.marked[i]: flag for i, flag in flags.items()}
        used = sorted({mark for mark, _ in places})
        if sum(self.marks[mark][1] for mark in used) > 2 * len(flags):
            return ((self.reached([*flags], "told"), tuple(flags.values())),)
        marks = [(mark, *self.marks[mark]) for mark in used]
        return tuple((name, tuple(places.get((mark, row)) for row in range(count))) for mark, name, count in marks)

    def _taken(self, nodes: Nodes, places: Sequence[tuple[int, int]], name: str) -> str:
        return nodes.rows_of(*_used(self.known, places), name)

    def _turns(self) -> list[list[int]]:
        """Which channels are held in which turn."""
        turn: dict[int, int] = {}
        for i, row in enumerate(self.rows.values()):
            channels = [side.column - self.n_inputs for side in row.sides if side.column is not None]
            if row.sides:
                turn[self.order[i]] = max((1 + turn.get(channel, 0) for channel in channels), default=0)
        found = (
            [i for i, channel in enumerate(self.order) if turn.get(channel) == one]
            for one in range(1 + max(turn.values(), default=-1))
        )
        return [own for own in found if own]

    def _turn(self, nodes: Nodes, own: list[int]) -> None:
        """Hold some of the channels; all in place where they are held by numbers, which is the first turn."""
        if all(
            side is None or side.column is None for sides in self.sides.values() for side in (sides[i] for i in own)
        ):
            count = len(self.order)
            low, high = np.full(count, -np.inf), np.full(count, np.inf)
            for side, numbers in ((self.sides[False], low), (self.sides[True], high)):
                for i in own:
                    one = side[i]
                    numbers[i] = numbers[i] if one is None else one.value
            value = within(nodes, self.known[1][0], low, np.maximum(low, high), "within")  # the lower wins
            self.known[1] = (value, count)
            limits = [
                nodes.column(f"{name}_limit", np.where(np.isfinite(side), side, np.nan))
                for name, side in (("low", low), ("high", high))
                if np.isfinite(side).any()
            ]
            self._mark(nodes, value, limits, {i: i for i in own}, count)
            return
        value, limits = self.values(own, f"turn_of_{own[0]}"), []
        for upper in (True, False):
            limit = self._limits(nodes, own, upper=upper)
            if limit:
                value = bounded(nodes, value, limit, "below" if upper else "above", upper=upper, exact=True)
                limits.append(limit)
        self.known.append((value, len(own)))
        for row, i in enumerate(own):
            self.places[i] = (len(self.known) - 1, row)
        self._mark(nodes, value, limits, {i: row for row, i in enumerate(own)}, len(own))

    def _mark(self, nodes: Nodes, value: str, limits: list[str], rows: dict[int, int], count: int) -> None:
        """Keep which channels are at one of their limits."""
        at = [nodes.add("Equal", [value, limit], f"at_limit{i}") for i, limit in enumerate(limits)]
        self.marks.append((at[0] if len(at) == 1 else nodes.add("Or", at, "at_limit"), count))
        self.marked |= {i: (len(self.marks) - 1, row) for i, row in rows.items()}

    def _limits(self, nodes: Nodes, own: Sequence[int], *, upper: bool) -> str:
        """Limits of some channels on one side: channels, numbers, or what holds nothing; ``""`` for none at all."""
        side = "high" if upper else "low"
        sides = [self.sides[upper][i] for i in own]
        if not any(sides):
            return ""
        columns = [None if one is None else one.column for one in sides]
        numbers = [np.nan if one is None or one.column is not None else one.value for one in sides]
        places = [self._place(column) for column in columns if column is not None]
        if not places:
            return nodes.column(f"{side}_numbers", numbers)
        spare = places[0]
        rows = self._taken(
            nodes, [spare if column is None else self._place(column) for column in columns], f"{side}_channels"
        )
        if None not in columns:
            return rows
        mask = nodes.truths(f"{side}_is_channel", [column is not None for column in columns])
        return nodes.add("Where", [mask, rows, nodes.column(f"{side}_numbers", numbers)], f"{side}_limits")

    def _place(self, column: int) -> tuple[int, int]:
        return (0, column) if column < self.n_inputs else self.places[self.order.index(column - self.n_inputs)]


def _used(
    values: Sequence[tuple[str, int]], places: Sequence[tuple[int, int]]
) -> tuple[list[tuple[str, int]], list[tuple[int, int]]]:
    """Of some values those that rows are taken from."""
    used = sorted({value for value, _ in places})
    return [values[value] for value in used], [(used.index(value), row) for value, row in places]


def flags_of(nodes: Nodes, surrogate: Surrogate, inputs: tuple[str, str], units: Units) -> str:
    """The flags of every sample, one row.

    Args:
        nodes: The graph.
        surrogate: The whole.
        inputs: The inputs in units as they came, and nothing times each.
        units: What comes out, and why flags are raised.

    Returns:
        The name of ``flags``: of a step, one row a car; of many samples, one row before them and the cars.
    """
    ports, n = surrogate.inputs, len(surrogate.inputs)
    given, u = inputs
    causes: list[tuple[str, Sequence[Flag | None]]] = []  # rows of causes, and the flag that each raises
    for operator, side in (("Less", "low"), ("Greater", "high")):
        limits = [getattr(port, side) for port in ports]
        if np.isfinite(limits).any():
            name = nodes.add(operator, [given, nodes.column(f"declared_{side}", limits)], f"u_{operator}".lower())
            causes.append((name, [Flag.OUTSIDE_RANGE] * n))
    rows, bounds = units.counts
    causes += [(name, [Flag.AT_BOUND] * bounds) for name in units.at_bound] + [*units.at_limit]
    causes.append((nodes.add("IsNaN", [u], "u_lost"), [Flag.NOT_A_NUMBER] * n))
    causes.append((nodes.add("IsNaN", [units.raw], "raw_lost"), [Flag.NOT_A_NUMBER] * rows))
    which = [flag for _, flags in causes for flag in flags]
    present = sorted({flag for flag in which if flag is not None})
    numbers = nodes.add("Cast", [join(nodes, [name for name, _ in causes], "causes")], "marks", to=nodes.kind())
    if nodes.trailing > 1:
        numbers = nodes.add("Reshape", [numbers, nodes.integers([len(which), -1])], "marks_in_rows")
    table = nodes.numbers("flag_of_cause", [[float(flag is one) for one in which] for flag in present])
    raised = nodes.add("Sign", [nodes.add("MatMul", [table, numbers], "raised")], "raised_or_not")
    values = [[float(flag)] for flag in present]
    if nodes.trailing == 1:
        total = nodes.add("Gemm", [raised, nodes.numbers("flag_values", values)], "flag_sum", transA=1)
        return nodes.add("Cast", [total], "flags", to=INT32)
    total = nodes.add("MatMul", [nodes.numbers("flag_values", np.transpose(values)), raised], "flag_sum")
    total = nodes.add("Cast", [total], "flag_row", to=INT32)
    shape = nodes.add(
        "Concat", [nodes.integers([1]), nodes.add("Shape", [u], "u_shape", start=1)], "flag_shape", axis=0
    )
    return nodes.add("Reshape", [total, shape], "flag_rows")


def state_after(
    nodes: Nodes, form: WideForm, memory: str, tails: Sequence[tuple[str, dict[int, int], int]], *, moved: bool = True
) -> str:
    """The state with its numbers in their places, from the memory and the ends of inputs' lines.

    Args:
        nodes: The graph.
        form: The whole.
        memory: What the last step hands on.
        tails: More rows: name, row of each column of the state, and how many rows there are.
        moved: Whether the memory has whole lines, or the newest number of each alone.

    Returns:
        The name, of shape ``(n_state, batch)``.
    """
    held = form.memory
    if not moved:
        held = (*(line.first for line in form.lines), *form.memory[sum(line.length for line in form.lines) :])
    places = {column: (0, row) for row, column in enumerate(held)}
    for at, (_, own, _) in enumerate(tails, start=1):
        places |= {column: (at, row) for column, row in own.items()}
    values = [(memory, len(held)), *((name, count) for name, _, count in tails)]
    size = form.surrogate.state_length(nodes.dtype)
    return nodes.rows_of(values, [places[column] for column in range(size)], "rows_of_state")
