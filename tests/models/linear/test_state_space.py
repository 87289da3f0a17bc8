"""A linear state space as it is run: the state that a history shows."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import linalg
from scipy.signal import lfilter

from sysid.models import History, Scaling
from sysid.models.linear.innovations import Innovations
from sysid.models.linear.state_space import HISTORY_NOISE, StateSpace

SYSTEM = Innovations(
    A=np.array([[0.9, 0.2], [0.0, 0.7]]), B=np.array([[0.5], [1.0]]), C=np.array([[1.0, 0.3]]), D=np.zeros((1, 1)),
    K=np.array([[0.2], [0.1]]), constant=np.array([0.5]),
)  # fmt: skip
FORM = StateSpace.of(SYSTEM, Scaling.identity(1), noise=True)


def record(n: int, seed: int = 0) -> History:
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(n)
    y = lfilter([0.0, 0.8], [1.0, -0.9], u) + 0.5 + 0.3 * rng.standard_normal(n)
    return History(inputs=u[:, np.newaxis], output=y)


@pytest.mark.parametrize("n", [2, 3, 5, 60])
def test_the_state_of_a_noisy_history_is_the_one_that_was_likeliest(n: int) -> None:
    history, (A, B, C) = record(n), (SYSTEM.A, SYSTEM.B, SYSTEM.C)
    begun = linalg.solve(np.eye(2) - A, B @ history.inputs[0])
    observed = np.concatenate([C @ np.linalg.matrix_power(A, t) for t in range(n)])
    left = history.output - SYSTEM.simulated(history.inputs, begun.copy())[:, 0]
    errors = left - observed @ np.linalg.lstsq(observed, left, rcond=None)[0]
    level = float(errors @ errors) / max(n - 2, 1)
    held = linalg.solve(np.eye(2) - A, B)
    spread = linalg.solve_discrete_lyapunov(A, B @ B.T + level * SYSTEM.K @ SYSTEM.K.T)
    if n == 2:  # nothing is left to tell a level by
        level = HISTORY_NOISE * np.trace(observed @ spread @ observed.T) / n
    spread = spread + held @ held.T
    before = begun + spread @ observed.T @ linalg.solve(observed @ spread @ observed.T + level * np.eye(n), left)
    SYSTEM.simulated(history.inputs, before)
    assert_allclose(FORM.state(history), before, rtol=1e-8)


def test_a_long_history_takes_no_matrix_of_samples_by_samples() -> None:
    history = record(4000)
    tracemalloc.start()
    FORM.state(history)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4e6
