"""One step of a whole as ONNX nodes, channels along the first axis and cars along the last: few nodes, each wide.

Measured on onnxruntime, a node of this size takes 0.3 to 0.8 us whatever it computes: of the loop of a large cascade
three quarters of the time (``python -m tests.benchmarks export_cascades``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.export.onnx.equations import stepped, terms_of
from sysid.export.onnx.holds import held_rows
from sysid.export.onnx.nodes import Nodes
from sysid.export.onnx.products import exact_parts, over, parts_of, product, row_by_row
from sysid.export.wide.whole import Group, WideForm, columns_of, readings_of

PRODUCT = 2000
"""Numbers of a table, mostly zeros, up to which one product is quicker than taking rows, scaling and shifting them."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """Names of what a step gives.

    Args:
        raw: Rows of all groups, scaled, before any bound or limit.
        memory: What the next step begins with.
    """

    raw: str
    memory: str


@dataclass(frozen=True, kw_only=True)
class _Made:
    """Names of what a group gives: rows held, and before limits; their change, what it is added to, and the sum."""

    held: str
    raw: str
    total: str = ""
    change: str = ""
    last: str = ""


def step_core(
    nodes: Nodes,
    form: WideForm,
    x: str,
    memory: str,
    *,
    moves: bool = True,
    laid: str = "",
    moved: str = "",
    before: int = 0,
    ring: tuple[str, str] | None = None,
) -> Step:
    """Add the nodes of one step.

    Args:
        nodes: The graph.
        form: The whole.
        x: Terms of inputs, shape ``(n_terms, batch)``.
        memory: Shape ``(n_memory, batch)``.
        moves: Whether lines are moved on; else the memory that is given has the newest number of each alone.
        laid: What is laid before the first group, if it is known.
        moved: The lines moved on by a row, with any numbers for the newest ones, if they are known.
        before: How many other rows lie before the memory, and before the lines that are moved.
        ring: Where in the memory the past is read and the newest numbers are written, where lines are not moved.

    Returns:
        The names.
    """
    pasts = _pasts(nodes, form, memory, ring, first=1 if laid else 0, before=before)
    made: list[_Made] = []
    for g, group in enumerate(form.groups):
        part = nodes.within(f"{nodes.prefix}group{g}_")
        _, inputs, rows = readings_of(form, group)
        pieces = [pasts[g]] if g in pasts else []
        if inputs:
            whole = inputs == [*range(len(form.inputs))]
            pieces.append(x if whole else part.add("Gather", [x, part.integers(inputs)], "inputs", axis=0))
        for other, own in rows:
            held = made[other].held
            pieces.append(
                held if own is None else part.add("Gather", [held, part.integers(own)], f"now{other}", axis=0)
            )
        if laid and not made:
            pieces = [laid]
        make = _equations if group.computes else _group
        made.append(make(part, form, group, pieces, memory))
    raw = join(nodes, [one.raw for one in made], "raw")
    following = _memory(nodes, form, memory, made, moves=moves, moved=moved, before=before, ring=ring)
    if raw == following and moves:  # a loop mixes up what is two of its outputs
        raw = nodes.add("Identity", [raw], "raw_rows")
    return Step(raw=raw, memory=following)


def join(nodes: Nodes, pieces: Sequence[str], name: str) -> str:
    """Pieces one behind the other; no node where there is one."""
    return pieces[0] if len(pieces) == 1 else nodes.add("Concat", pieces, name, axis=0)


def past_rows(form: WideForm) -> dict[int, list[int]]:
    """Which rows of the memory each group reads."""
    return {g: readings_of(form, group)[0] for g, group in enumerate(form.groups) if group.past}


def _pasts(
    nodes: Nodes, form: WideForm, memory: str, ring: tuple[str, str] | None, *, first: int, before: int
) -> dict[int, str]:
    """What each group from the first on reads of the memory: all of it in one gather, then cut."""
    rows = {g: own for g, own in past_rows(form).items() if g >= first}
    whole = [row for own in rows.values() for row in own]
    if not whole:
        return {}
    if ring:
        gathered = nodes.add("Gather", [memory, ring[0]], "past", axis=0)
    else:
        gathered = nodes.rows(memory, [before + row for row in whole], before + len(form.memory), "past")
    names = nodes.cut(gathered, {f"past{g}": len(own) for g, own in rows.items()})
    return dict(zip(rows, names, strict=True))


def _group(nodes: Nodes, form: WideForm, group: Group, pieces: Sequence[str], memory: str) -> _Made:
    """The nodes of a group."""
    tables = _tables(form, group)
    columns, width = columns_of(form, group)
    selection = group.selection(columns, width)
    if not pieces:
        return _constant(nodes, form, group, memory)
    z = join(nodes, pieces, "readings")
    if form.keeps and not np.array_equal(selection, np.eye(len(selection), width + 1)):
        alone = form.exact and tables.keys() & {"upper", "lower"}
        z = (row_by_row if alone else product)(nodes, selection[:-1], z, "terms")
    elif not form.keeps:
        tables = {name: over(table, selection) for name, table in tables.items()}
    parts = exact_parts(nodes, tables, z) if form.exact else parts_of(nodes, tables, z)
    total = parts["linear"]
    if "hidden" in parts:
        hidden = group.neuron.onnx(nodes, parts["hidden"], "hidden")
        if group.gated:
            hidden = nodes.add("Mul", [hidden, parts["gates"]], "behind_gates")
        total = nodes.add("Gemm", [nodes.numbers("readout", group.readout), hidden, total], "rows")
    if group.rectified:
        total = _rectified(nodes, group, total)
    change = total
    if "last" in parts:
        total = nodes.add("Add", [parts["last"], change], "total")
    held, raw = held_rows(nodes, form, group, total, parts)
    return _Made(held=held, raw=raw, total=total, change=change, last=parts.get("last", ""))


def _equations(nodes: Nodes, form: WideForm, group: Group, pieces: Sequence[str], memory: str) -> _Made:
    """The nodes of equations: what they read, row by row, and what they make of it."""
    (block,) = group.blocks
    columns, width = columns_of(form, group)
    terms: list[str] = []
    if pieces:
        places = [columns[one] for one in block.readings]
        terms = terms_of(nodes, block, join(nodes, pieces, "readings"), places, width)
    step = stepped(nodes, block, terms, memory, keeps=form.keeps)
    parts = {}
    for name in ("upper", "lower"):
        table = group.stacked(name)
        if np.isfinite(table[:, -1]).any() or table[:, :-1].any():
            times = row_by_row if form.exact else product
            parts[name] = times(nodes, table, join(nodes, terms, f"{name}_terms"), name)
    held, raw = held_rows(nodes, form, group, step.total, parts)
    return _Made(held=held, raw=raw, total=step.total, change=step.change, last=step.last)


def _tables(form: WideForm, group: Group) -> dict[str, NDArray[np.float64]]:
    """Tables over terms, those that say anything."""
    found = {name: group.stacked(name) for name in ("hidden", "gates", "linear", "last", "upper", "lower")}
    if not len(found["hidden"]):
        del found["hidden"]
    if not group.gated:
        del found["gates"]
    if not form.keeps:
        found["linear"] = found["linear"] + found["last"]
    if not form.keeps or not found["last"].any():
        del found["last"]
    for name in ("upper", "lower"):
        if not np.isfinite(found[name][:, -1]).any():
            del found[name]
    return found


def _rectified(nodes: Nodes, group: Group, total: str) -> str:
    """Outputs as absolute values, states as they are."""
    outputs, *states = nodes.cut(total, _sizes(group))
    return join(nodes, [nodes.add("Abs", [outputs], "absolute"), *states], "rectified")


def _sizes(group: Group) -> dict[str, int]:
    sizes = {"outputs": group.n_outputs, "states": len(group.rows) - group.n_outputs}
    return {name: size for name, size in sizes.items() if size}


def _constant(nodes: Nodes, form: WideForm, group: Group, memory: str) -> _Made:
    """A group that reads nothing: its rows as often as there are cars."""
    tables = {name: table[:, -1] for name, table in _tables(form, group).items()}
    rows = tables["linear"] + tables.get("last", 0.0)
    if "hidden" in tables:
        hidden = group.neuron.value(tables["hidden"])
        rows = rows + group.readout @ (hidden * tables.get("gates", 1.0))
    if group.rectified:
        rows[: group.n_outputs] = np.abs(rows[: group.n_outputs])
    cars = nodes.add("Shape", [memory], "cars", start=1)
    shape = nodes.add("Concat", [nodes.integers([len(rows)]), cars], "shape", axis=0)
    total = nodes.add("Expand", [nodes.column("rows", rows), shape], "total")
    held, raw = held_rows(nodes, form, group, total, {})
    return _Made(held=held, raw=raw, total=total, change=total)


def _memory(
    nodes: Nodes,
    form: WideForm,
    memory: str,
    made: Sequence[_Made],
    *,
    moves: bool,
    moved: str,
    before: int,
    ring: tuple[str, str] | None,
) -> str:
    """What the next step begins with: lines moved on by a sample, states, and what rounding took."""
    counts = [len(group.rows) for group in form.groups]
    starts = np.cumsum([0, *counts])
    row = {channel: int(starts[g]) + at for channel, (g, at) in form.channels.items()}
    held = join(nodes, [one.held for one in made], "held_rows") if form.lines or any(_states(form)) else ""
    pieces: list[str] = []
    scatter: list[int] = []
    if form.lines:
        newest = _newest(nodes, form, held, row, sum(counts))
        if ring:
            return nodes.add("ScatterND", [memory, ring[1], newest], "memory_after")
        pieces, scatter = _moved(nodes, form, memory, newest, moved) if moves else ([newest], [])
    states = [int(starts[g]) + at for g, at in _states(form)]
    if states:
        pieces.append(nodes.add("Gather", [held, nodes.integers(states)], "states_after", axis=0))
    if form.keeps:
        pieces += _remainders(nodes, form, made)
    if not pieces:
        return nodes.add("Identity", [memory], "memory_after")
    following = join(nodes, pieces, "memory_moved")
    if scatter:
        places = nodes.integers(before + np.array(scatter)[:, np.newaxis])
        following = nodes.add("ScatterND", [following, places, newest], "memory_after")
    return following


def _moved(nodes: Nodes, form: WideForm, memory: str, newest: str, moved: str) -> tuple[list[str], list[int]]:
    """All lines moved on by one slice; and the rows that their newest numbers have to be put into after that."""
    shifted = sum(line.length for line in form.lines)
    if shifted == len(form.lines):
        return [newest], []
    firsts = [int(at) for at in np.cumsum([0, *(line.length for line in form.lines)])[:-1]]
    if moved and len(form.lines) > 1:
        return [moved], firsts
    older = nodes.add("Slice", [memory, *(nodes.integers([at]) for at in (0, shifted - 1, 0))], "older")
    if len(form.lines) == 1:
        return [newest, older], []
    first = nodes.add("Slice", [newest, *(nodes.integers([at]) for at in (0, 1, 0))], "newest_first")
    return [first, older], firsts


def _states(form: WideForm) -> list[tuple[int, int]]:
    return [(g, at) for g, group in enumerate(form.groups) for at in range(group.n_outputs, len(group.rows))]


def _newest(nodes: Nodes, form: WideForm, held: str, row: dict[int, int], count: int) -> str:
    """The newest number of every line."""
    lines = form.lines
    rows = [row[line.channel] for line in lines]
    plain = all((line.slope, line.shift) == (1.0, 0.0) for line in lines)
    if plain and rows == [*range(count)]:
        return held
    if plain or form.exact or len(lines) * count > PRODUCT:
        newest = nodes.add("Gather", [held, nodes.integers(rows)], "newest", axis=0)
        if plain:
            return newest
        sloped = nodes.add("Mul", [newest, nodes.column("line_slope", [line.slope for line in lines])], "newest_sloped")
        return nodes.add("Add", [sloped, nodes.column("line_shift", [line.shift for line in lines])], "newest_scaled")
    table = np.zeros((len(lines), count + 1))
    for i, line in enumerate(lines):
        table[i, rows[i]], table[i, -1] = line.slope, line.shift
    return product(nodes, table, held, "newest")


def _remainders(nodes: Nodes, form: WideForm, made: Sequence[_Made]) -> list[str]:
    """What rounding took from every sum, all at once."""
    groups = [g for g, group in enumerate(form.groups) if form.remainders(group)]
    if not groups:
        return []
    change, last, total = (
        join(nodes, [getattr(made[g], name) for g in groups], f"all_{name}") for name in ("change", "last", "total")
    )
    lost = nodes.add("Sub", [change, nodes.add("Sub", [total, last], "moved")], "lost")
    own_starts = np.cumsum([0, *(len(form.groups[g].rows) for g in groups)])
    rows = [int(own_starts[i]) + at for i, g in enumerate(groups) for at in form.remainders(form.groups[g])]
    if rows == [*range(int(own_starts[-1]))]:
        return [lost]
    return [nodes.add("Gather", [lost, nodes.integers(rows)], "lost_rows", axis=0)]
