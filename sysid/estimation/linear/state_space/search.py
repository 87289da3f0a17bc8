"""The search for a state space: with and without bounds of its poles, from subspace estimates on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sysid.errors import FitDivergedError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.segments import Segment, torn
from sysid.estimation.linear.state_space.free_runs import free_run_error
from sysid.estimation.linear.state_space.integrators import held_at_one
from sysid.estimation.linear.state_space.refinement import Found, Level, Problem, size_of
from sysid.estimation.linear.state_space.slower import slower_start
from sysid.estimation.linear.state_space.training import BEST, METHODS, StateSpaceTraining
from sysid.estimation.linear.subspace.projections import Weighting
from sysid.estimation.linear.subspace.starts import Subspace
from sysid.models import LinearStateSpace
from sysid.models.linear.innovations import Innovations

WORTH = 0.5
"""How much larger, as a logarithm, errors may be without a model of the noise for one to be begun there."""
TOUCHING = 1e-9
"""How far within the largest magnitude poles are brought that lie beyond it."""
QUICK = 4
"""Steps after which dead times are compared, from one subspace estimate: that which feedback does not bias."""


def search(
    segments: Sequence[Segment], orders: LinearStateSpace, training: StateSpaceTraining, zero: Level | None = None
) -> Found:
    """Find the state space of some records.

    Args:
        segments: The records, in scaled numbers, of one output or several.
        orders: The structure.
        training: How.
        zero: What is zero of each input, in scaled numbers, for poles that may be those of integrators; ``None`` where
            none is held at 1.

    Returns:
        What was found.

    Raises:
        TraceError: If no record is long enough.
        FitDivergedError: If no start gives a finite prediction.
    """
    began, whole = now(), _whole(segments, orders)
    with one_blas_thread():
        subspace = Subspace.of(
            segments, states=orders.states, horizon=training.horizon, feedthrough=orders.feedthrough, noise=orders.noise
        )
        stable = not orders.noise if training.stable is None else training.stable
        problem = Problem(segments=whole, orders=orders, stable=stable)
        iterations = training.max_iterations if training.method == METHODS[0] else 0

        def found_in(one: Problem) -> Found:
            until = began + training.max_time_s
            best = one.best(subspace, training.weighting, iterations, until)
            return _from_white(best, one, iterations, until) if orders.noise and iterations else best

        bounded = replace(problem, stable=True, largest=slow_poles.largest_pole(problem.lengths))
        if training.stable is not None or (orders.noise and not iterations):
            found = found_in(problem)
        elif orders.noise:
            found = found_in(problem)
            if slow_poles.unseen(found.system.radius, problem.lengths):
                found = _quieter(found, bounded, found_in)
        else:
            found = found_in(bounded)
            slower = slower_start(bounded, segments) if iterations else None
            if slower is not None and slower[0] < size_of(found.covariance):
                found = _least(found, bounded.refined(slower[1], iterations, began + training.max_time_s - now()))
            if slow_poles.unseen(found.system.radius, problem.lengths):
                beyond = problem.refined(found.system, iterations, began + training.max_time_s - now())
                found = _better(found, _least(found_in(problem), beyond), problem)
        if training.stable is None and iterations and zero and orders.intercept:
            # Without inputs or a constant nothing makes a ramp of them.
            left = began + training.max_time_s - now()
            found, problem = held_at_one(found, problem, zero, iterations=iterations, seconds=left)
        if training.stable is None and iterations:
            found = _brought_in(found, problem, iterations, began + training.max_time_s - now())
        errors = None if orders.noise else problem.around_errors(found.system)
        if iterations:
            found = problem.with_colour(found)
    told = slow_poles.notes(found.system.radius, problem.lengths, errors)
    told = (*told, *(torn(problem.segments, orders.states, records=len(segments)) if orders.noise else ()))
    warned = slow_poles.warnings(found.system.radius, problem.lengths, told)
    return replace(found, singular_values=subspace.singular_values(), notes=told, warnings=warned)


def quick_size(segments: Sequence[Segment], orders: LinearStateSpace, training: StateSpaceTraining) -> float:
    """How large the errors are after a few steps, to compare dead times by.

    Args:
        segments: The records, in scaled numbers.
        orders: The structure.
        training: How.

    Returns:
        The logarithm of the determinant of their covariance.

    Raises:
        TraceError: If no record is long enough.
        FitDivergedError: If no start gives a finite prediction.
    """
    subspace = Subspace.of(
        segments, states=orders.states, horizon=training.horizon, feedthrough=orders.feedthrough, noise=orders.noise
    )
    stable = not orders.noise if training.stable is None else training.stable
    problem = Problem(segments=_whole(segments, orders), orders=orders, stable=stable)
    try:
        system, _ = problem.start(subspace, Weighting.SSARX.value if training.weighting == BEST else training.weighting)
    except FitDivergedError:  # of next to no noise a long ARX model is not determined, and others may be
        system, _ = problem.start(subspace, training.weighting)
    return size_of(problem.refined(system, QUICK, np.inf).covariance)


def around(system: Innovations, segments: Sequence[Segment], orders: LinearStateSpace) -> Found:
    """A system that was found, linearised again on its records.

    Args:
        system: In scaled numbers.
        segments: The records, in scaled numbers.
        orders: The structure.

    Returns:
        What :func:`search` found, but for how it went.
    """
    with one_blas_thread():
        problem = Problem(segments=_whole(segments, orders), orders=orders, stable=False)
        return problem.with_colour(problem.at(system))


def _whole(segments: Sequence[Segment], orders: LinearStateSpace) -> tuple[Segment, ...]:
    """The records that errors are counted on; a filter begins anew after a gap."""
    whole = tuple(piece for segment in segments for piece in segment.pieces()) if orders.noise else tuple(segments)
    return tuple(piece for piece in whole if len(piece) > orders.states)


def _least(found: Found, other: Found) -> Found:
    """The one of less error."""
    better = size_of(other.covariance) < size_of(found.covariance)
    return replace(other, weighting=found.weighting) if better else found


def _better(inside: Found, beyond: Found, problem: Problem) -> Found:
    """What was found with poles up to the edge of stability, if it is better than chance has it."""
    errors, than = (problem.around_errors(one.system) for one in (beyond, inside))
    scale = float(np.mean([np.mean(segment.outputs**2) for segment in problem.segments]))
    size = beyond.chart.n_parameters
    return beyond if slow_poles.significantly_better(errors, than, parameters=size, scale=scale) else inside


def _brought_in(found: Found, problem: Problem, iterations: int, seconds: float) -> Found:
    """A system that hardly grows within a record, with its poles inside where that is as good but for chance.

    So of one that swings undamped: beyond its record it would grow beyond all numbers.
    """
    beyond = found.system.radius - 1.0
    if problem.sums or problem.stable or not 0.0 < beyond <= slow_poles.REACH / max(problem.lengths):
        return found
    inside = replace(problem, stable=True)
    # All poles by the same small part: mirrored, a pair would begin further off than steps bring back.
    just = replace(found.system, A=found.system.A * (inside.largest * (1.0 - TOUCHING) / found.system.radius))
    begun = inside.with_inputs(just)
    if begun is None:
        return found
    other = inside.refined(begun[1], iterations, seconds)
    errors, than = (problem.around_errors(one.system) for one in (found, other))
    scale = float(np.mean([np.mean(segment.outputs**2) for segment in problem.segments]))
    if slow_poles.significantly_better(errors, than, parameters=0, scale=scale):
        return found
    return replace(other, weighting=found.weighting)


def _from_white(found: Found, problem: Problem, iterations: int, until: float) -> Found:
    """What was found with a model of the noise, or what is nearer from where there is none.

    White noise of a sensor is the commonest, and a gain of zeros says it; from the gain of a subspace estimate the
    steps may end in a minimum that takes the noise for dynamics.
    """
    white = replace(problem, orders=replace(problem.orders, noise=False), stable=True)
    steady = found.system.steady()  # balanced for a predictor that forgets at once, a free run has no digits left
    system = found.system if steady is None else found.system.in_coordinates(*steady)
    try:
        with np.errstate(all="ignore"):
            begun = white.with_inputs(system.without_noise())
        if begun is None:
            return found
        still = white.refined(begun[1], iterations, until - now())
        if size_of(still.covariance) > size_of(found.covariance) + WORTH:
            return found
        other = problem.refined(still.system, iterations, until - now())
    except np.linalg.LinAlgError:  # a run from there is not finite
        return found
    return _least(found, other)


def _quieter(beyond: Found, bounded: Problem, found_in: Callable[[Problem], Found]) -> Found:
    """What was found with a model of the noise, unless poles that the records can show do as well.

    A state that only innovations drive takes a drift for its own: one step ahead that helps a little, and its free run
    is lost. It is left where what is found without it is no worse but for chance, and its free run no worse either.
    """
    try:
        inside = found_in(bounded)
    except FitDivergedError:
        return beyond
    before, after = (free_run_error(one.system, bounded.segments) for one in (beyond, inside))
    return inside if after <= before and _better(inside, beyond, bounded) is inside else beyond
