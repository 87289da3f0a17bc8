"""The bodies of the loops of a whole free run: one step, cars along the last axis, as few nodes as it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid.export.incremental_form import IncrementalForm
from sysid.export.lagged_form import LaggedForm
from sysid.export.layout import StateLayout
from sysid.export.onnx_nodes import Nodes
from sysid.export.onnx_state_space import state_space_step, within_bound
from sysid.export.onnx_step import added
from sysid.export.stage import Side, Stage


@dataclass(frozen=True, kw_only=True)
class Body:
    """A loop's body.

    Args:
        graph: The graph: carried numbers and scanned rows in, carried numbers and the scaled outputs out.
        held: Whether the outputs are within their bounds already; if not, they have to be clipped after the loop, which
            takes a node out of it.
    """

    graph: Any
    held: bool


def clip_range(stage: Stage) -> tuple[float, float] | None:
    """What one ``Clip`` holds the scaled outputs within; ``None`` where nothing is left for it.

    Args:
        stage: The stage.

    Returns:
        The model's own bounds, drawn in to the declared limits where these are numbers and there is one output.
    """
    form, (low, high) = stage.form, (stage.form.low, stage.form.high)
    if merges_limits(stage):
        offset, scale = form.offset[-1], form.scale[-1]
        for side in stage.limits[0]:
            value = (side.value - offset) / scale
            low, high = (low, min(high, value)) if side.upper else (max(low, value), high)
    return (low, high) if np.isfinite(low) or np.isfinite(high) else None


def merges_limits(stage: Stage) -> bool:
    """Whether the declared limits are part of the one ``Clip``: a single output, and numbers that do not cross."""
    sides = stage.limits[0]
    if len(stage.limits) > 1 or any(side.column is not None for side in sides):
        return False
    values = {side.upper: side.value for side in sides}
    return values.get(False, -np.inf) <= values.get(True, np.inf)


def lagged_body(
    outer: Nodes, stage: Stage, incremental: IncrementalForm, carried: Sequence[str], scanned: Sequence[str]
) -> Body:
    """The body for a model over lagged regressors.

    Args:
        outer: The graph around it.
        stage: The stage.
        incremental: Its weights, with the outputs in blocks.
        carried: Names of what is carried: ``level`` and perhaps ``rates`` and ``remainder``, or ``line``.
        scanned: Names of the rows of a sample: ``x``, and channels that are limits.

    Returns:
        The body.
    """
    nodes = Nodes(outer.dtype, prefix=f"{outer.prefix}body_")
    form, layout = stage.lagged
    past = [nodes.prefix + name for name in carried]
    if not form.adds:
        rows = [layout.outputs[term.channel - form.n_inputs].column(term.lag) for term in incremental.outputs]
        rows = [row - layout.outputs[0].first for row in rows]
        past = [nodes.add("Gather", [past[0], nodes.integers(rows)], "lagged", axis=0)] if rows else []
    z = nodes.add("Concat", [f"{nodes.prefix}x", *past], "regressors", axis=0)
    change = _network(nodes, form, incremental, z, keeps="remainder" in carried)
    total = nodes.add("Add", [f"{nodes.prefix}level", change], "sum") if form.adds else change
    held = _held(nodes, stage, total)
    output = total if merges_limits(stage) and held != total else nodes.add("Identity", [held], "y")
    sizes = _sizes(form, layout)
    after = _carry(nodes, stage, carried, sizes, _Sums(change=change, total=total, held=held))
    n_x = max(1, len(incremental.inputs))
    graph = nodes.graph(
        "one_step",
        [nodes.value(name, [sizes[name], "batch"]) for name in carried]
        + [nodes.value(name, [n_x if name == "x" else 1, "batch"]) for name in scanned],
        [
            nodes.value(name.removeprefix(nodes.prefix), [sizes[c], "batch"])
            for c, name in zip(carried, after, strict=True)
        ]
        + [nodes.value(output.removeprefix(nodes.prefix), [form.n_outputs, "batch"])],
    )
    return Body(graph=graph, held=output != total)


def _sizes(form: LaggedForm, layout: StateLayout) -> dict[str, int]:
    """Rows of everything that can be carried."""
    longest = max(line.length for line in layout.outputs)
    n = form.n_outputs
    return {
        "level": n,
        "rates": n * (longest - 1),
        "remainder": n,
        "line": sum(line.length for line in layout.outputs),
    }


def _network(nodes: Nodes, form: LaggedForm, incremental: IncrementalForm, z: str, *, keeps: bool) -> str:
    """The network's sums; the remainder, last among the regressors, is added by a weight of one."""
    n = form.n_outputs
    pad = 0 if incremental.inputs else 1  # the loop needs a row to run over
    wide = ((0, 0), (pad, n if keeps else 0))
    weights, gates, linear = (
        np.pad(table, wide) for table in (incremental.hidden_weights, incremental.gates, incremental.linear)
    )
    if keeps:
        linear[:, -n:] = np.eye(n)
    if form.neurons:
        bias = nodes.numbers("b", form.hidden_bias[:, np.newaxis])
        sums = nodes.add("Gemm", [nodes.numbers("W", weights), z, bias], "hidden_sum")
        hidden = form.neuron.onnx(nodes, sums, "hidden")
        readout = form.readout
        if form.gated:
            opened = nodes.add("Gemm", [nodes.numbers("G", gates), z, nodes.numbers("v", readout.T)], "gates")
            hidden, readout = nodes.add("Mul", [hidden, opened], "behind_gates"), np.ones_like(readout)
        # Side by side, neurons and regressors reach the outputs in one product.
        z = nodes.add("Concat", [hidden, z], "neurons_and_regressors", axis=0)
        linear = np.concatenate([readout, linear], axis=1)
    constant = nodes.numbers("c", form.constant[:, np.newaxis])
    return nodes.add("Gemm", [nodes.numbers("V_and_w", linear), z, constant], "change")


