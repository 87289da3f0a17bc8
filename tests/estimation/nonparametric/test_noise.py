"""How long errors persist, read from their autoregression."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from scipy.signal import lfilter

from sysid.estimation.nonparametric.noise import inside, persistence, power

AR = [1.0, -1.5, 0.56]


def test_the_time_is_that_of_the_process_after_a_fit_took_its_slowest_part() -> None:
    """S(0)/r(0) of this autoregression is 14.4; each record has lost its mean and its trend."""
    times = []
    for seed in range(20):
        e = lfilter([1.0], AR, np.random.default_rng(seed).standard_normal(400))[100:]
        t = np.linspace(-1.0, 1.0, len(e))
        times.append(persistence([e - np.polyval(np.polyfit(t, e, 1), t)]))
    assert np.mean(times) == pytest.approx(14.4, rel=0.2)


@pytest.mark.parametrize("e", [np.zeros(50), np.full(50, 2.0), np.ones(3), np.full(50, np.inf)])
def test_what_tells_nothing_counts_sample_by_sample(e: np.ndarray) -> None:
    assert 1.0 <= persistence([e]) < np.inf


@pytest.mark.parametrize("seed", range(20))
def test_the_power_is_that_of_the_lyapunov_equation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pairs = rng.uniform(0.0, 0.95, rng.integers(1, 6)) * np.exp(1j * rng.uniform(0.0, np.pi, 1))
    a = inside(np.concatenate([pairs, pairs.conj(), rng.uniform(-0.9, 0.9, rng.integers(0, 2))]))
    driven = np.zeros((len(a) - 1, len(a) - 1))
    driven[0, 0] = 1.0
    assert power(a) == pytest.approx(linalg.solve_discrete_lyapunov(linalg.companion(a), driven)[0, 0], rel=1e-6)


def test_errors_without_any_noise_have_a_time_too() -> None:
    t = np.arange(400)
    e = 0.995**t * (1.0 + np.cos(0.01 * t)) + 0.99**t  # an autoregression has its roots at the unit circle
    assert 1.0 <= persistence([e]) < np.inf
