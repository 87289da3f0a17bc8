"""The search for a process model: from the best points of a grid by Levenberg-Marquardt to the least error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.errors import FitDivergedError
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.linear.process.problem import Problem
from sysid.estimation.linear.process.starts import Begun, begun_at
from sysid.estimation.linear.transfer_function.runs import flat_prior
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
class Errors(AbstractProvider):
    """The errors of a problem, as the engine wants them: a run gives its derivatives, too, so that the last is kept.

    Args:
        problem: Records, types and bounds.
    """

    problem: Problem
    kept: dict[bytes, Linearisation] = field(default_factory=dict)

    @property
    def n_samples(self) -> int:  # type: ignore[override]
        """Samples that count."""
        return self.problem.n_counted

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Of the vector."""
        return self.problem.ends

    def loss(self, theta: Array) -> float:
        """Half the sum of squared errors; see the base class."""
        return self.linearise(theta).loss

    @np.errstate(all="ignore")  # a run that explodes has no loss
    def linearise(self, theta: Array, *, correlation: bool = True) -> Linearisation:  # noqa: ARG002 - nobody asks
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        key = theta.tobytes()
        if key not in self.kept:
            self.kept.clear()
            errors, J = self.problem.errors(theta)
            loss = 0.5 * float(errors @ errors)
            loss = loss if np.isfinite(loss) else np.inf
            self.kept[key] = Linearisation(loss=loss, gradient=J.T @ errors, gauss_newton=J.T @ J)
        return self.kept[key]


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
    """Levenberg-Marquardt from a vector.

    Args:
        problem: The problem.
        theta: The vector.
        steps: How many at most.

    Returns:
        Where they end.
    """
    errors = Errors(problem=problem)
    limits = Termination(max_iterations=steps, tolerance=TOLERANCE, patience=2)
    engine = LevenbergMarquardt(termination=limits, evidence_after=None)
    found = engine.minimise_within(errors, np.clip(theta, *errors.bounds), flat_prior(len(theta)))
    # What no step improves stands at a minimum: between two samples the derivative of a dead time jumps.
    ended = found.status in {Status.NOT_IMPROVED, Status.STALLED}
    status = Status.CONVERGED if ended else found.status
    return End(problem=problem, theta=found.theta, loss=found.at.loss, status=status, curve=found.state.losses)


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