@dataclass(frozen=True, kw_only=True)
class _Sums:
    """Names of the outputs on their way: their change, their sum with the last ones, and what is held of it."""

    change: str
    total: str
    held: str


def _carry(nodes: Nodes, stage: Stage, carried: Sequence[str], sizes: dict[str, int], sums: _Sums) -> list[str]:
    """What the next step begins with."""
    form, layout = stage.lagged
    held = sums.held
    after = {"level": held}
    if "rates" in carried:
        rate = nodes.add("Sub", [held, f"{nodes.prefix}level"], "rate")
        kept = sizes["rates"] - form.n_outputs
        if kept:
            span = [nodes.integers([0]), nodes.integers([kept]), nodes.integers([0])]
            rate = nodes.add("Concat", [rate, nodes.add("Slice", [f"{nodes.prefix}rates", *span], "kept")], "r", axis=0)
        after["rates"] = rate
    if "remainder" in carried:
        moved = nodes.add("Sub", [sums.total, f"{nodes.prefix}level"], "moved")
        after["remainder"] = nodes.add("Sub", [sums.change, moved], "lost")
    if "line" in carried:
        first, n = layout.outputs[0].first, form.n_outputs
        rows = [
            j if lag == 1 else n + line.column(lag - 1) - first
            for j, line in enumerate(layout.outputs)
            for lag in range(1, line.length + 1)
        ]
        both = nodes.add("Concat", [held, f"{nodes.prefix}line"], "newest_and_line", axis=0)
        after["line"] = nodes.add("Gather", [both, nodes.integers(rows)], "line_out", axis=0)
    return [after[name] for name in carried]


def _held(nodes: Nodes, stage: Stage, total: str) -> str:
    """The scaled outputs within bounds and declared limits."""
    span = clip_range(stage)
    if span is not None:
        total = nodes.add("Clip", [total, nodes.numbers("low", span[0]), nodes.numbers("high", span[1])], "bounded")
    if merges_limits(stage) or not stage.limited:
        return total
    rows = [total]
    if len(stage.limits) > 1:
        rows = nodes.split(total, [f"y{j}" for j in range(len(stage.limits))], axis=0)
    for j, sides in enumerate(stage.limits):
        for side in sides:
            part = nodes.within(f"{nodes.prefix}limit{j}_{'high' if side.upper else 'low'}_")
            at = nodes.prefix + limit_name(j, side)
            limit = at if (j, side) in scanned_limits(stage) else _limit(part, stage, j, side, rows)
            beyond = part.add("Greater" if side.upper else "Less", [rows[j], limit], "beyond")
            rows[j] = part.add("Where", [beyond, limit, rows[j]], "value")
    return nodes.add("Concat", rows, "within_limits", axis=0)


def limit_name(j: int, side: Side) -> str:
    """The scanned row that is a limit."""
    return f"limit{j}_{'high' if side.upper else 'low'}"


def scanned_limits(stage: Stage) -> list[tuple[int, Side]]:
    """Limits that are channels from outside the stage, each a scanned row."""
    return [
        (j, side)
        for j, sides in enumerate(stage.limits)
        for side in sides
        if side.column is not None and side.column not in stage.targets
    ]


def _limit(nodes: Nodes, stage: Stage, j: int, side: Side, rows: Sequence[str]) -> str:
    """A limit from within the stage in the scaled numbers of an output."""
    form, n = stage.form, stage.form.n_inputs
    offset, scale = form.offset[n + j], form.scale[n + j]
    if side.column is None:
        return nodes.numbers("limit", [[(side.value - offset) / scale]])
    i = stage.targets.index(side.column)
    slope, shift = form.scale[n + i] / scale, (form.offset[n + i] - offset) / scale
    return nodes.add(
        "Add",
        [nodes.add("Mul", [rows[i], nodes.numbers("slope", slope)], "sloped"), nodes.numbers("shift", shift)],
        "limit",
    )


def state_space_body(outer: Nodes, stage: Stage, *, keeps: bool) -> Body:
    """The body for a state space: it carries its state, and each step is two products.

    Args:
        outer: The graph around it.
        stage: The stage.
        keeps: Whether what rounding takes from the state is kept.

    Returns:
        The body; declared limits hold the output alone, after the loop.
    """
    nodes, form = Nodes(outer.dtype, prefix=f"{outer.prefix}body_"), stage.state_space
    n, x = form.n_state, f"{nodes.prefix}state"
    z = nodes.add("Concat", [x, f"{nodes.prefix}x"], "state_and_inputs", axis=0)
    output, change = state_space_step(nodes, form, z, rows=True)
    following, lost = added(nodes, x, change, f"{nodes.prefix}remainder" if keeps else None)
    following = within_bound(nodes, form, following)
    carried = {"state": following} | ({} if lost is None else {"remainder": lost})
    graph = nodes.graph(
        "one_step",
        [*(nodes.value(name, [n, "batch"]) for name in carried), nodes.value("x", [form.n_inputs, "batch"])],
        [
            *(nodes.value(name.removeprefix(nodes.prefix), [n, "batch"]) for name in carried.values()),
            nodes.value(output.removeprefix(nodes.prefix), [form.n_outputs, "batch"]),
        ],
    )
    return Body(graph=graph, held=False)
