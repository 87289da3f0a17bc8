"""What lies around the step in both graphs: terms of inputs before it; outputs in units, and flags, after it.

All of it has channels along the first axis; behind that lie samples and cars, or cars alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid.export.flags import MEANING, Flag
from sysid.export.forms.stage import Port
from sysid.export.onnx.flags import Cause, Watched
from sysid.export.onnx.holds import within
from sysid.export.onnx.limits import LimitedRow, Limits, limited_rows
from sysid.export.onnx.nodes import Nodes
from sysid.export.surrogate import Surrogate
from sysid.export.wide.whole import WideForm

STATE_TEXT = "past samples, scaled; the layout stands in model.json under state"
FLAGS_TEXT = "the sum of: " + "; ".join(f"{int(flag)}: {text}" for flag, text in MEANING.items())


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
        watched: Rows that raise flags by what they are.
        reached: Truths, and what each raises where it is so: nothing, where it is not told.
        alone: Of one output that no declared limit holds: its scaled number, and their offset and scale.
    """

    outputs: str
    watched: tuple[Watched, ...]
    reached: tuple[Cause, ...]
    alone: tuple[str, float, float] | None


def in_units(nodes: Nodes, form: WideForm, raw: str, u: str) -> Units:
    """What is computed, in units, held within bounds and declared limits to the last digit.

    Args:
        nodes: The graph.
        form: The whole.
        raw: Rows of all groups, before declared limits.
        u: The inputs in units.

    Returns:
        The names.
    """
    starts = np.cumsum([0, *(len(group.rows) for group in form.groups)])
    rows = limited_rows(form)
    places = {channel: int(starts[g]) + at for channel, (g, at) in form.channels.items() if channel in rows}
    rows = {channel: rows[channel] for channel in sorted(rows, key=places.__getitem__)}
    numbers = nodes.rows(raw, [places[channel] for channel in rows], int(starts[-1]), "numbers")
    own = [int(starts[g]) + at for g, group in enumerate(form.groups) for at in range(group.n_outputs)]
    lost: list[Watched] = []
    if any(group.computes for group in form.groups):  # a state may be lost a sample before it is read
        lost.append(Watched.lost_in(nodes.rows(raw, own, int(starts[-1]), "raw_outputs"), len(own)))
    elif len(rows) < int(starts[-1]):
        lost.append(Watched.lost_in(raw, int(starts[-1])))
    if len(rows) == len(form.surrogate.columns) == 1 and not any(row.sides for row in rows.values()):
        return _alone(nodes, next(iter(rows.values())), numbers, lost)
    offset, scale = (
        nodes.column(f"output_{name}", [getattr(row, name) for row in rows.values()]) for name in ("offset", "scale")
    )
    values = nodes.add("Add", [nodes.add("Mul", [numbers, scale], "y_centred"), offset], "in_units")
    limits = Limits(nodes, rows, u, len(form.surrogate.inputs), values)
    outputs = limits.values([column - len(form.surrogate.inputs) for column in form.surrogate.columns], "outputs")
    return Units(outputs=outputs, watched=(*limits.watched, *lost), reached=tuple(limits.reached), alone=None)


def _alone(nodes: Nodes, row: LimitedRow, numbers: str, lost: Sequence[Watched]) -> Units:
    """One output that no declared limit holds: it is held within its bounds as the scaled number that it is."""
    low, high = np.array([row.low]), np.array([row.high])
    held = within(nodes, numbers, low, high, "within_bounds")
    at_bound = [Flag.AT_BOUND]
    scale, offset = nodes.column("output_scale", [row.scale]), nodes.column("output_offset", [row.offset])
    return Units(
        outputs=nodes.add("Add", [nodes.add("Mul", [held, scale], "y_centred"), offset], "in_units"),
        watched=(Watched.held(held, (low, high), (at_bound, at_bound), nodes.dtype), *lost),
        reached=(),
        alone=(held, row.offset, row.scale),
    )


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
