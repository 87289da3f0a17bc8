"""The derivatives of a graph's values as values of the same graph: what an implicit step needs in every target.

Only what a step is made with: a derivative through a switch is left out, that of a table goes smoothly from piece to
piece, and at a kink it is that of one side. The method of :mod:`sysid.equations.implicit` keeps its order with any
matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from sysid.equations.graph import OPERATION, Graph
from sysid.kernels import register_machine as machine

TINY = 1e-12
"""What is divided by at least, where an argument may be 0."""

STEEP = 1e15
"""What makes of a difference a condition: from 1 on where it is not below 0, to 0 and below where it is."""

Column = dict[int, int]
"""By a value that moves how much, as a value."""


def jacobian(
    graph: Graph, results: Sequence[int], leaves: Sequence[int], slope_of_table: Callable[[int], int]
) -> list[dict[int, int]]:
    """How some values move with some leaves.

    Args:
        graph: The graph.
        results: The values.
        leaves: The leaves.
        slope_of_table: From a table the table of its slope.

    Returns:
        Of each value, by place among the leaves, the derivative; what is 0 for certain is left out.
    """
    columns: list[Column] = []
    needed = graph.needed(results)
    local: dict[int, list[tuple[int, int]]] = {}
    for leaf in leaves:
        moves: Column = {leaf: graph.constant(1.0)}
        for node in needed:
            value = graph.nodes[node]
            if value.kind != OPERATION or not any(one in moves for one in value.reads):
                continue
            if node not in local:
                local[node] = _slopes(graph, node, slope_of_table)
            total: int | None = None
            for read, slope in local[node]:
                if read in moves and graph.value_of(slope) != 0.0:
                    part = graph.apply(machine.MUL, slope, moves[read])
                    total = part if total is None else graph.apply(machine.ADD, total, part)
            if total is not None:
                moves[node] = total
        columns.append(moves)
    return [{j: moves[one] for j, moves in enumerate(columns) if one in moves} for one in results]


def _slopes(graph: Graph, node: int, slope_of_table: Callable[[int], int]) -> list[tuple[int, int]]:
    """What an operation reads, and its derivative by each."""
    value = graph.nodes[node]
    if value.place == machine.TABLE:
        (a,) = value.reads
        return [(a, graph.apply(machine.TABLE, a, own=slope_of_table(value.own)))]
    rule = _RULES.get(value.place)
    return [] if rule is None else list(zip(value.reads, rule(graph, node, *value.reads), strict=False))


def _over(graph: Graph, above: int, below: int) -> int:
    """A quotient by what is not below 0, kept finite there."""
    return graph.apply(machine.DIV, above, graph.apply(machine.MAX, below, graph.constant(TINY)))


def _choice(graph: Graph, greater: int, less: int) -> tuple[int, int]:
    """1 for the one that is not less than the other, and 0 for that."""
    away = graph.apply(machine.SUB, greater, less)
    condition = graph.apply(machine.FMA, graph.constant(STEEP), away, graph.constant(1.0))
    one, nothing = graph.constant(1.0), graph.constant(0.0)
    return (
        graph.apply(machine.SELECT, condition, one, nothing),
        graph.apply(machine.SELECT, condition, nothing, one),
    )


def _one_minus_square(graph: Graph, r: int, _: int) -> tuple[int, ...]:
    return (graph.apply(machine.SUB, graph.constant(1.0), graph.apply(machine.MUL, r, r)),)


def _power(graph: Graph, r: int, a: int, b: int) -> tuple[int, ...]:
    """By the base, and by the exponent where the base is above 0."""
    power = graph.value_of(b)
    if power is None or 0.0 < power < 1.0:
        by_base = graph.apply(machine.MUL, b, _over(graph, r, a))
    else:
        by_base = graph.apply(machine.MUL, b, graph.apply(machine.POW, a, graph.constant(power - 1.0)))
    if power is not None:
        return (by_base,)
    log = graph.apply(machine.LOG, graph.apply(machine.MAX, a, graph.constant(TINY)))
    return by_base, graph.apply(machine.MUL, r, log)


def _select(graph: Graph, _: int, a: int, yes: int, no: int) -> tuple[int, ...]:
    del yes, no
    one, nothing = graph.constant(1.0), graph.constant(0.0)
    return (
        nothing,
        graph.apply(machine.SELECT, a, one, nothing),
        graph.apply(machine.SELECT, a, nothing, one),
    )


_RULES: dict[int, Callable[..., tuple[int, ...]]] = {
    machine.ADD: lambda g, _r, _a, _b: (g.constant(1.0), g.constant(1.0)),
    machine.SUB: lambda g, _r, _a, _b: (g.constant(1.0), g.constant(-1.0)),
    machine.MUL: lambda _g, _r, a, b: (b, a),
    machine.DIV: lambda g, r, _a, b: (
        g.apply(machine.DIV, g.constant(1.0), b),
        g.apply(machine.NEG, g.apply(machine.DIV, r, b)),
    ),
    machine.NEG: lambda g, _r, _a: (g.constant(-1.0),),
    machine.FMA: lambda g, _r, a, b, _c: (b, a, g.constant(1.0)),
    machine.ABS: lambda g, r, a: (_over(g, a, r),),
    machine.MIN: lambda g, _r, a, b: _choice(g, b, a),
    machine.MAX: lambda g, _r, a, b: _choice(g, a, b),
    machine.SQRT: lambda g, r, a: (g.apply(machine.MUL, g.constant(0.5), _over(g, r, a)),),
    machine.EXP: lambda _g, r, _a: (r,),
    machine.LOG: lambda g, _r, a: (g.apply(machine.DIV, g.constant(1.0), a),),
    machine.TANH: _one_minus_square,
    machine.SIN: lambda g, _r, a: (g.apply(machine.COS, a),),
    machine.COS: lambda g, _r, a: (g.apply(machine.NEG, g.apply(machine.SIN, a)),),
    machine.ATAN: lambda g, _r, a: (
        g.apply(machine.DIV, g.constant(1.0), g.apply(machine.FMA, a, a, g.constant(1.0))),
    ),
    machine.POW: _power,
    machine.SELECT: _select,
}
"""By operation its derivatives, of the graph, the result and what is read. Switches have none."""


def slopes_of(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """The slope of a table as a table: that of each piece in its middle, 0 at the ends and beyond."""
    between = [((x + x_) / 2.0, (y_ - y) / (x_ - x)) for (x, y), (x_, y_) in pairwise(points)]
    return ((points[0][0], 0.0), *between, (points[-1][0], 0.0))
