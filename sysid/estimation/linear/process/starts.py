"""Where the search for a process model begins: time constants and dead times over a grid, the rest by least squares.

Given its time constants, damping and dead time a process model is linear in its gain, in the gain times its zero, in
the constant or the level, and in the states before records. So a grid over the former costs one linear problem a point.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.linear.process.problem import LATEST, Problem, ProcessRecord
from sysid.models.process.process_run import ProcessRun, run
from sysid.models.process.process_type import DEAD_TIME, GAIN, ZERO, ProcessType

Array = NDArray[np.float64]

CONSTANTS = 8
"""Time constants of the grid."""
FAST, LONG = 0.5, 0.5
"""The shortest of them in samples, and the longest in lengths of the longest record."""
SHARES = ((1.0, 0.3, 0.1), (1.0, 0.9, 0.8))
"""Further time constants over the first one."""
DAMPINGS = (0.25, 0.8)
KEPT = 12
"""Points of the grid from which a search begins, whose dead times differ."""
NEAR = 0.3
"""Part of a dead time within which another one is no other start."""
LATER = 1.5
"""From one dead time of the grid to the next, beside those that a correlation finds likely."""
ROUNDS = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Begun:
    """A point of the grid.

    Args:
        problem: With the rows that go with its dead times.
        values: All parameters.
        theta: The vector of it.
        loss: Half the sum of squared errors there.
    """

    problem: Problem
    values: Array
    theta: Array
    loss: float

    @property
    def criterion(self) -> float:
        """What points on different rows are compared by."""
        return self.problem.criterion(self.loss)


def starts(problem: Problem, delays: Sequence[Sequence[int]]) -> list[Begun]:
    """Points of the grid with the least error, the best first.

    Args:
        problem: The problem.
        delays: Of each input the likely dead times in samples.

    Returns:
        Up to :data:`KEPT`, and one with what was declared.
    """
    grids = [_grid(problem, kind, own) for kind, own in zip(problem.types, delays, strict=True)]
    chosen = [grid[len(grid) // 2] for grid in grids]
    found: list[_Point] = []
    for _ in range(1 if len(grids) == 1 else ROUNDS):
        for j, grid in enumerate(grids):
            points = [[*chosen[:j], point, *chosen[j + 1 :]] for point in grid]
            tried = [_point(problem, np.concatenate(point)) for point in points]
            chosen = points[int(np.argmin([one.criterion for one in tried]))]
            found += tried
    ordered = [one.begun for one in _apart(sorted(found, key=lambda one: one.criterion))]
    said = ~np.isnan(problem.bounds.start) & ~problem.bounds.fixed
    if said.any():
        values = np.where(said, problem.bounds.start, ordered[0].values)
        ordered.append(_Point(problem=problem.rows_for(values), values=values, offset=0.0, criterion=0.0).begun)
    return ordered


@dataclass(frozen=True, kw_only=True, eq=False)
class _Point:
    """A point of the grid, before the states of its records are found."""

    problem: Problem
    values: Array
    offset: float
    criterion: float

    @property
    def begun(self) -> Begun:
        """It as a start."""
        return begun_at(self.problem, self.values, self.offset)


def _apart(ordered: Sequence[_Point]) -> list[_Point]:
    """The best points, each with dead times of its own."""
    found: list[_Point] = []
    for one in ordered:
        dead = [i for i, (_, name) in enumerate(one.problem.names) if name == DEAD_TIME]
        late = one.values[dead]
        near = np.maximum(one.problem.sample_time, NEAR * late)
        if all((np.abs(late - other.values[dead]) > near).any() for other in found if dead):
            found.append(one)
        if len(found) == KEPT:
            break
    return found


def _grid(problem: Problem, kind: ProcessType, delays: Sequence[int]) -> list[Array]:
    """Parameters of one input, the gain 1 and the zero 0."""
    T, longest = problem.sample_time, max(len(record.target) for record in problem.records)
    constants = T * np.geomspace(FAST, max(LONG * longest, 2.0 * FAST), CONSTANTS)
    most = longest / LATEST
    others = {round(LATER**i) for i in range(int(np.log(max(most, 1.0)) / np.log(LATER)) + 1)}
    dead = sorted({T * k for k in {0, *others, *delays}}) if kind.dead else [0.0]
    lags = list(range(len(kind.constants)))
    if kind.swings:
        shapes = [(1.0, damping, *SHARES[0][1 : len(lags) - 1]) for damping in DAMPINGS]
    else:
        shapes = [shares[: len(lags)] for shares in SHARES[: 1 + (len(lags) > 1)]]
    found = []
    for constant, shape, late in itertools.product(constants if lags else [1.0], shapes, dead):
        own = {GAIN: 1.0, ZERO: 0.0, DEAD_TIME: late}
        for name, share in zip(kind.constants, shape, strict=False):
            own[name] = share if name == "zeta" else share * constant
        found.append(np.array([own[name] for name in kind.names]))
    return found


def _point(problem: Problem, values: Array) -> _Point:
    """The point with gains, zeros, constant and states of least error, brought between its bounds."""
    gains = [i for i, (_, name) in enumerate(problem.names) if name == GAIN]
    values = values.copy()
    values[gains] = 1.0
    own = problem.bounds.within(values)
    own[gains] = 1.0
    for i, (_, name) in enumerate(problem.names):
        if name == ZERO:
            own[i] = 0.0
    problem = problem.rows_for(own)
    found, loss = _solved([_table(problem, record, own) for record in problem.records])
    at = 0
    for j, kind in enumerate(problem.types):
        i = gains[j]
        own[i] = found[at] or 1e-6
        if kind.zero:
            own[i + kind.names.index(ZERO)] = found[at + 1] / own[i]
        at += 1 + kind.zero
    offset = float(found[at]) if problem.constant else 0.0
    if problem.levelled is not None:
        offset /= own[gains[problem.levelled]]
    criterion = problem.criterion(loss) if np.isfinite(loss) else np.inf
    return _Point(problem=problem, values=problem.bounds.within(own), offset=offset, criterion=criterion)


def _table(problem: Problem, record: ProcessRecord, values: Array) -> tuple[Array, Array, Array]:
    """Columns of what is linear, those of the state before the record, and the output."""
    columns: list[Array] = []
    begun: list[Array] = []
    for j, (kind, own) in enumerate(zip(problem.types, problem.each(values), strict=True)):
        state = np.zeros(kind.order) if record.free else None
        one: ProcessRun = run(
            kind, own, record.inputs[:, j], record.past[j], problem.sample_time, first=record.first, state=state
        )
        columns.append(one.output)
        if kind.zero:
            columns.append(one.slopes[:, kind.names.index(ZERO)])
        begun.append(one.beginnings)
    if problem.constant:
        columns.append(problem.ramp(record, values))
    roots = record.roots[record.first :, np.newaxis]
    states = np.concatenate(begun, axis=1) if record.free else np.zeros((len(roots), 0))
    return np.column_stack(columns) * roots, states * roots, record.target[record.first :] * roots[:, 0]


def _solved(tables: Sequence[tuple[Array, Array, Array]]) -> tuple[Array, float]:
    left, right = [], []
    for columns, states, target in tables:
        Q = np.linalg.qr(states / np.maximum(np.linalg.norm(states, axis=0), 1e-300))[0]
        left.append(columns - Q @ (Q.T @ columns))
        right.append(target - Q @ (Q.T @ target))
    table, target = np.concatenate(left), np.concatenate(right)
    sizes = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
    if not np.isfinite(table).all():
        return np.zeros(table.shape[1]), np.inf
    found = np.linalg.lstsq(table / sizes, target, rcond=1e-10)[0] / sizes
    errors = target - table @ found
    return found, 0.5 * float(errors @ errors)


def begun_at(problem: Problem, values: Array, offset: float) -> Begun:
    """A point with the states of least error before each record.

    Args:
        problem: The problem.
        values: All parameters.
        offset: The constant, or the level.

    Returns:
        The point.
    """
    none = [np.zeros(problem.order) for record in problem.records if record.free]
    theta = problem.theta(values, offset, none)
    errors, slopes = problem.errors(theta)
    row, at = 0, len(problem.free) + problem.n_offsets
    for record in problem.records:
        rows = slice(row, row + len(record.target) - record.first)
        row = rows.stop
        if record.free:
            own = slice(at, at + problem.order)
            table = slopes[rows, own]
            sizes = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
            theta[own] = -np.linalg.lstsq(table / sizes, errors[rows], rcond=1e-10)[0] / sizes
            errors[rows] += table @ theta[own]
            at += problem.order
    loss = 0.5 * float(errors @ errors)
    return Begun(problem=problem, values=values, theta=theta, loss=loss if np.isfinite(loss) else np.inf)
