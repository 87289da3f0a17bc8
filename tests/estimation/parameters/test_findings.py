"""What the records leave open, on matrices whose null space is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from sysid.estimation.least_squares.damping import DAMPINGS
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.provider import Linearisation
from sysid.estimation.least_squares.state import Solution, State
from sysid.estimation.parameters.findings import TOGETHER, Findings, _lost
from sysid.estimation.parameters.named import Named
from sysid.estimation.results.result import Status
from sysid.models.grey_box.declared import Parameter

FLAT = 1e-8


def covariance(J: np.ndarray) -> np.ndarray:
    """By rows of what the records show, with a prior that is nearly flat."""
    return np.linalg.inv(J.T @ J + FLAT * np.eye(J.shape[1]))


def lost(J: np.ndarray) -> np.ndarray:
    return _lost(covariance(J), np.full(J.shape[1], FLAT), np.zeros(J.shape[1]))


def told(J: np.ndarray) -> np.ndarray:
    """Those that are open, and those that cannot be told apart from another that is not."""
    left, C = lost(J), covariance(J)
    correlation = np.abs(C / np.sqrt(np.outer(np.diag(C), np.diag(C)))) - np.eye(len(C))
    return left | (correlation[:, ~left] > TOGETHER).any(axis=1)


def test_a_motor_by_its_speed_alone_shows_three_combinations_of_five() -> None:
    # Of R, L, k, J and b the three coefficients of a transfer function: J L, R J + b L, R b + k^2, over k.
    R, L, k, J, b = 1.2, 0.05, 0.3, 0.02, 0.01
    shown = np.array(
        [
            [0.0, J / k, -J * L / k**2, L / k, 0.0],
            [J / k, b / k, -(R * J + b * L) / k**2, R / k, L / k],
            [b / k, 0.0, 1.0 - R * b / k**2, 0.0, R / k],
        ]
    )
    assert told(1e3 * shown * [R, L, k, J, b]).all()


@pytest.mark.parametrize(("n", "combinations"), [(5, 3), (8, 6), (10, 7)])
def test_of_few_combinations_of_many_each_is_open(n: int, combinations: int) -> None:
    J = np.random.default_rng(n).standard_normal((combinations, n))
    assert told(100.0 * J).all()


def test_a_product_of_two_is_no_loss_of_both_and_what_is_shown_is_none() -> None:
    # Two that the records show as a sum are told as a pair, with intervals; the third is known.
    J = 100.0 * np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 1.0]])
    assert not lost(J)[2]
    assert lost(J).sum() < 2
    assert not lost(100.0 * np.random.default_rng(0).standard_normal((20, 5))).any()


def test_one_that_has_no_effect_is_open_alone() -> None:
    assert lost(100.0 * np.array([[1.0, 0.0, 0.0], [0.2, 1.0, 0.0]])).tolist() == [False, False, True]


def test_a_direction_that_is_rounding_is_open_however_far_from_the_prior() -> None:
    # Four that hang together by two directions, whose variance rounding has kept far below that of the prior.
    J = np.random.default_rng(0).standard_normal((2, 4))
    null = np.linalg.svd(J)[2][2:]
    C = 1e-6 * np.linalg.inv(J.T @ J + FLAT * np.eye(4))
    unseen = np.diag(1e-6 / FLAT * null.T @ null)
    assert not _lost(C, np.full(4, FLAT), np.zeros(4)).any()
    assert _lost(C, np.full(4, FLAT), unseen).any()


def test_sensitivities_that_explode_say_nothing_and_end_no_fit() -> None:
    groups = (Group(name="parameters", members=np.arange(1), known=True),)
    prior = Prior(centre=np.zeros(1), groups=groups, alphas=np.array([1e-10]), beta=1.0)
    at = Linearisation(loss=1.0, gradient=np.ones(1), gauss_newton=np.array([[np.inf]]))
    state = State(theta=np.ones(1), at=at, damping=DAMPINGS["marquardt"](), prior=prior)
    named = (Named(parameter=Parameter(name="k", start=2.0), place=0),)
    found = Findings.of(
        Solution(state=state, status=Status.NOT_IMPROVED), SimpleNamespace(bounds=None, scale=np.full(1, 2.0)), named
    )
    assert found.values.tolist() == [2.0]
    assert np.isnan(found.covariance).all()
    assert any("do not determine the parameter k" in one for one in found.warnings)
