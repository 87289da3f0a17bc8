"""ARMAX and Box-Jenkins models with a pole as slow as the records: what the inputs do is the output error's.

Small one-step errors say little of a slow pole: a noise that hangs together does as well, and the free run is then far
off. So does a noise whose own pole is at 1, beside a zero there that takes its drift off again. The output error of
the same orders has the pole that the free run asks for, at 1 where the plant integrates; the noise is fitted to what
it leaves, and from there all coefficients but the poles at 1. What one step ahead does significantly better is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.errors import FitDivergedError, TraceError
from sysid.estimation.least_squares.provider import AbstractProvider, Linearisation
from sysid.estimation.linear import slow_poles
from sysid.estimation.linear.polynomial.chart import PolynomialChart
from sysid.estimation.linear.polynomial.slow import AbstractWays, Found, suggested
from sysid.estimation.linear.polynomial.starts import ALLOWED, noise_of
from sysid.estimation.linear.segments import Segment, segments_of
from sysid.estimation.linear.state_space.provider import PredictionErrors
from sysid.models import OE
from sysid.models.linear.polynomial import PolynomialModel
from sysid.models.linear.polynomial_orders import AbstractPolynomial

Array = NDArray[np.float64]


def output_error(orders: AbstractPolynomial) -> OE | None:
    """The output error of the same orders.

    Args:
        orders: With a model of the noise.

    Returns:
        It; ``None`` where there is none: several inputs have one denominator, or the noise is integrated, so that no
        level is.
    """
    poles = (orders.order("na"),) if len(orders.nb) == 1 and not any(orders.denominators) else orders.denominators
    common = orders.order("na") > 0 and poles == orders.denominators
    if orders.drifts or common or not poles or not all(poles):
        return None
    return OE(nb=orders.nb, nf=poles, nk=orders.nk, intercept=orders.intercept)


@dataclass(frozen=True, kw_only=True, eq=False)
class Along(AbstractProvider):
    """A least-squares problem along some directions from a point.

    Args:
        problem: The problem.
        point: Shape ``(n_parameters,)``.
        directions: Shape ``(n_parameters, n_directions)``.
    """

    problem: PredictionErrors
    point: Array
    directions: Array
    n_samples: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "n_samples", self.problem.n_samples)

    def at(self, steps: Array) -> Array:
        """The parameters after some steps."""
        return np.asarray(self.point + self.directions @ steps)

    def loss(self, theta: Array) -> float:
        """Half the weighted sum of squares; see the base class."""
        return self.problem.loss(self.at(theta))

    def linearise(self, theta: Array, *, correlation: bool = True) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix; see the base class."""
        found, T = self.problem.linearise(self.at(theta), correlation=correlation), self.directions
        return Linearisation(loss=found.loss, gradient=T.T @ found.gradient, gauss_newton=T.T @ found.gauss_newton @ T)


def beside_noise(
    model: PolynomialModel, orders: AbstractPolynomial, segments: Sequence[Segment], errors: PredictionErrors
) -> Along:
    """A model of the noise beside an output error.

    Args:
        model: The output error.
        orders: With the noise.
        segments: The records, scaled as that model scales them, without gaps.
        errors: The least-squares problem of another scaling.

    Returns:
        The problem along all coefficients but the poles at 1, from where the noise is what the output error leaves.
    """
    alone = PredictionErrors(
        chart=PolynomialChart(orders=model.orders), segments=segments, whitening=errors.whitening, stable=False
    )
    left = [one[:, 0] for one in alone.errors(model.system)]
    poles = [_at_one(one[1:]) for one in model.polynomials.F]
    shared = orders.order("na") > 0
    if shared:
        left = [scipy.signal.lfilter(np.concatenate([[1.0], poles[0][0]]), [1.0], one) for one in left]
    nc, nd = orders.order("nc"), orders.order("nd")
    noises = [noise_of(left, nc, nd)]
    if shared and nc >= len(poles[0][0]):  # errors that are white at the output
        noises.append((np.pad(_just_inside(poles[0][0]), (0, nc - len(poles[0][0]))), np.zeros(nd)))
    B, level = model.theta[: sum(orders.nb)], model.theta[len(model.theta) - orders.level :]
    problem = replace(errors, segments=tuple(segments), stable=False)
    points = [np.concatenate([B, *(found for found, _ in poles), *noise, level]) for noise in noises]
    free = [np.eye(len(B)), *(T for _, T in poles), np.eye(nc + nd + len(level))]
    return Along(problem=problem, point=min(points, key=problem.loss), directions=scipy.linalg.block_diag(*free))


def _just_inside(coefficients: Array) -> Array:
    """A polynomial whose roots are no further out than a predictor may have them."""
    roots = np.roots(np.concatenate([[1.0], coefficients]))
    return np.real(np.poly(roots * np.minimum(1.0, ALLOWED / np.maximum(np.abs(roots), ALLOWED))))[1:]


def _at_one(coefficients: Array) -> tuple[Array, Array]:
    """A denominator with what is next to 1 at 1, and the directions in which that stays there."""
    roots, n = np.roots(np.concatenate([[1.0], coefficients])), len(coefficients)
    at = np.abs(roots - 1.0) <= slow_poles.FAR
    if not at.any():
        return coefficients, np.eye(n)
    sums, others = np.poly(np.ones(int(at.sum()))), np.real(np.poly(roots[~at]))
    T = np.zeros((n, n - int(at.sum())))
    for k in range(T.shape[1]):
        T[k : k + len(sums), k] = sums
    return np.convolve(sums, others)[1:], T


def next_to_output_error(found: Found, orders: AbstractPolynomial, ways: AbstractWays) -> Found:
    """What was found, or where a pole may be as slow as the records, the noise beside the output error.

    Args:
        found: What was found.
        orders: With a model of the noise.
        ways: To other structures.

    Returns:
        The problem, its solution, its scaling.
    """
    (errors, solution, _), alone = found, output_error(orders)
    if alone is None:
        return found
    lengths, polynomials = [len(one) for one in errors.segments], orders.polynomials(solution.theta)
    poles = np.concatenate([np.roots(one) for one in (polynomials.A, *polynomials.F)])
    # A noise that drifts for ever, even if its zero takes that off again, leaves level and slow modes to chance.
    radii = [float(np.abs(one).max(initial=0.0)) for one in (poles, np.roots(polynomials.D))]
    if not any(slow_poles.unseen(one, lengths) for one in (*radii, suggested(errors.segments, alone))):
        return found
    try:
        model = ways.fitted(alone)
    except (FitDivergedError, TraceError):
        return found
    sums = model.pole_radius > 1.0 - slow_poles.FAR
    records = [one.begun_anywhere if sums else one for one in ways.data[-1]]
    pieces = [piece for one in segments_of(records, model.scaling) for piece in one.pieces()]
    problem = beside_noise(model, orders, pieces, errors)
    ended = ways.run(problem, np.zeros(problem.directions.shape[1]))
    theta = problem.at(ended.theta)
    fixed, scale = len(theta) - len(ended.theta), float(np.mean([np.mean(piece.outputs**2) for piece in pieces]))
    before, after = (
        one.errors(one.chart.system(at)) for one, at in ((errors, solution.theta), (problem.problem, theta))
    )
    if slow_poles.significantly_better(before, after, parameters=fixed, scale=scale):
        return found
    return problem.problem, replace(ended, state=replace(ended.state, theta=theta)), model.scaling
