"""Output errors with a pole as slow as the records: where the transfer function of the same orders has its poles.

Both are one structure. A transfer function is searched with its numerator eliminated, so that it runs along a bound of
the poles, where a search over all coefficients stops; it decides whether a pole may lie beyond.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import FitDivergedError, TraceError
from sysid.estimation.clock import now
from sysid.estimation.least_squares.provider import AbstractProvider
from sysid.estimation.least_squares.state import Solution
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.polynomial.starts import model_of_order
from sysid.estimation.linear.segments import Segment, delayed_inputs, segments_of
from sysid.estimation.linear.state_space.provider import PredictionErrors
from sysid.estimation.linear.subspace.windows import Windows
from sysid.estimation.linear.transfer_function.fit import fit_transfer_function
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import Status
from sysid.models import Mapping, Scaling, Start, TransferFunction, TransferFunctionModel
from sysid.models.linear.polynomial import PolynomialModel
from sysid.models.linear.polynomial_orders import AbstractPolynomial
from sysid.traces import Trace

Array = NDArray[np.float64]


Data = tuple[Sequence[Trace], Mapping, Start, float, Sequence[Experiment]]
"""Traces, mapping, start, output at rest, and the records as they are fitted."""
Found = tuple[PredictionErrors, Solution, Scaling]
"""A problem, where its search ended, and the scaling of its coefficients."""

ROUNDED = 1e-7
"""How far a pole is brought within the bound that it is at: its polynomial is rounded, and two poles there move by the
root of that."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AbstractWays(ABC):
    """What is needed to look at structures beside the one that is fitted.

    Args:
        data: What is fitted.
        until: When the time is up.
    """

    data: Data
    until: float

    @abstractmethod
    def fitted(self, orders: AbstractPolynomial) -> PolynomialModel:
        """A polynomial model of the same records.

        Args:
            orders: The structure.

        Returns:
            The model.
        """

    @abstractmethod
    def run(self, problem: AbstractProvider, theta: Array, *, stays: bool = False) -> Solution:
        """From a point to a minimum.

        Args:
            problem: The problem.
            theta: Where to begin.
            stays: Whether to stay there.

        Returns:
            The end.
        """


def next_to_transfer_function(found: Found, orders: AbstractPolynomial, ways: AbstractWays) -> Found:
    """What was found, or where a pole may be as slow as the records, what the transfer function of these orders is.

    So it is where the steps came to no end: numerators are eliminated there, and there are other starts.

    Args:
        found: What was found.
        orders: Of a model without noise.
        ways: To other structures.

    Returns:
        The problem, its solution, its scaling.
    """
    errors, solution, scaling = found
    lengths, radius = [len(one) for one in errors.segments], errors.chart.system(solution.theta).radius
    slow = slow_poles.unseen(radius, lengths)
    ended = solution.status is not Status.MAX_ITERATIONS
    if ended and not slow and not slow_poles.unseen(suggested(errors.segments, orders), lengths):
        return found
    other = of_transfer_function(ways.data, orders, errors, scaling, seconds=ways.until - now())
    if other is None:
        return found
    problem, theta, own = other
    at_one = abs(problem.chart.system(theta).radius - 1.0) <= slow_poles.FAR  # from where steps would lead away
    end = ways.run(problem, theta, stays=at_one)
    end = replace(end, status=Status.CONVERGED) if at_one else end  # the transfer function has
    beyond = slow and (at_one or radius > problem.largest)
    return (problem, end, own) if beyond or end.at.loss < solution.at.loss else found


def suggested(segments: Sequence[Segment], orders: AbstractPolynomial) -> float:
    """Magnitude of the slowest pole of an ARX model with as many lags, which need not be stable.

    A search among stable poles may end far from the slow one that the records have: where one begins at rest while its
    input stands, a pole near 1 has an equilibrium far away, and one at 1 has none.

    Args:
        segments: The records, in scaled numbers.
        orders: Of a model without noise.

    Returns:
        It; 0 where there is none.
    """
    lags, dead = max(orders.denominators), [max(k - 1, 0) for k in orders.nk]
    late = [
        replace(piece, inputs=delayed_inputs(piece.inputs, piece.inputs[0], dead))
        for segment in segments
        for piece in segment.pieces()
        if len(piece) > 2 * (lags + 1)
    ]
    if not lags or not late:
        return 0.0
    return float(np.abs(model_of_order(Windows.of(late, lags, 1), lags).raw_poles).max(initial=0.0))


