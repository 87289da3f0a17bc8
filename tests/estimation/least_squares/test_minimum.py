"""Whether a fit stands at a minimum."""

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.minimum import stands
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.results.result import Status
from tests.estimation.least_squares.test_levenberg_marquardt import Residuals


def noisy_decay(known: bool) -> tuple[Residuals, Prior]:
    t, rng = np.linspace(0.0, 4.0, 200), np.random.default_rng(3)
    y = 2.0 * np.exp(-0.7 * t) + 0.05 * rng.standard_normal(200)
    provider = Residuals(
        function=lambda p: p[0] * np.exp(-p[1] * t) - y,
        jacobian=lambda p: np.column_stack([np.exp(-p[1] * t), -p[0] * t * np.exp(-p[1] * t)]),
        n_samples=200,
    )
    groups = (Group(name="all", members=np.arange(2), known=known),)
    return provider, Prior(centre=np.zeros(2), groups=groups, alphas=np.array([1e-10]), beta=1.0)


def test_a_fit_that_stands_at_its_minimum_does_not_wait_for_the_patience() -> None:
    provider, prior = noisy_decay(known=True)
    engine = LevenbergMarquardt(termination=Termination(max_iterations=200, patience=50, tolerance=1e-3))
    found = engine.minimise(provider, np.array([0.3, 3.0]), prior)
    assert found.status is Status.CONVERGED
    assert found.state.iteration < 20
    best = least_squares(provider.function, [2.0, 0.7], provider.jacobian, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    covariance = np.linalg.inv(best.jac.T @ best.jac) * 2.0 * best.cost / 200
    assert (np.abs(found.theta - best.x) < 1e-3 * np.sqrt(np.diag(covariance))).all()


def test_a_fit_whose_prior_is_still_sought_does_not_stand() -> None:
    provider, prior = noisy_decay(known=True)
    state = LevenbergMarquardt().minimise(provider, np.array([0.3, 3.0]), prior).state
    assert stands(state, provider)
    sought = replace(state, prior=replace(state.prior, groups=noisy_decay(known=False)[1].groups))
    assert not stands(sought, provider)
