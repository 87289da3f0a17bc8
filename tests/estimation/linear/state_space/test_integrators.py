"""State spaces of plants that integrate: a pole that records do not tell from 1 is held there.

A little off 1 it had an equilibrium far away, and with a constant of the output a ramp that no input made: runs from
rest were lost, and nothing said so.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

import sysid
from sysid.estimation.linear_posteriors import state_space_posterior

T = 0.1
Array = NDArray[np.float64]
Plant = Callable[[Array], Array]


def of(numerator: list[float], denominator: list[float]) -> Plant:
    b, a, _ = cont2discrete((numerator, denominator), T)
    return lambda u: np.asarray(lfilter(b.ravel(), a, u))


INTEGRATOR, LAG, DOUBLE = of([0.3], [1.0, 0.0]), of([0.3], [2.0, 1.0, 0.0]), of([0.3], [1.0, 0.0, 0.0])
SLOW = of([30.0], [50.0, 1.0])  # a third of the record


def two(u: Array) -> Array:
    """One integrator an output, the first of them with a way to the second."""
    return np.column_stack([INTEGRATOR(u[:, 0]), INTEGRATOR(u[:, 1]) + of([0.4], [1.0, 1.0])(u[:, 0])])


def held(rng: np.random.Generator, n: int, hold: int, *, inputs: int = 1, level: float = 0.0) -> Array:
    u = np.repeat(rng.uniform(-1.0, 1.0, (n // hold + 1, inputs)), hold, axis=0)[:n]
    u[:20] = 0.0
    return np.asarray(level + (u[:, 0] if inputs == 1 else u))


def noisy(rng: np.random.Generator, y: Array, noise: float) -> Array:
    return y + noise * y.std(axis=0) * rng.standard_normal(y.shape)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    ("plant", "states", "sums", "level", "noise"),
    [
        pytest.param(INTEGRATOR, 1, 1, 0.0, 0.01, id="one"),
        pytest.param(LAG, 2, 1, 0.0, 0.01, id="behind a lag"),
        pytest.param(LAG, 2, 1, 5.0, 0.002, id="of an input that stands at 5"),
        pytest.param(DOUBLE, 2, 2, 0.0, 0.001, id="a chain"),
        pytest.param(two, 3, 2, 0.0, 0.01, id="two side by side"),
    ],
)
def test_sums_are_held_at_one_and_a_run_from_rest_is_right(
    plant: Plant, states: int, sums: int, level: float, noise: float, *, seed: int
) -> None:
    rng, inputs = np.random.default_rng(seed), 1 + (plant is two)
    u, v = (held(rng, n, hold, inputs=inputs, level=level) for n, hold in ((1500 // inputs, 6), (600, 9)))
    mapping = "u1+u2 -> y1+y2" if plant is two else "u -> y"
    traces = sysid.data((u, noisy(rng, plant(u - level), noise)), sample_time=T)
    fit = sysid.fit(traces, mapping, sysid.LinearStateSpace(states=states, noise=False))
    true = plant(v - level)
    error = np.linalg.norm(fit.simulate(v) - true, axis=0) / np.linalg.norm(true - true.mean(axis=0), axis=0)
    assert np.max(error) < 0.15
    away = np.sort(np.abs(fit.model.system.poles() - 1.0))
    assert away[sums - 1] < 1e-12
    assert not [one for one in fit.warnings if "slowest pole" in one]


@pytest.mark.parametrize(
    ("plant", "sums", "seed"),
    [
        pytest.param(LAG, 1, 0, id="behind a lag"),
        pytest.param(DOUBLE, 2, 0, id="a chain"),
        pytest.param(DOUBLE, 2, 7, id="a chain, whose old gain has no stable predictor beside poles at 1"),
    ],
)
def test_a_model_of_the_noise_holds_them_too(plant: Plant, sums: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    u, v = held(rng, 800, 6), held(rng, 600, 9)
    fit = sysid.fit(
        sysid.data((u, noisy(rng, plant(u), 0.02)), sample_time=T), "u -> y", sysid.LinearStateSpace(states=2)
    )
    assert fit.status.usable
    assert np.std(fit.simulate(v) - plant(v)) < 0.1 * np.std(plant(v))
    assert np.sort(np.abs(fit.model.system.poles() - 1.0))[sums - 1] < 1e-12
    assert fit.posterior is not None


@pytest.mark.parametrize("noise", [True, False])
def test_a_slow_lag_stays_one(*, noise: bool) -> None:
    rng = np.random.default_rng(0)
    u = held(rng, 1500, 6)
    traces = sysid.data((u, noisy(rng, SLOW(u), 0.01)), sample_time=T)
    fit = sysid.fit(traces, "u -> y", sysid.LinearStateSpace(states=1, noise=noise))
    assert fit.model.pole_radius == pytest.approx(np.exp(-T / 50.0), abs=1e-4)


@pytest.mark.parametrize("seed", [2, 3])
def test_a_pole_at_the_bound_is_warned_of_and_a_remedy_named(seed: int) -> None:
    """A drift that no input makes is no integrator of it."""
    rng = np.random.default_rng(seed)
    u = held(rng, 400, 6)
    y = of([1.0], [1.0, 1.0])(u) + 0.1 * np.cumsum(rng.standard_normal(400))
    fit = sysid.fit(sysid.data((u, y), sample_time=T), "u -> y", sysid.LinearStateSpace(states=2, noise=False))
    (warning,) = [one for one in fit.warnings if "slowest pole" in one]
    assert f"{fit.model.pole_radius:.6f}" in warning
    assert "measure longer" in warning
    assert warning in fit.notes


def test_the_level_is_kept_beside_an_input_that_never_moves() -> None:
    rng = np.random.default_rng(0)
    u = held(rng, 600, 6, level=5.0)
    traces = sysid.data((np.column_stack([np.full(600, 3.0), u]), LAG(u - 5.0)), sample_time=T)
    fit = sysid.fit(traces, "u1+u2 -> y", sysid.LinearStateSpace(states=2, noise=False))
    run = fit.simulate(np.column_stack([np.full(600, 3.0), u]))
    assert np.std(run - LAG(u - 5.0)) < 1e-3 * np.std(LAG(u - 5.0))


def test_the_posterior_is_of_the_records_as_they_were_fitted() -> None:
    """Inputs are counted from the level at which the plant stands."""
    rng = np.random.default_rng(0)
    u = held(rng, 1500, 6, level=5.0)
    traces = sysid.data((u, noisy(rng, LAG(u - 5.0), 0.01)), sample_time=T)
    fit = sysid.fit(traces, "u -> y", sysid.LinearStateSpace(states=2, noise=False))
    records = list(traces.estimation)
    posterior = state_space_posterior(fit.model, fit.uncertainty, records, sysid.Start(kind="estimated"))
    assert posterior is not None
    assert np.isfinite(posterior.factor).all()
    assert 0.5 < posterior.noise.free_run / (0.01 * LAG(u - 5.0).std()) ** 2 < 2.0