def of_transfer_function(
    data: Data,
    orders: AbstractPolynomial,
    errors: PredictionErrors,
    scaling: Scaling,
    *,
    seconds: float,
) -> tuple[PredictionErrors, Array, Scaling] | None:
    """The coefficients of the transfer function of the same orders.

    Args:
        data: What is fitted.
        orders: Of a model without noise.
        errors: The least-squares problem.
        scaling: Of the coefficients.
        seconds: Time for it.

    Returns:
        The problem with the bound that its poles keep, the coefficients, and their scaling: beyond the bound inputs
        are counted from where the transfer function stands, as the offset of one adds up in an integrator. ``None``
        where there is no such transfer function, or it runs away.
    """
    zeros = tuple(nb - 1 for nb in orders.nb)
    if any(z > n or not n for z, n in zip(zeros, orders.denominators, strict=True)) or seconds <= 0.0:
        return None
    traces, mapping, start, rest, experiments = data
    structure = TransferFunction(poles=orders.denominators, zeros=zeros, delays=orders.nk, intercept=orders.intercept)
    try:
        fit = fit_transfer_function(
            traces, mapping, structure, TransferFunctionTraining(max_time_s=seconds), start=start, rest_output=rest
        )
    except (FitDivergedError, TraceError):
        return None
    model = cast("TransferFunctionModel", fit.model)
    longest = max(len(segment) for segment in errors.segments)
    if model.pole_radius > 1.0 + 1.0 / longest:  # it runs away within a record, where the bounded one does not
        return None
    largest = 1.0 - 1.0 / (slow_poles.SLOWEST * longest)
    problem = replace(errors, stable=model.pole_radius <= largest + ROUNDED, largest=largest)
    if not problem.stable:
        scaling = replace(scaling, input_offset=model.scaling.input_offset)
        problem = replace(problem, segments=segments_of([one.begun_anywhere for one in experiments], scaling))
    theta = _coefficients(model, orders, scaling, problem)
    linear = [*range(sum(orders.nb)), *range(len(theta) - orders.level, len(theta))]
    here = problem.linearise(theta)
    if not np.isfinite(here.loss):
        return None
    theta[linear] -= _minimum(here.gauss_newton[np.ix_(linear, linear)], here.gradient[linear])
    return problem, theta, scaling


def _minimum(normal: Array, gradient: Array) -> Array:
    """The step to the minimum of what is linear, each coefficient measured by what it moves.

    Beside what an integrator adds up a constant moves next to nothing, and undoes the ramp that an input away from
    zero makes of a pole that is nearly 1: it would count as nothing.
    """
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    return np.asarray(np.linalg.lstsq(normal / np.outer(size, size), gradient / size, rcond=None)[0] / size)


def _coefficients(
    model: TransferFunctionModel, orders: AbstractPolynomial, scaling: Scaling, problem: PredictionErrors
) -> Array:
    """Those of a transfer function in scaled numbers; the constant is left to who refines them."""
    inputs = range(len(orders.nb))
    B = [model.numerator(j) * scaling.input_scale[j] / scaling.output_scale for j in inputs]
    F = [model.denominator(j) for j in inputs]
    F = [_within(one, problem.largest) for one in F] if problem.stable else F
    return np.concatenate([*B, *(one[1:] for one in F), np.zeros(int(orders.level))])


def _within(denominator: Array, largest: float) -> Array:
    """The polynomial with poles at the bound just within it."""
    poles, edge = np.roots(denominator), largest - ROUNDED
    return np.asarray(np.poly(poles * np.minimum(1.0, edge / np.maximum(np.abs(poles), edge))).real, dtype=np.float64)
