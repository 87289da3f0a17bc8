"""The scikit-learn estimator: its own checks, as far as a model of time can pass them, and the usual company."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, TimeSeriesSplit, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import estimator_checks_generator

import sysid
from sysid.sklearn import EXPECTED_FAILED_CHECKS, DynamicRegressor


def record(n: int = 200) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    u = np.random.default_rng(0).standard_normal((n, 1))
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = 0.8 * y[k - 1] + u[k - 1, 0]
    return u, y


CHECKS = list(
    estimator_checks_generator(DynamicRegressor(), mark="skip", expected_failed_checks=EXPECTED_FAILED_CHECKS)
)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("estimator", "check"), CHECKS, ids=[getattr(c[1], "func", c[1]).__name__ for c in CHECKS])
def test_scikit_learn_s_own_checks(estimator: DynamicRegressor, check: object) -> None:
    check(estimator)  # type: ignore[operator]


def test_a_grid_search_over_structures_finds_the_dead_time() -> None:
    u, y = record()
    grid = {"structure": [sysid.ARX(na=1, nb=1, nk=nk) for nk in (0, 1, 2)]}
    search = GridSearchCV(DynamicRegressor(sample_time=0.1), grid, cv=TimeSeriesSplit(3)).fit(u, y)
    assert search.best_params_["structure"] == sysid.ARX(na=1, nb=1, nk=1)


def test_it_stands_in_a_pipeline_and_in_cross_validation() -> None:
    u, y = record()
    model = make_pipeline(StandardScaler(), DynamicRegressor(sysid.ARX(na=1, nb=1, nk=1)))
    scores = cross_val_score(model, u, y, cv=TimeSeriesSplit(3))
    assert scores.min() > 0.9


def test_what_it_predicts_is_the_fit_s_free_run() -> None:
    u, y = record()
    model = DynamicRegressor(sysid.ARX(na=1, nb=1, nk=1)).fit(u, y)
    assert_allclose(model.predict(u), model.fit_.simulate(u, initial=y[0]))
    held = clone(model).set_params(initial=1.0).fit(u, y)
    assert_allclose(held.predict(u)[0], 0.8 * 1.0 + u[0, 0], rtol=0.01)


def test_several_outputs_are_several_columns() -> None:
    u, y = record()
    both = np.column_stack([y, 2.0 * y])
    model = DynamicRegressor(sysid.ARX(na=1, nb=1, nk=1)).fit(u, both)
    assert model.predict(u).shape == both.shape
    assert model.score(u, both) > 0.99
