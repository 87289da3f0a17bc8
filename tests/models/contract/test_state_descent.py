"""The state that a record shows, found by descents."""

import numpy as np
import pytest

from sysid.models.contract.state_descent import StateSearch

UNBOUNDED = {"low": np.full(2, -np.inf), "high": np.full(2, np.inf), "expected": np.zeros(2)}
SHOWN = np.array([0.4, -0.7])
A = np.array([[1.0, 0.5], [0.2, 1.0], [0.7, -0.3], [0.1, 0.9]])


def linear(xi: np.ndarray, derived: bool) -> tuple[np.ndarray, np.ndarray]:
    del derived
    return A @ (xi - SHOWN), A


@pytest.mark.parametrize("begins", [(), ([np.array([3.0, 3.0])])], ids=["by default", "from elsewhere"])
def test_what_the_output_leaves_no_doubt_of_is_found(begins):
    np.testing.assert_allclose(StateSearch(misfit=linear, **UNBOUNDED).found(begins), SHOWN, atol=1e-8)


def test_what_was_expected_has_a_say_as_long_as_the_noise_is_taken_to_be_large():
    search = StateSearch(misfit=linear, **UNBOUNDED)
    found = search.descended(np.zeros(2))
    assert 1e-6 < np.abs(found - SHOWN).max() < 1e-3
    assert search.total(found) < search.total(SHOWN) < search.total(np.zeros(2))


def test_bounds_hold_what_is_found():
    search = StateSearch(misfit=linear, low=np.zeros(2), high=np.ones(2), expected=np.zeros(2))
    assert search.found()[1] == 0.0


def test_a_run_that_explodes_ends_the_search_where_it_is() -> None:
    def misfit(xi: np.ndarray, derived: bool) -> tuple[np.ndarray, np.ndarray]:
        del derived
        return np.full(9, 1e180), np.full((9, len(xi)), 1e250)

    search = StateSearch(misfit=misfit, **UNBOUNDED)
    assert search.found().tolist() == [0.0, 0.0]
