"""Poles at 1 of a state space: those that the records do not tell from an integrator are held there.

A pole that is a little off 1 has an equilibrium, as far away as it is near: with a state before the record of its own
it makes a ramp that no input does, and a run from rest is lost. What is done with the poles of transfer functions
(:mod:`sysid.estimation.linear.transfer_function.integrators`) is done here with those of a matrix. In coordinates in
which the sums stand first, apart from the other states, they are held as entries that are no parameters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.coordinates import Chart
from sysid.estimation.linear.state_space.free_runs import free_run_error
from sysid.estimation.linear.state_space.refinement import Found, Level, Problem, size_of
from sysid.estimation.linear.subspace.system import foreseeing
from sysid.estimation.linear.transfer_function.integrators import TOGETHER
from sysid.models.linear.innovations import Innovations

Array = NDArray[np.float64]

LEVELS = 3
"""Times that the level of the inputs and the least error from there are found in turn."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Held:
    """What was found with poles at 1.

    Args:
        found: The system, of inputs counted from the level.
        problem: The records, with such inputs and begun anywhere: what adds up has no equilibrium.
    """

    found: Found
    problem: Problem

    @property
    def errors(self) -> list[Array]:
        """Of each record."""
        return self.problem.around_errors(self.found.system)


def held_at_one(
    found: Found, problem: Problem, zero: Level, *, iterations: int, seconds: float
) -> tuple[Found, Problem]:
    """What is found with as many poles at 1 as the records do not tell from there.

    Args:
        found: With poles anywhere.
        problem: The records.
        zero: What is zero of each input, in scaled numbers.
        iterations: Steps at most.
        seconds: Time for each.

    Returns:
        No worse by more than chance, and the records with inputs from its level; as they were where no pole is near 1,
        or none may be held.
    """
    near = slow_poles.REACH / max(problem.lengths)
    errors, rested = problem.around_errors(found.system), [one for one in problem.segments if one.rest is not None]
    for system, sums in _candidates(found.system, near):
        held = _held(system, replace(problem, stable=False, sums=sums), zero, iterations, seconds)
        if held is None or held.found.level is None:
            continue
        if _refused(errors, held.errors, sums, found, problem):
            continue
        begun = [_counted_from(one, held.found.level) for one in rested]
        if not rested or free_run_error(held.found.system, begun) <= free_run_error(found.system, rested):
            return held.found, held.problem
    return found, problem


def _refused(errors: list[Array], held: list[Array], sums: int, found: Found, problem: Problem) -> bool:
    """Whether poles at 1 are not taken: they are worse beyond chance, or no better than what a record shows whole.

    A pole that is nearly 1 makes a ramp of its beginning, which one at 1 does not: that counts as a parameter. Within
    the bound, where no pole beyond it was worth having, one at 1 has to be: a drift is no integrator.
    """
    scale = _power(problem)
    if found.system.radius <= slow_poles.largest_pole(problem.lengths):
        size = found.chart.n_parameters
        return not slow_poles.significantly_better(held, errors, parameters=size, scale=scale)
    return slow_poles.significantly_better(errors, held, parameters=2 * sums - 1, scale=scale)


def _power(problem: Problem) -> float:
    """Mean square of the outputs."""
    return float(np.mean([np.mean(segment.outputs**2) for segment in problem.segments]))


def _counted_from(segment: Segment, level: Level) -> Segment:
    """A record of inputs from some level, in scaled numbers."""
    rest = None if segment.rest is None else (segment.rest[0] - np.array(level), segment.rest[1])
    return replace(segment, inputs=segment.inputs - np.array(level), rest=rest)


def _candidates(system: Innovations, near: float) -> Iterator[tuple[Innovations, int]]:
    """The system with poles near 1 put there, most of them first, of a pair both or none; and how many they are."""
    away = np.sort(np.abs(system.poles() - 1.0))
    for sums in range(int(np.count_nonzero(away < near)), 0, -1):
        if sums < len(away) and away[sums] <= away[sums - 1] * (1.0 + TOGETHER):
            continue
        first = _sums_first(system, float(away[sums - 1]) * (1.0 + TOGETHER), sums)
        if first is None:
            continue
        alone = replace(first, A=linalg.block_diag(np.eye(sums), first.A[sums:, sums:]))
        if sums <= min(system.n_inputs, system.n_outputs):  # as many as can be driven and read side by side
            yield foreseeing(alone), sums
        if sums > 1:
            chain = np.eye(sums) + np.triu(first.A[:sums, :sums], 1)
            yield foreseeing(replace(alone, A=linalg.block_diag(chain, first.A[sums:, sums:]))), sums


