"""Equations as ONNX nodes: each value a row over cars; steps of the solver in a loop where there are several."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from onnx import TensorProto, helper

from sysid.export.forms.programs import INPUT, STATE, Listing, ProgramForm, Read
from sysid.export.onnx.nodes import Nodes
from sysid.export.wide.blocks import Block

Given = tuple[Sequence[str], Sequence[str]]
"""Rows of states, and of what the programs read of inputs."""


@dataclass(frozen=True, kw_only=True)
class Stepped:
    """Names of what a step of equations gives.

    Args:
        total: Rows of outputs, then of states.
        change: What was added to them, where that is kept: in float32.
        last: What it was added to.
    """

    total: str
    change: str
    last: str


def terms_of(nodes: Nodes, block: Block, readings: str, columns: Sequence[int], width: int) -> list[str]:
    """What equations read, a row each: states, inputs, what rounding took, limits.

    Taken one by one: in a product a number that is not one would be in all of them.

    Args:
        nodes: The graph.
        block: The equations.
        readings: What is laid before them, ``width`` rows.
        columns: Where each reading of the block stands in it.
        width: See ``readings``.

    Returns:
        Names, each of shape ``(1, batch)``.
    """
    rows = nodes.cut(readings, {f"reading{i}": 1 for i in range(width)})
    found = []
    for i, (weights, shift) in enumerate(zip(block.selection, block.shift, strict=True)):
        total = ""
        for at in np.flatnonzero(weights).tolist():
            part = rows[columns[at]]
            if weights[at] != 1.0:
                part = nodes.add("Mul", [part, nodes.numbers(f"weight{i}_{at}", weights[at])], f"part{i}_{at}")
            total = part if not total else nodes.add("Add", [total, part], f"term{i}_{at}")
        if shift:
            total = nodes.add("Add", [total, nodes.numbers(f"shift{i}", shift)], f"term{i}")
        found.append(total)
    return found


def stepped(nodes: Nodes, block: Block, terms: Sequence[str], memory: str, *, keeps: bool) -> Stepped:
    """Add one step.

    Args:
        nodes: The graph.
        block: The equations.
        terms: From :func:`terms_of`.
        memory: Anything with cars along its last axis.
        keeps: Whether what rounding takes from sums is kept.

    Returns:
        The names.
    """
    form = block.stage.equations[0]
    n = form.n_state
    x, u = list(terms[:n]), list(terms[n : n + len(form.given)])
    kept = list(terms[n + len(form.given) : n + len(form.given) + n]) if keeps else []
    cars = _Rows(nodes, memory)
    if not n:
        y = cars.joined(_listed(nodes, form.outputs, (x, u), "y"), "y")
        return Stepped(total=y, change=y, last=y)
    before = join_rows(nodes, x, "x")
    total = nodes.add("ReduceSum", [before, nodes.integers([0])], "sum_of_states", keepdims=1)
    lost = nodes.add("Sub", [total, total], "lost")  # nothing, or not a number
    parts: list[str] = []
    changes: list[str] = []
    lasts: list[str] = []
    n_c = form.n_continuous
    if n_c:
        moved = _moved(nodes, form, (x, u), cars, lost)
        if kept:
            moved = nodes.add("Add", [moved, join_rows(nodes, kept[:n_c], "kept")], "moved_and_kept")
        begun = join_rows(nodes, x[:n_c], "begun")
        parts.append(nodes.add("Add", [begun, moved], "gone_on"))
        changes.append(moved)
        lasts.append(begun)
    if n > n_c:
        after = nodes.add(
            "Add", [cars.joined(_listed(nodes, form.updates, (x, u), "g"), "after"), lost], "after_or_lost"
        )
        parts.append(after)
        changes.append(nodes.add("Sub", [after, after], "nothing"))
        lasts.append(after)
    seen = nodes.cut(join_rows(nodes, parts, "reached"), {f"x_reached{i}": 1 for i in range(n)}) if form.ahead else x
    y = nodes.add("Add", [cars.joined(_listed(nodes, form.outputs, (seen, u), "y"), "y"), lost], "y_or_lost")
    parts, changes, lasts = [y, *parts], [y, *changes], [y, *lasts]
    found = (join_rows(nodes, one, name) for one, name in ((parts, "total"), (changes, "change"), (lasts, "last")))
    return Stepped(total=next(found), change=next(found) if keeps else "", last=next(found) if keeps else "")


def join_rows(nodes: Nodes, rows: Sequence[str], name: str) -> str:
    """Rows one behind the other; no node where there is one."""
    return rows[0] if len(rows) == 1 else nodes.add("Concat", rows, f"{name}_rows", axis=0)


class _Rows:
    """Makes rows of numbers, as often as there are cars.

    Args:
        nodes: The graph.
        memory: Anything with cars along its last axis.
    """

    def __init__(self, nodes: Nodes, memory: str) -> None:
        self.nodes, self.memory, self.shape = nodes, memory, ""

    def joined(self, values: Sequence[tuple[str, bool]], name: str) -> str:
        """Values one behind the other, those that are numbers as rows."""
        return join_rows(self.nodes, [one if row else self._row(one, f"{name}{i}") for i, (one, row) in
                                      enumerate(values)], name)  # fmt: skip

    def _row(self, number: str, name: str) -> str:
        if not self.shape:
            cars = self.nodes.add("Shape", [self.memory], "cars", start=1)
            self.shape = self.nodes.add("Concat", [self.nodes.integers([1]), cars], "row_shape", axis=0)
        return self.nodes.add("Expand", [number, self.shape], f"{name}_row")


def _moved(nodes: Nodes, form: ProgramForm, given: Given, cars: _Rows, lost: str) -> str:
    """What the states with a rate move by over a sample."""
    n_c = form.n_continuous
    if form.substeps == 1:
        return nodes.add("Add", [_substep(nodes, form, given, cars.memory), lost], "moved")
    body = Nodes(nodes.dtype, f"{nodes.prefix}substep_")
    inner, on = f"{body.prefix}moved_in", f"{body.prefix}goes_on_in"
    turn = body.add("Cast", [f"{body.prefix}turn"], "turn_real", to=body.kind()) if form.ahead else ""
    moved = body.add("Add", [inner, _substep(body, form, given, cars.memory, (inner, turn))], "moved_out")
    goes_on = body.add("Identity", [on], "goes_on_out")
    graph = body.graph(
        "substep",
        [
            helper.make_tensor_value_info(f"{body.prefix}turn", TensorProto.INT64, []),
            helper.make_tensor_value_info(on, TensorProto.BOOL, []),
            body.value("moved_in", [n_c, "batch"]),
        ],
        [
            helper.make_tensor_value_info(goes_on, TensorProto.BOOL, []),
            body.value(moved.removeprefix(body.prefix), [n_c, "batch"]),
        ],
    )
    begin = nodes.add("Expand", [lost, nodes.integers([n_c, 1])], "moved_before")
    turns = nodes.add("Squeeze", [nodes.integers([form.substeps])], "substeps")
    made = f"{nodes.prefix}moved"
    nodes.nodes.append(
        helper.make_node("Loop", [turns, "", begin], [made], name=f"{nodes.prefix}substeps_loop", body=graph)
    )
    return made


def _substep(nodes: Nodes, form: ProgramForm, given: Given, memory: str, before: tuple[str, str] = ("", "")) -> str:
    """What one step of the solver adds, behind what those before added and their number, where there are several."""
    (moved, turn), n_c, (x, u) = before, form.n_continuous, given
    begun = join_rows(nodes, x[:n_c], "begun_here")
    if moved:
        begun = nodes.add("Add", [begun, moved], "here")
    at, total = begun, ""
    for part, (share, ahead, behind) in enumerate(form.stages):
        own = nodes.within(f"{nodes.prefix}part{part}_")
        states = [*own.cut(at, {f"x{i}": 1 for i in range(n_c)}), *x[n_c:]]
        way = _share(own, form, behind, turn) if form.ahead else ""
        slope = _Rows(own, memory).joined(_listed(own, form.slopes, (states, u), "f", way), "slope")
        counted = own.add("Mul", [slope, own.numbers("counts", share * form.step)], "counted")
        total = counted if not total else own.add("Add", [total, counted], "total")
        if ahead:
            step = own.add("Mul", [slope, own.numbers("ahead", ahead)], "step")
            at = own.add("Add", [begun, step], "at")
    return total


def _share(nodes: Nodes, form: ProgramForm, behind: float, turn: str) -> str:
    """How much of the way from sample to sample lies behind a stage, as a number."""
    begun = nodes.numbers("behind", behind / form.substeps)
    if not turn:
        return begun
    whole = nodes.add("Mul", [turn, nodes.numbers("of_substeps", 1.0 / form.substeps)], "whole_steps")
    return nodes.add("Add", [whole, begun], "share")


def _listed(nodes: Nodes, listing: Listing, rows: Given, name: str, share: str = "") -> list[tuple[str, bool]]:
    """The results of a listing, and whether each is a row: a number is none."""
    values: list[tuple[str, bool]] = []
    x, u = ([(one, True) for one in side] for side in rows)
    given: dict[str, Sequence[Any]] = {STATE: x, INPUT: [*u, (share, False)]}

    def read(one: Read) -> tuple[str, bool]:
        if isinstance(one, float):
            digest = hashlib.sha256(repr(one).encode()).hexdigest()[:12]
            return nodes.numbers(f"number_{digest}", one), False
        found: tuple[str, bool] = given.get(one.kind, values)[one.at]
        return found

    for at, one in enumerate(listing.instructions):
        reads = [read(place) for place in one.reads]
        points = (one.points,) if one.points else ()
        made = one.operation.onnx(nodes, f"{name}{at}", *(value for value, _ in reads), *points)
        values.append((made, any(row for _, row in reads)))
    return [read(one) for one in listing.results]
