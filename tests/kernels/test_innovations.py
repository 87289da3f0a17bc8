"""The compiled prediction and its sensitivities are the formulas."""

from __future__ import annotations

import numpy as np

from sysid.kernels import innovations as kernel


def matrices(n: int = 3, m: int = 2, p: int = 2) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(0)
    A = 0.5 * rng.normal(size=(n, n)) / np.sqrt(n)
    return (
        A, rng.normal(size=(n, m)), rng.normal(size=(p, n)), rng.normal(size=(p, m)), 0.1 * rng.normal(size=(n, p)),
        rng.normal(size=p),
    )  # fmt: skip


def test_a_prediction_is_the_kalman_filters_and_what_is_not_measured_moves_nothing() -> None:
    A, B, C, D, K, c = matrices()
    rng = np.random.default_rng(1)
    u, y = rng.normal(size=(20, 2)), rng.normal(size=(20, 2))
    y[4] = np.nan
    x, states, predicted = np.ones(3), np.empty((20, 3)), np.empty((20, 2))
    kernel.predict(A, B, C, D, K, c, u, y, x, states, predicted)
    expected = np.ones(3)
    for t in range(20):
        np.testing.assert_allclose(states[t], expected, rtol=1e-12, atol=1e-12)
        now = C @ expected + D @ u[t] + c
        np.testing.assert_allclose(predicted[t], now, rtol=1e-12, atol=1e-12)
        e = np.zeros(2) if t == 4 else y[t] - now
        expected = A @ expected + B @ u[t] + K @ e
    np.testing.assert_allclose(x, expected, rtol=1e-12, atol=1e-12)


def test_responses_are_those_of_each_row_of_the_state() -> None:
    A, _, C, *_ = matrices()
    sources = np.random.default_rng(2).normal(size=(15, 2))
    z, out = np.zeros((2, 2, 3)), np.empty((2, 15, 6))
    kernel.responses(np.ascontiguousarray(A.T), C, sources, z, out)
    for s in range(2):
        for row in range(3):
            x = np.zeros(3)
            for t in range(15):
                np.testing.assert_allclose(out[:, t, s * 3 + row], C @ x, rtol=1e-10, atol=1e-12)
                x = A @ x + np.eye(3)[row] * sources[t, s]
