"""Dead times that end between samples are found there, with an interval; those of whole samples stay whole."""

import numpy as np
import pytest
from scipy import signal

import sysid

FINE, T = 20, 0.4
PLANT = [1.5, 2.0], [1.0, 1.2, 0.6]
"""Numerator and denominator."""
FEW = sysid.TransferFunctionTraining(max_delay=3, scattered_starts=0)


def record(late: float, *, noise: float, seed: int, n: int = 250) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    u = np.r_[0.0, 0.0, np.repeat(rng.uniform(-1, 1, n), 3)[: n - 2]]
    num, den, _ = signal.cont2discrete(PLANT, T / FINE, "zoh")
    fine = np.concatenate([np.zeros(round(late * FINE)), np.repeat(u, FINE)])[: n * FINE]
    y = signal.lfilter(np.ravel(num), den, fine)[::FINE]
    return u, y + noise * y.std() * rng.standard_normal(n)


def fitted(u: np.ndarray, y: np.ndarray, **orders: object) -> sysid.Fit:
    structure = sysid.TransferFunction(**{"poles": 2, "zeros": 1, "domain": "continuous", **orders})
    return sysid.fit(sysid.data((u, y), sample_time=T), "u -> y", structure, None if structure.delays else FEW)


@pytest.mark.parametrize("start", ["rest", "estimated"])
def test_a_dead_time_between_samples_is_found_with_its_interval(start: str) -> None:
    """Whole samples alone left 5 % and more, which its poles and zeros made up for."""
    u, y = record(2.35, noise=0.02, seed=1)
    structure = sysid.TransferFunction(poles=2, zeros=1, domain="continuous")
    fit = sysid.fit(sysid.data((u, y), sample_time=T), "u -> y", structure, FEW, start=start)
    known = fit.uncertainty
    at = known.names.index("Td(u)")
    low, high = known.interval(0.99)[at]
    assert low < 2.35 * T < high and high - low < 0.3 * T
    assert known.values[at] == pytest.approx(fit.model.delays[0] * T)
    assert np.std(y - fit.simulate(u)) < 0.021 * np.std(y)
    assert not fit.warnings


@pytest.mark.parametrize("late", [0.0, 2.0])
def test_a_dead_time_of_whole_samples_stays_whole(late: float) -> None:
    for seed, noise in enumerate((0.0, 0.05)):
        assert fitted(*record(late, noise=noise, seed=seed)).model.structure.delays == (late,)


def test_one_that_is_given_is_kept_and_says_the_rest_exactly() -> None:
    u, y = record(1.35, noise=0.0, seed=3)
    fit = fitted(u, y, delays=1.35)
    assert fit.model.structure.label == "continuous TF [2; 1; 1.35]"
    assert "Td(u)" not in fit.uncertainty.names
    np.testing.assert_allclose(fit.model.numerator(0), np.array(PLANT[0][::-1]), rtol=1e-6)
    np.testing.assert_allclose(fit.simulate(u), y, atol=1e-7)
