"""One step of a surrogate as an ONNX graph: sample and state in, outputs, next state and flags out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike
from onnx import helper

from sysid.export.onnx.core import Step, step_core
from sysid.export.onnx.flags import flags_of
from sysid.export.onnx.nodes import Nodes
from sysid.export.onnx.outputs import ends, in_units, known_inputs, reader, scaled_inputs, state_after
from sysid.export.surrogate import Surrogate
from sysid.export.wide.whole import WideForm, readings_of

GATHERED = 100
"""Numbers of a state up to which gathering all of it is quicker than moving its lines on."""


def step_graph(surrogate: Surrogate, dtype: DTypeLike) -> Any:
    """The graph of one step.

    Inputs ``u (batch, n_inputs)`` in units and ``state (batch, n_state)``; outputs ``y (batch, n_outputs)`` in their
    units, ``state_out (batch, n_state)`` and ``flags (batch, 1)``.

    Args:
        surrogate: What to write.
        dtype: Of the numbers.

    Returns:
        The ``GraphProto``.
    """
    nodes, form = Nodes(dtype), WideForm.of(surrogate, dtype)
    given, state = (nodes.add("Transpose", [name], f"{name}_rows", perm=[1, 0]) for name in ("u", "state"))
    u, nothing = known_inputs(nodes, given)
    scaled, rows = scaled_inputs(nodes, form, u, (given, nothing))
    x = _terms(nodes, form, scaled, rows, state) if form.inputs else u
    size = surrogate.state_length(dtype)
    moves = not form.exact or size > GATHERED
    together = _together(nodes, form, scaled, state) if moves else ""

    def core(part: Nodes, plan: WideForm) -> Step:
        # Each form takes its own: the runtime warns of a slice that a branch reads too.
        laid = _laid(part, plan, (scaled, rows), state, together)
        if together and plan.memory == form.memory:
            moved = part.add("Slice", [together, *(part.integers([at]) for at in (0, size, 0))], "state_moved")
            return step_core(part, plan, x, state, laid=laid, moved=moved, before=form.memory[0])
        memory = part.rows(state, plan.memory, size, "memory")
        made = step_core(part, plan, x, memory, moves=moves, laid=laid, moved=_moved(part, plan, state))
        tails = _tails(part, plan, scaled, rows, state, moves=moves)
        return Step(raw=made.raw, memory=state_after(part, plan, made.memory, tails, moved=moves))

    made = whole_or_exact(nodes, form, u, core)
    units = in_units(nodes, form, made.raw, u)
    if units.alone:
        number, offset, scale = units.alone
        shares = [number, nodes.numbers("output_share", [[scale]]), nodes.numbers("output_shift", [[offset]])]
        nodes.add("Gemm", shares, "y", transA=1)
    else:
        nodes.add("Transpose", [units.outputs], "y", perm=[1, 0])
    nodes.add("Transpose", [made.memory], "state_out", perm=[1, 0])
    flags_of(nodes, surrogate, (given, nothing), units.watched, units.reached)
    return nodes.graph("step", *ends(nodes, surrogate, ["batch"]))


def _together(nodes: Nodes, form: WideForm, scaled: str, state: str) -> str:
    """An input before the state, where that is the line of this input and then all others: a row on, it is moved.

    ``""`` where the state is not that plain.
    """
    if len(form.input_lines) != 1 or len(form.lines) < 2:
        return ""
    (line,), size = form.input_lines, form.surrogate.state_length(nodes.dtype)
    shifted = sum(one.length for one in form.lines)
    if shifted == len(form.lines):  # nothing of them is moved, and the input's line would be left behind
        return ""
    if (line.first, line.length + shifted) != (0, size) or form.memory != (*range(line.length, size),):
        return ""
    if len({reader(one) for one in (*form.inputs, *form.input_lines)}) != 1:
        return ""
    return nodes.add("Concat", [scaled, state], "u_before_state", axis=0)


def _laid(nodes: Nodes, form: WideForm, inputs: tuple[str, dict[Any, int]], state: str, together: str) -> str:
    """What is laid before the first group, in one gather; ``""`` where others read inputs, or it is not that plain."""
    scaled, rows = inputs
    group, *more = form.groups
    if (
        any(readings_of(form, other)[1] for other in more)
        or group.computes
        or not (group.past and form.inputs)
        or any(one.older >= 0 for one in form.inputs)
    ):
        return ""
    past = [(1, column) for column in group.past]
    given = [(1, one.first + one.lag - 1) if one.lag else (0, rows[reader(one)]) for one in form.inputs]
    size = form.surrogate.state_length(nodes.dtype)
    if all(one.lag for one in form.inputs):
        return nodes.rows(state, [column for _, column in past + given], size, "laid")
    if together:
        return nodes.rows(together, [of + column for of, column in past + given], 1 + size, "laid")
    return nodes.rows_of([(scaled, len(rows)), (state, size)], past + given, "laid")


def _moved(nodes: Nodes, form: WideForm, state: str) -> str:
    """The lines moved on by a row, in one slice of a state that has them behind something else; ``""`` otherwise."""
    shifted = sum(line.length for line in form.lines)
    first = form.memory[0] if form.memory else 0
    if first == 0 or len(form.lines) < 2 or form.memory[:shifted] != (*range(first, first + shifted),):
        return ""
    return nodes.add(
        "Slice", [state, *(nodes.integers([at]) for at in (first - 1, first - 1 + shifted, 0))], "lines_moved"
    )


def _terms(nodes: Nodes, form: WideForm, scaled: str, rows: dict[Any, int], state: str) -> str:
    """Terms of inputs, from this sample and the state."""
    count = len(rows)
    known = scaled
    if all(one.lag and one.older for one in form.inputs):
        known, count, rows = state, form.surrogate.state_length(nodes.dtype), {}
    elif any(one.lag or one.older > 0 for one in form.inputs):
        known = nodes.add("Concat", [scaled, state], "u_and_state", axis=0)
        count += form.surrogate.state_length(nodes.dtype)

    def place(one: Any, lag: int) -> int:
        return rows[reader(one)] if lag == 0 else len(rows) + one.first + lag - 1

    newer = nodes.rows(known, [place(one, one.lag) for one in form.inputs], count, "newer")
    rates = [one for one in form.inputs if one.older >= 0]
    if not rates:
        return newer
    n_levels = len(form.inputs) - len(rates)
    levels, moved = ("", newer) if not n_levels else nodes.cut(newer, {"levels": n_levels, "rates_newer": len(rates)})
    older = nodes.add(
        "Gather", [known, nodes.integers([place(one, one.older) for one in rates])], "older_terms", axis=0
    )
    difference = nodes.add("Sub", [moved, older], "rates")
    return difference if not levels else nodes.add("Concat", [levels, difference], "terms", axis=0)


def _tails(nodes: Nodes, form: WideForm, scaled: str, rows: dict[Any, int], state: str, *, moves: bool) -> list[Any]:
    """What the memory does not hold of the state after the step: inputs, and what is older, from the state."""
    newest = {line.first: rows[reader(line)] for line in form.input_lines}
    tails = [(scaled, newest, len(rows))] if newest else []
    lines = [(line.first, line.length) for line in form.input_lines]
    if not moves:
        lines += [(line.first, line.length) for line in form.lines]
    older = {first + lag: first + lag - 1 for first, length in lines for lag in range(1, length)}
    return tails + ([(state, older, form.surrogate.state_length(nodes.dtype))] if older else [])


def whole_or_exact(nodes: Nodes, form: WideForm, u: str, core: Callable[[Nodes, WideForm], Step]) -> Step:
    """The wide form, and the exact one in its place where a number is none.

    Args:
        nodes: The graph.
        form: The wide form.
        u: The inputs in units.
        core: Adds what computes a form, and says what it gives; memory in the order of the wide one.

    Returns:
        What is given.
    """
    made = core(nodes, form)
    if form.exact:
        return made
    total = nodes.add("ReduceL1", [made.raw], "size_of_raw", keepdims=0)
    if any(
        side.column is not None and side.column < len(form.surrogate.inputs)
        for stage in form.surrogate.stages
        for sides in stage.limits
        for side in sides
    ):
        # A limit holds a row behind what is looked at.
        total = nodes.add("Add", [total, nodes.add("ReduceL1", [u], "size_of_u", keepdims=0)], "size_of_all")
    finite = nodes.add("Less", [total, nodes.numbers("infinite", np.inf)], "all_numbers")
    exact = WideForm.of(form.surrogate, nodes.dtype, exact=True)
    branches = []
    part = Nodes(nodes.dtype, f"{nodes.prefix}exact_", nodes.trailing)
    branches.append((part, _reordered(part, core(part, exact), exact, form)))
    part = Nodes(nodes.dtype, f"{nodes.prefix}wide_", nodes.trailing)
    branches.append((part, [part.add("Identity", [name], f"{name}_kept") for name in (made.raw, made.memory)]))
    graphs = [
        part.graph(name, [], [part.value(one.removeprefix(part.prefix), None) for one in given])
        for name, (part, given) in zip(("exact", "wide"), branches, strict=True)
    ]
    raw, memory = (f"{nodes.prefix}{name}_made" for name in ("raw", "memory"))
    nodes.nodes.append(
        helper.make_node(
            "If", [finite], [raw, memory], name=f"{nodes.prefix}wide", then_branch=graphs[1], else_branch=graphs[0]
        )
    )
    return Step(raw=raw, memory=memory)


def _reordered(nodes: Nodes, made: Step, exact: WideForm, form: WideForm) -> list[str]:
    """What the exact form gives, with rows in the order of the wide one."""
    counts = [np.cumsum([0, *(len(group.rows) for group in one.groups)]) for one in (exact, form)]
    order = [0] * int(counts[1][-1])
    places = {}
    for start, group in zip(counts[0], exact.groups, strict=False):
        for at, (block, row) in enumerate(group.rows):
            places[block.stage.first, row, block.stage.targets] = int(start) + at
    for start, group in zip(counts[1], form.groups, strict=False):
        for at, (block, row) in enumerate(group.rows):
            order[int(start) + at] = places[block.stage.first, row, block.stage.targets]
    raw = nodes.add("Gather", [made.raw, nodes.integers(order)], "raw_in_order", axis=0)
    memory = made.memory
    if not memory.startswith(nodes.prefix):
        memory = nodes.add("Identity", [memory], "memory_kept")
    return [raw, memory]
