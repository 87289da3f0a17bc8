r"""An implicit step of the continuous states, written out as operations: every target runs it as it runs all else.

The method is ROS34PW2 (Rang and Angermann 2005, "New Rosenbrock W-methods of order 3 for partial differential
algebraic equations of index 1", BIT 45): four stages of one linear system each, no iteration, L-stable and stiffly
accurate, of order 3 with any matrix in the place of the Jacobian. With :math:`\gamma`, :math:`a`, :math:`c` and
:math:`m` as Hairer and Wanner 1996 (IV.7) write such methods, and the slopes :math:`w_i`,

.. math:: (I - \gamma h J)\, w_i = \gamma \Big( f\big(x + h \sum_{j<i} a_{ij} w_j\big) + \sum_{j<i} c_{ij} w_j \Big),
    \qquad x' = x + h \sum_i m_i w_i .

Where inputs move between samples the rates hang on time: a stage is :math:`\alpha_i h` later, and
:math:`\gamma_i h\, \partial f / \partial t` joins what stands in brackets (IV.7, equation 7.25).

What is lowered is :math:`\sum_i m_i w_i`, the mean slope over a step: an explicit step of one stage along it is the
whole method. The linear systems are solved by elimination over those entries that are not 0 for certain, without
exchanging rows: at :math:`h \to 0` the matrix is that of no exchange, and whether a step is short enough for that too
is what the comparison with half of it tells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.equations.graph import CONTINUOUS_STATE, SHARE, STEP, Graph
from sysid.equations.slopes import jacobian
from sysid.kernels import register_machine as machine

MOST_STATES_IMPLICIT = 30
"""States with a rate of equations that an implicit step is written out for: some ``n^3`` operations."""

GAMMA = 0.43586652150845899942
ALPHAS = np.array([
    [0.0, 0.0, 0.0, 0.0],
    [0.87173304301691801, 0.0, 0.0, 0.0],
    [0.84457060015369423, -0.11299064236484185, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
])  # fmt: skip
GAMMAS = np.array([
    [GAMMA, 0.0, 0.0, 0.0],
    [-0.87173304301691801, GAMMA, 0.0, 0.0],
    [-0.90338057013044082, 0.054180672388095326, GAMMA, 0.0],
    [0.24212380706095346, -1.2232505839045147, 0.54526025533510214, GAMMA],
])  # fmt: skip
WEIGHTS = np.array([0.24212380706095346, -1.2232505839045147, 1.5452602553351020, GAMMA])
"""The method as its authors write it."""

_INVERSE = np.linalg.inv(GAMMAS)
STAGES, COUPLING, MEAN = ALPHAS @ _INVERSE, np.eye(4) / GAMMA - _INVERSE, WEIGHTS @ _INVERSE
"""``a``, ``c`` and ``m``."""

_NOTHING = 1e-14
"""A coefficient that is 0 but for rounding."""


def implicit_slopes(
    graph: Graph, rates: Sequence[int], slope_of_table: Callable[[int], int], sample_time: float = 1.0
) -> list[int]:
    """The mean slopes of the continuous states over an implicit step.

    Args:
        graph: The graph.
        rates: Of each continuous state.
        slope_of_table: From a table the table of its slope.
        sample_time: Seconds over which the share goes from 0 to 1, where inputs move between samples.

    Returns:
        The slopes, in the states' order.
    """
    n = len(rates)
    x, step = [graph.leaf(CONTINUOUS_STATE, i) for i in range(n)], graph.leaf(STEP, 0)
    by_leaf = jacobian(graph, rates, [*x, graph.leaf(SHARE, 0)], slope_of_table)
    by_share = [row.pop(n, None) for row in by_leaf]
    system = _Eliminated(graph, by_leaf)
    shares = graph.apply(machine.MUL, step, graph.constant(1.0 / sample_time))
    slopes: list[list[int]] = []
    for i in range(len(MEAN)):
        ahead = [_combined(graph, STAGES[i, :i], [one[j] for one in slopes]) for j in range(n)]
        moved = {
            x[j]: graph.apply(machine.FMA, step, along, x[j]) for j, along in enumerate(ahead) if along is not None
        }
        moved |= _later(graph, shares, float(ALPHAS[i].sum()))
        here = graph.replaced(rates, moved)
        right = []
        for j in range(n):
            coupled = _combined(graph, COUPLING[i, :i], [one[j] for one in slopes])
            total = here[j] if coupled is None else graph.apply(machine.ADD, here[j], coupled)
            if (moves := by_share[j]) is not None:
                drifts = graph.apply(machine.MUL, graph.constant(float(GAMMAS[i].sum())), shares)
                total = graph.apply(machine.FMA, drifts, moves, total)
            right.append(graph.apply(machine.MUL, graph.constant(GAMMA), total))
        slopes.append(system.solved(right))
    found = [_combined(graph, MEAN, [one[j] for one in slopes]) for j in range(n)]
    return [graph.constant(0.0) if one is None else one for one in found]


def _later(graph: Graph, shares: int, part: float) -> dict[int, int]:
    """The share that lies behind, some part of a step later."""
    if not part:
        return {}
    share = graph.leaf(SHARE, 0)
    return {share: graph.apply(machine.FMA, graph.constant(part), shares, share)}


def _combined(graph: Graph, weights: NDArray[np.float64], values: Sequence[int]) -> int | None:
    """A weighted sum; ``None`` of nothing."""
    total: int | None = None
    for weight, value in zip(weights, values, strict=True):
        if abs(weight) > _NOTHING:
            part = graph.apply(machine.MUL, graph.constant(float(weight)), value)
            total = part if total is None else graph.apply(machine.ADD, total, part)
    return total


class _Eliminated:
    """``I - gamma h J`` in triangles.

    Args:
        graph: The graph.
        rows: Of the Jacobian, the entries that may not be 0.
    """

    def __init__(self, graph: Graph, rows: Sequence[dict[int, int]]) -> None:
        self.graph, self.n = graph, len(rows)
        reach = graph.apply(machine.MUL, graph.constant(-GAMMA), graph.leaf(STEP, 0))
        self.rows = [{j: graph.apply(machine.MUL, reach, one) for j, one in row.items()} for row in rows]
        for i, row in enumerate(self.rows):
            one = graph.constant(1.0)
            row[i] = graph.apply(machine.ADD, row[i], one) if i in row else one
        self.factors: list[list[tuple[int, int]]] = [[] for _ in rows]
        for k in range(self.n):
            for i in range(k + 1, self.n):
                if k in self.rows[i]:
                    self._without(i, k)

    def _without(self, i: int, k: int) -> None:
        """Take a multiple of one row from another, so that its entry there is 0."""
        graph, row = self.graph, self.rows[i]
        factor = graph.apply(machine.NEG, graph.apply(machine.DIV, row.pop(k), self.rows[k][k]))
        self.factors[i].append((k, factor))
        for j, value in self.rows[k].items():
            if j > k:
                part = graph.apply(machine.MUL, factor, value)
                row[j] = graph.apply(machine.ADD, part, row[j]) if j in row else part

    def solved(self, right: Sequence[int]) -> list[int]:
        """The solution for a right side."""
        graph, found = self.graph, list(right)
        for i in range(self.n):
            for k, factor in self.factors[i]:
                found[i] = graph.apply(machine.FMA, factor, found[k], found[i])
        for i in reversed(range(self.n)):
            for j, value in self.rows[i].items():
                if j > i:
                    found[i] = graph.apply(machine.SUB, found[i], graph.apply(machine.MUL, value, found[j]))
            found[i] = graph.apply(machine.DIV, found[i], self.rows[i][i])
        return found
