"""What a trace counts: squares within the margin, their logarithm beyond it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares

from sysid.errors import ConfigError
from sysid.estimation import JointTraining
from sysid.estimation.least_squares.robust_loss import counted

RESIDUAL = np.random.default_rng(0).normal(size=(200, 3)) * [0.1, 1.0, 100.0]


def test_without_a_margin_squares_count():
    loss, weights = counted(RESIDUAL, np.inf, 200)
    assert_allclose(loss, 0.5 * np.sum(RESIDUAL**2))
    assert_allclose(weights, 1.0)


def test_far_within_the_margin_squares_count():
    loss, weights = counted(RESIDUAL, 1e6, 200)
    assert_allclose(loss, 0.5 * np.sum(RESIDUAL**2), rtol=1e-6)
    assert_allclose(weights, 1.0, rtol=1e-6)


def test_a_target_that_is_lost_weighs_little_and_the_others_as_before():
    _, weights = counted(RESIDUAL, 1.0, 200)
    assert_allclose(weights, 1.0 / (1.0 + np.mean(RESIDUAL**2, axis=0)))
    assert weights[0] > 0.98
    assert weights[2] < 2e-4


def test_a_trace_of_one_sample_counts_as_cauchys_loss_of_scipy():
    residual, margin = np.array([[3.0]]), 0.7
    at = least_squares(lambda _: residual[0], [0.0], loss="cauchy", f_scale=margin, max_nfev=1)
    assert_allclose(counted(residual, margin, 1)[0], at.cost)


def test_the_weight_is_the_slope_of_the_loss_over_that_of_the_squares():
    column, step = RESIDUAL[:, 1:2], 1e-6
    slope = (counted(column * (1 + step), 0.8, 200)[0] - counted(column * (1 - step), 0.8, 200)[0]) / (2 * step)
    assert_allclose(slope, counted(column, 0.8, 200)[1][0] * np.sum(column**2), rtol=1e-6)


def test_rows_that_do_not_count_change_nothing():
    """A gap is rows of zeros; the error is that of the rest."""
    padded = np.concatenate([RESIDUAL, np.zeros((300, 3))])
    assert counted(padded, 1.0, 200)[0] == pytest.approx(counted(RESIDUAL, 1.0, 200)[0])
    assert_allclose(counted(padded, 1.0, 200)[1], counted(RESIDUAL, 1.0, 200)[1])


def test_a_trace_that_is_all_gap_counts_nothing():
    loss, weights = counted(np.zeros((5, 1)), 1.0, 0)
    assert loss == 0.0
    assert weights.tolist() == [1.0]


@pytest.mark.parametrize("margin", [0.0, -1.0, float("nan")])
def test_a_margin_that_is_none_is_refused(margin):
    with pytest.raises(ConfigError, match="robust_scale"):
        JointTraining(robust_scale=margin)
