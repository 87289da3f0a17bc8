"""The search for a process model: from the best points of a grid by trust-region steps to the least error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import FitDivergedError
from sysid.estimation.linear.process.problem import Problem
from sysid.estimation.linear.process.starts import Begun, begun_at
from sysid.estimation.results.result import Status
from sysid.models.process.process_type import DEAD_TIME

Array = NDArray[np.float64]

SHORT, LONG = 15, 200
"""Steps from another dead time, and from the best start."""
RACE = ((6, 4), (20, 1))
"""Steps from each start, and how many of them go on."""
TOLERANCE = 1e-11
BETTER = 1e-4
"""What another dead time has to be better by to be taken, in units of twice a log-likelihood."""
AWAY = (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0)
"""Samples from a dead time at which others are tried: between two samples the error may have a minimum of its own."""
SETTLED = 4
"""Times that rows are chosen anew, as the dead times move."""


@dataclass(frozen=True, kw_only=True, eq=False)
class End:
    """Where a search ended.

    Args:
        problem: With the first rows that it ended with.
        theta: The vector.
        loss: Half the sum of squared errors.
        status: Why there.
        curve: Losses from step to step.
    """

    problem: Problem
    theta: Array
    loss: float
    status: Status
    curve: tuple[float, ...]

    @property
    def criterion(self) -> float:
        """What ends on different rows are compared by."""
        return self.problem.criterion(self.loss)


def raced(begun: Sequence[Begun]) -> End:
    """The best of some starts after some steps, each on the rows that its dead times leave.

    Args:
        begun: Starts.

    Returns:
        Where the best one got to.

    Raises:
        FitDivergedError: If none has a finite free run.
    """
    ends: Sequence[End | Begun] = [one for one in begun if np.isfinite(one.loss)]
    for steps, kept in RACE:
        ends = sorted((settled(one, steps) for one in ends), key=lambda one: one.criterion)[:kept]
    if not ends:
        raise FitDivergedError("no start gives a finite free run", remedy="look at the records: sysid inspect")
    assert isinstance(ends[0], End)  # noqa: S101 - the race has rounds
    return ends[0]


def finished(begun: Begun | End) -> End:
    """The least error from the best start.

    Args:
        begun: The start.

    Returns:
        The end, below which no dead time some samples away leads.
    """
    return _in_order(_among_dead_times(settled(begun, LONG)))


def settled(begun: Begun | End, steps: int) -> End:
    """Where the search from a start ends, on rows that go with the dead times that it ends at.

    Args:
        begun: The start.
        steps: How many at most.

    Returns:
        The end.
    """
    problem, theta = begun.problem, begun.theta
    for _ in range(SETTLED):
        found = descended(problem, theta, steps)
        moved = problem.rows_for(problem.values(found.theta))
        if moved.firsts == problem.firsts:
            break
        theta = begun_at(moved, problem.values(found.theta), problem.offset(found.theta)).theta
        problem = moved
    return found


def _dead_times(problem: Problem) -> list[int]:
    return [i for i, (_, name) in enumerate(problem.names) if name == DEAD_TIME]


def _in_order(end: End) -> End:
    """The same end, the time constants of each input falling where nothing was said of any."""
    problem, values = end.problem, end.problem.values(end.theta)
    ordered = values.copy()
    for j in range(len(problem.types)):
        at = [i for i, (of, name) in enumerate(problem.names) if of == j and name.startswith("Tp")]
        if np.isnan(problem.bounds.start[at]).all():
            ordered[at] = np.sort(values[at])[::-1]
    if (ordered == values).all():
        return end
    return settled(begun_at(problem, ordered, problem.offset(end.theta)), LONG)


def descended(problem: Problem, theta: Array, steps: int) -> End:
    """Trust-region steps from a vector.

    Args:
        problem: The problem.
        theta: The vector.
        steps: How many at most.

    Returns:
        Where they end.
    """
    from scipy.optimize import least_squares  # 10 MB that other fits do without

    kept: dict[bytes, tuple[Array, Array]] = {}
    curve: list[float] = []

    def both(x: Array) -> tuple[Array, Array]:
        key = x.tobytes()
        if key not in kept:
            kept.clear()
            with np.errstate(all="ignore"):
                errors, slopes = problem.errors(x)
            finite = np.isfinite(errors).all() and np.isfinite(slopes).all()
            kept[key] = (errors, slopes) if finite else (np.full_like(errors, 1e6), np.zeros_like(slopes))
        return kept[key]

    def jacobian(x: Array) -> Array:
        errors, slopes = both(x)
        curve.append(0.5 * float(errors @ errors))
        return slopes

    low, high = problem.ends
    apart = high > low
    inside = np.where(apart, np.clip(theta, low, np.where(apart, high, np.inf)), theta)
    found = least_squares(
        lambda x: both(x)[0], inside, jacobian, (low, np.where(apart, high, low + 1e-12)), x_scale="jac",
        ftol=TOLERANCE, xtol=TOLERANCE, gtol=TOLERANCE, max_nfev=steps,
    )  # fmt: skip
    status = Status.CONVERGED if found.status > 0 else Status.MAX_ITERATIONS
    return End(problem=problem, theta=found.x, loss=float(found.cost), status=status, curve=(*curve, float(found.cost)))


def _among_dead_times(end: End) -> End:
    """The end, or a better one that others begin from whose dead time is some samples away."""
    best, problem = end, end.problem
    values = problem.values(end.theta)
    for i in _dead_times(problem):
        for away in AWAY * (i in problem.free):
            moved = values.copy()
            moved[i] += away * problem.sample_time
            if problem.bounds.low[i] <= moved[i] <= problem.bounds.high[i]:
                found = settled(begun_at(problem.rows_for(moved), moved, problem.offset(end.theta)), SHORT)
                if found.criterion < best.criterion - BETTER:
                    best = settled(found, LONG)
    return best