def _sums_first(system: Innovations, reach: float, sums: int) -> Innovations | None:
    """The system in coordinates whose first states have the poles within reach of 1, and are apart from the others.

    None where rounding mixes them up.
    """
    own = np.eye(system.n_state)
    try:
        T, Z, count = linalg.schur(
            system.A, output="real", sort=lambda re, im=0.0: bool(abs(re + 1j * im - 1.0) <= reach)
        )
        own[:sums, sums:] = linalg.solve_sylvester(T[:sums, :sums], -T[sums:, sums:], -T[:sums, sums:])
    except np.linalg.LinAlgError:
        return None
    if count != sums or not np.isfinite(own).all():
        return None
    moved = system.in_coordinates(linalg.solve_triangular(own, Z.T, unit_diagonal=True), Z @ own)
    first = moved.A[:sums, :sums]
    if np.abs(np.tril(first, -1)).sum() <= np.abs(np.triu(first, 1)).sum():
        return moved
    turned = np.eye(len(T))  # what is left of a pair stands below
    turned[:sums, :sums] = np.eye(sums)[::-1]
    return moved.in_coordinates(turned, turned)


def _held(system: Innovations, problem: Problem, zero: Level, iterations: int, seconds: float) -> Held | None:
    """The least error with these sums: of inputs from zero, or from a level where that is better beyond chance."""
    plain = _from_level(system, problem, zero, iterations, seconds)
    # Asked before steps are taken, as those from a wrong level lead away; and again where they lead.
    other, at = None, system
    for _ in range(LEVELS):
        level = _standing(at, problem)
        tried = None if level is None else _from_level(at, problem, level, iterations, seconds)
        if tried is None or (
            other is not None and not size_of(tried.found.covariance) < size_of(other.found.covariance)
        ):
            break
        other, at = tried, tried.found.system
    if plain is None or other is None:
        return plain or other
    return (
        other
        if slow_poles.significantly_better(other.errors, plain.errors, parameters=0, scale=_power(problem))
        else plain
    )


def _from_level(system: Innovations, problem: Problem, level: Level, iterations: int, seconds: float) -> Held | None:
    """The least error near a system, of inputs from some level."""
    own = replace(problem, segments=[replace(_counted_from(one, level), rest=None) for one in problem.segments])
    try:
        begun = own.with_inputs(system)
        found = None if begun is None else own.refined(begun[1], iterations, seconds)
    except np.linalg.LinAlgError:  # a run from there is not finite
        return None
    return None if found is None else Held(found=replace(found, level=level), problem=own)


def _standing(system: Innovations, problem: Problem) -> Level | None:
    """The level of the inputs from which the last sum adds them up best: a constant drive of it is one of them."""
    sums, (n, m) = problem.sums, system.B.shape
    driven = np.hstack([system.B, np.zeros((n, 1))])
    wider = replace(system, B=driven, D=np.hstack([system.D, np.zeros((system.n_outputs, 1))]))
    more = [np.hstack([one.inputs, np.ones((len(one), 1))]) for one in problem.segments]
    segments = [replace(one, inputs=inputs, rest=None) for one, inputs in zip(problem.segments, more, strict=True)]
    # What acts at once stays: of a constant input it would be the constant.
    chart = Chart.linear(wider, feedthrough=False, intercept=True, sums=sums)
    of_ones = n * n + np.delete(np.arange(n), sums - 1) * (m + 1) + m
    chart = replace(chart, basis=chart.basis[:, ~chart.basis[of_ones].any(axis=0)])
    solved = replace(problem, segments=segments).solved(chart)
    if solved is None:
        return None
    last = solved.B[sums - 1]
    level = -linalg.lstsq(last[np.newaxis, :-1], last[-1:])[0]
    return tuple(level.tolist()) if np.isfinite(level).all() else None
