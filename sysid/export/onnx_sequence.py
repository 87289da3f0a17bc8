"""A whole free run as an ONNX graph: one ``Scan`` around the step, of any length, for any number of cars at once.

The terms of all inputs are laid side by side before the loop, and units and flags are made after it, each over all
samples at once: the body is left with few nodes.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import DTypeLike
from onnx import helper

from sysid.export.onnx_blocks import in_blocks
from sysid.export.onnx_core import Step, join, step_core
from sysid.export.onnx_nodes import TO_END, Nodes
from sysid.export.onnx_outputs import flags_of, in_units, known_inputs, reader, scaled_inputs, state_after
from sysid.export.onnx_step import whole_or_exact
from sysid.export.surrogate import Surrogate
from sysid.export.wide_form import WideForm


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
        return _loop(part, plan, x, begun)

    made = whole_or_exact(nodes, form, u, core)
    units = in_units(nodes, form, made.raw, u)
    nodes.add("Transpose", [units.outputs], "y", perm=[1, 2, 0])
    tails = [_tail(nodes, form, history, rows, depth)] if depth else []
    nodes.add("Transpose", [state_after(nodes, form, made.memory, tails)], "state_out", perm=[1, 0])
    nodes.add("Transpose", [flags_of(nodes, surrogate, (given, nothing), units)], "flags", perm=[1, 2, 0])
    return in_blocks(surrogate, nodes)


def _loop(nodes: Nodes, form: WideForm, x: str, memory: str) -> Step:
    """The loop over samples; rows of all samples, shape ``(n_rows, time, batch)``."""
    body = Nodes(nodes.dtype, f"{nodes.prefix}body_")
    made = step_core(body, form, f"{body.prefix}x", f"{body.prefix}memory")
    n_x = len(form.inputs) or len(form.surrogate.inputs)
    n_rows = sum(len(group.rows) for group in form.groups)
    graph = body.graph(
        "one_step",
        [body.value("memory", [len(form.memory), "batch"]), body.value("x", [n_x, "batch"])],
        [
            body.value(made.memory.removeprefix(body.prefix), [len(form.memory), "batch"]),
            body.value(made.raw.removeprefix(body.prefix), [n_rows, "batch"]),
        ],
    )
    outputs = [f"{nodes.prefix}memory_end", f"{nodes.prefix}raw"]
    nodes.nodes.append(
        helper.make_node(
            "Scan",
            [memory, x],
            outputs,
            name=f"{nodes.prefix}loop",
            body=graph,
            num_scan_inputs=1,
            scan_input_axes=[1],
            scan_output_axes=[1],
        )
    )
    return Step(raw=outputs[1], memory=outputs[0])


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
