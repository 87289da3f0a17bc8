"""Linear kernels against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from sysid.kernels import linear, linear_orders


@pytest.mark.parametrize(("c1", "c2"), [(-1.9, 0.95), (-0.5, 0.0), (0.3, -0.2)], ids=str)
def test_a_section_is_scipys_filter(c1: float, c2: float) -> None:
    x = np.random.default_rng(0).normal(size=500)
    v = np.empty(500)
    linear.all_pole(x, c1, c2, 0.0, v)
    np.testing.assert_allclose(v, signal.lfilter([1.0], [1.0, c1, c2], x), rtol=1e-10, atol=1e-12)


def test_a_section_that_was_at_rest_stays_there() -> None:
    v = np.empty(50)
    linear.all_pole(np.full(50, 3.0), -1.2, 0.4, 3.0 / 0.2, v)
    np.testing.assert_allclose(v, 15.0, rtol=1e-12)


def test_state_space_is_scipys() -> None:
    rng = np.random.default_rng(1)
    A, B, C, D = (
        0.3 * rng.normal(size=(5, 5)),
        rng.normal(size=(5, 2)),
        rng.normal(size=(3, 5)),
        rng.normal(size=(3, 2)),
    )
    u, x0 = rng.normal(size=(200, 2)), rng.normal(size=5)
    x, y = x0.copy(), np.empty((200, 3))
    linear.state_space(A, B, C, D, u, x, y)
    _, expected, states = signal.dlsim((A, B, C, D, 1.0), u, x0=x0)
    np.testing.assert_allclose(y, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(x, A @ states[-1] + B @ u[-1], rtol=1e-9, atol=1e-12)


def test_reflections_give_the_residual_of_least_squares() -> None:
    rng = np.random.default_rng(2)
    X, y = rng.normal(size=(60, 5)), rng.normal(size=60)
    W = np.ascontiguousarray(np.column_stack([X, y]).T)
    rank = 0
    for j in (3, 1, 4):
        rank = linear_orders.reflect(W, j, np.array([k for k in range(5) if k != j]), 4, 5, rank, 1e-12)
    residual = np.linalg.lstsq(X[:, [3, 1, 4]], y)[1][0]
    assert linear_orders.residual_square(W, 5, rank) == pytest.approx(residual, rel=1e-12)
