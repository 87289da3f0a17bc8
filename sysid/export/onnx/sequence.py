"""A whole free run as an ONNX graph: one ``Scan`` around the step, of any length, for any number of cars at once.

The terms of all inputs are laid side by side before the loop, and units and flags are made after it, each over all
samples at once: the body is left with few nodes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike
from onnx import helper

from sysid.export.onnx.blocks import in_blocks
from sysid.export.onnx.core import Step, join, past_rows, step_core
from sysid.export.onnx.flags import flags_of
from sysid.export.onnx.nodes import TO_END, Nodes
from sysid.export.onnx.outputs import in_units, known_inputs, reader, scaled_inputs, state_after
from sysid.export.onnx.step import whole_or_exact
from sysid.export.surrogate import Surrogate
from sysid.export.wide.whole import WideForm


def sequence_graph(surrogate: Surrogate, dtype: DTypeLike) -> Any:
    """The graph of a free run.

    Inputs ``u (time, batch, n_inputs)`` in units and ``state (batch, n_state)``; outputs ``y (time, batch,
    n_outputs)`` in their units, ``state_out (batch, n_state)``, so that a run in pieces equals one long run, and
    ``flags (time, batch, 1)``.

    Args:
        surrogate: What to write.
        dtype: Of the numbers.

    Returns:
        The ``GraphProto``.
    """
    nodes, form = Nodes(dtype, trailing=2), WideForm.of(surrogate, dtype)
    given = nodes.add("Transpose", ["u"], "u_rows", perm=[2, 0, 1])
    u, nothing = known_inputs(nodes, given)
    state = nodes.add("Transpose", ["state"], "state_rows_before", perm=[1, 0])
    scaled, rows = scaled_inputs(nodes, form, u, (given, nothing))
    depth = max((line.length for line in form.input_lines), default=0)
    history = _with_past(nodes, form, (scaled, rows), state, depth) if depth else scaled
    x = _terms(nodes, form, history, rows, depth) if form.inputs else u
    memory = nodes.rows(state, form.memory, surrogate.state_length(dtype), "memory")

    def core(part: Nodes, plan: WideForm) -> Step:
        begun = memory
        if plan.memory != form.memory:
            begun = part.add("Gather", [state, part.integers(plan.memory)], "memory_before", axis=0)
        made = (_loop_in_a_ring if _turns(plan) else _loop)(part, plan, x, begun)
        order = [plan.places[column] for column in form.memory]
        return Step(raw=made.raw, memory=part.rows(made.memory, order, len(order), "memory_in_order"))

    made = whole_or_exact(nodes, form, u, core)
    units = in_units(nodes, form, made.raw, u)
    nodes.add("Transpose", [units.outputs], "y", perm=[1, 2, 0])
    tails = [_tail(nodes, form, history, rows, depth)] if depth else []
    nodes.add("Transpose", [state_after(nodes, form, made.memory, tails)], "state_out", perm=[1, 0])
    nodes.add(
        "Transpose",
        [flags_of(nodes, surrogate, (given, nothing), units.watched, units.reached)],
        "flags",
        perm=[1, 2, 0],
    )
    return in_blocks(surrogate, nodes)


def _turns(form: WideForm) -> bool:
    """Whether the memory is delay lines alone, long enough that not moving them is worth it."""
    lengths = [line.length for line in form.lines]
    return not form.exact and 1 < len(lengths) < sum(lengths) == len(form.memory) and bool(past_rows(form))


def _loop_in_a_ring(nodes: Nodes, form: WideForm, x: str, memory: str) -> Step:
    """The loop with a memory that lies still: what would move on by a row is counted from one row before.

    Rows are counted around the whole memory. A row that the end of one line would push into the next is where the
    next one's newest number is written, as when all of it is moved.
    """
    part, n = nodes.within(f"{nodes.prefix}ring_"), len(form.memory)
    one, size = part.integers([1]), part.integers([n])
    samples = part.add("Shape", [x], "samples", start=1, end=2)
    count = part.add("Squeeze", [samples], "count")
    turn = part.add("Range", [part.integers(0), count, part.integers(1)], "sample")
    turn = part.add("Reshape", [part.add("Mod", [turn, size], "turn"), part.integers([-1, 1])], "turns")
    rows = part.integers([[row for own in past_rows(form).values() for row in own]])
    reads = part.add("Sub", [rows, turn], "reads")  # below zero counts from the end
    firsts = part.integers([np.cumsum([0, *(line.length for line in form.lines)])[:-1].tolist()])
    before = part.add("Sub", [part.add("Sub", [firsts, one], "before"), turn], "unturned")
    writes = part.add("Unsqueeze", [part.add("Mod", [before, size], "turned"), part.integers([2])], "writes")
    made = _loop(nodes, form, x, memory, (reads, writes))
    last = part.add("Sub", [part.integers([*range(n)]), part.add("Mod", [samples, size], "last")], "last_rows")
    return Step(raw=made.raw, memory=part.add("Gather", [made.memory, last], "memory_unturned", axis=0))


def _loop(nodes: Nodes, form: WideForm, x: str, memory: str, ring: tuple[str, str] | None = None) -> Step:
    """The loop over samples; rows of all samples, shape ``(n_rows, time, batch)``."""
    body = Nodes(nodes.dtype, f"{nodes.prefix}body_")
    turned = (f"{body.prefix}reads", f"{body.prefix}writes") if ring else None
    made = step_core(body, form, f"{body.prefix}x", f"{body.prefix}memory", ring=turned)
    n_x = len(form.inputs) or len(form.surrogate.inputs)
    n_rows = sum(len(group.rows) for group in form.groups)
    graph = body.graph(
        "one_step",
        [body.value("memory", [len(form.memory), "batch"]), body.value("x", [n_x, "batch"]), *_places(body, ring)],
        [
            body.value(made.memory.removeprefix(body.prefix), [len(form.memory), "batch"]),
            body.value(made.raw.removeprefix(body.prefix), [n_rows, "batch"]),
        ],
    )
    outputs = [f"{nodes.prefix}memory_end", f"{nodes.prefix}raw"]
    nodes.nodes.append(
        helper.make_node(
            "Scan",
            [memory, x, *(ring or ())],
            outputs,
            name=f"{nodes.prefix}loop",
            body=graph,
            num_scan_inputs=3 if ring else 1,
            scan_input_axes=[1, 0, 0] if ring else [1],
            scan_output_axes=[1],
        )
    )
    return Step(raw=outputs[1], memory=outputs[0])


def _places(body: Nodes, ring: tuple[str, str] | None) -> list[Any]:
    """Descriptions of the places that a body is given."""
    shapes: dict[str, list[int | str]] = {"reads": ["n_reads"], "writes": ["n_writes", 1]}
    return [body.value(name, shape, dtype=np.int64) for name, shape in shapes.items()] if ring else []


def _with_past(nodes: Nodes, form: WideForm, scaled: tuple[str, dict[Any, int]], state: str, depth: int) -> str:
    """Inputs with ``depth`` samples before them, oldest first; beyond a shorter line stands its oldest."""
    lines, (value, rows) = {reader(line): line for line in form.input_lines}, scaled
    columns = []
    for one in rows:
        line = lines.get(one)
        columns += [0 if line is None else line.first + min(lag, line.length) - 1 for lag in range(depth, 0, -1)]
    past = nodes.add("Gather", [state, nodes.integers(columns)], "past_columns", axis=0)
    shaped = nodes.add("Reshape", [past, nodes.integers([len(rows), depth, -1])], "past_samples")
    return nodes.add("Concat", [shaped, value], "u_with_past", axis=1)


def _terms(nodes: Nodes, form: WideForm, history: str, rows: dict[Any, int], depth: int) -> str:
    """Terms of inputs of all samples, shape ``(n_terms, time, batch)``."""
    pieces = []
    for older, lag in sorted({(one.older, one.lag) for one in form.inputs}):
        own = [rows[reader(one)] for one in form.inputs if (one.older, one.lag) == (older, lag)]
        samples = [
            nodes.rows(_lagged(nodes, history, at, depth), own, len(rows), f"u_lag{at}_of_{lag}_{older + 1}")
            for at in (lag, older)
            if at >= 0
        ]
        pieces.append(samples[0] if older < 0 else nodes.add("Sub", samples, f"u_rate{lag}_{older}"))
    return join(nodes, pieces, "terms")


def _lagged(nodes: Nodes, history: str, lag: int, depth: int) -> str:
    """Inputs some samples ago."""
    if not depth:
        return history
    name = f"u_lag{lag}"
    if f"{nodes.prefix}{name}" in {output for node in nodes.nodes for output in node.output}:
        return f"{nodes.prefix}{name}"
    span = [nodes.integers([depth - lag]), nodes.integers([-lag if lag else TO_END]), nodes.integers([1])]
    return nodes.add("Slice", [history, *span], name)


def _tail(
    nodes: Nodes, form: WideForm, history: str, rows: dict[Any, int], depth: int
) -> tuple[str, dict[int, int], int]:
    """The inputs' lines after the last sample: name, row of each column of the state, number of rows."""
    span = [nodes.integers([-depth]), nodes.integers([TO_END]), nodes.integers([1])]
    newest = nodes.add("Slice", [history, *span], "newest_inputs")
    flat = nodes.add("Reshape", [newest, nodes.integers([len(rows) * depth, -1])], "newest_rows")
    places = {
        line.first + lag - 1: rows[reader(line)] * depth + depth - lag
        for line in form.input_lines
        for lag in range(1, line.length + 1)
    }
    return flat, places, len(rows) * depth
