"""Starts of a state space from a record as if it had been sampled more slowly.

A subspace estimate looks at some 40 samples of past and of future: of a record that is sampled fast it sees next to
nothing of a slow mode.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.errors import TraceError
from sysid.estimation.linear.segments import LEAST_ROWS, SLOWER, Segment
from sysid.estimation.linear.state_space.refinement import Problem
from sysid.estimation.linear.subspace.projections import Weighting
from sysid.estimation.linear.subspace.starts import Subspace
from sysid.models.linear.innovations import Innovations

Array = NDArray[np.float64]


def slower_start(problem: Problem, segments: Sequence[Segment]) -> tuple[float, Innovations] | None:
    """The start of least error among those at slower rates.

    Args:
        problem: Without a model of the noise.
        segments: Its records.

    Returns:
        The logarithm of the determinant of its errors' covariance, and the system; ``None`` where too few samples are
        left.
    """
    judge = problem.begun()
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a mode that such a rate does not show has no root
        found = [judge.with_inputs(system) for system in _systems(problem, segments)]
        best = min((one for one in found if one is not None), key=lambda one: one[0], default=None)
        return best if best is None or judge.segments == problem.segments else problem.with_inputs(best[1])


def _systems(problem: Problem, segments: Sequence[Segment]) -> Iterator[Innovations]:
    """Those of each method at each rate at which enough samples are left; their inputs are to be fitted."""
    shortest, states = min(map(len, segments)), problem.orders.states
    for every in SLOWER:
        if shortest < LEAST_ROWS * every:
            return
        means = [segment.means(every) for segment in segments]
        try:
            data = Subspace.of(means, states=states, horizon=None, feedthrough=True, noise=False)
        except TraceError:
            return
        for weighting in Weighting:
            try:
                system = data.estimate(states, weighting)
                A = _root(system.A, every)
            except (linalg.LinAlgError, ValueError):  # not finite, or no decomposition: another one may do
                continue
            if np.isfinite(A).all():
                yield replace(system, A=A)


def _root(A: Array, every: int) -> Array:
    """What so many steps of make ``A``; poles at or below zero, which no slower system has, become fast ones."""
    T, Z = linalg.schur(A, output="complex")
    poles = np.diag(T)
    kept = np.where((np.abs(poles.imag) < 1e-12) & (poles.real < 0.02), 0.02, poles)
    moved = Z @ (T + np.diag(kept - poles)) @ Z.conj().T
    return np.asarray(np.real(linalg.expm(linalg.logm(moved) / every)))
