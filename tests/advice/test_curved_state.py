"""A curve in the state is told from a linear plant, whatever moves it and however loud it is."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

import sysid
from sysid.advice import Advice, Verdict

Array = NDArray[np.float64]
N = 3_000


def held(u: Array, T: float, rate: Callable[[Array, float], list[float]], start: tuple[float, float]) -> Array:
    """States of a plant whose input is held over each sample, by SciPy's Runge-Kutta."""
    found, x = [np.array(start)], np.array(start)
    for value in u[:-1]:
        x = solve_ivp(lambda _, z, v=value: rate(z, v), (0.0, T), x, rtol=1e-6, atol=1e-8).y[:, -1]
        found.append(x)
    return np.array(found)


def steps(hold: int, size: float, seed: int = 1, *, two: bool = False) -> Array:
    rng = np.random.default_rng(seed)
    values = rng.choice([-1.0, 1.0], N // hold + 1) if two else rng.uniform(-1.0, 1.0, N // hold + 1)
    return size * np.repeat(values, hold)[:N]


def looked(u: Array, y: Array, T: float, noise: float) -> Advice:
    y = y + noise * y.std() * np.random.default_rng(0).standard_normal(N)
    return sysid.advise(sysid.data((u, y), sample_time=T), "u -> y")


def bilinear(u: Array, _: float) -> Array:
    y = np.zeros(N)
    for k in range(1, N):
        y[k] = 0.8 * y[k - 1] + 0.3 * u[k - 1] + 0.25 * u[k - 1] * y[k - 1]
    return y


PLANTS = {
    "spring that hardens": (
        0.05,
        steps(20, 3.0),
        lambda u, T: held(u, T, lambda x, v: [x[1], -0.4 * x[1] - x[0] - 2.0 * x[0] ** 3 + v], (0.0, 0.0))[:, 0],
    ),
    "two wells": (
        0.05,
        steps(20, 1.5),
        lambda u, T: held(u, T, lambda x, v: [x[1], -0.4 * x[1] + x[0] - x[0] ** 3 + v], (0.0, 0.0))[:, 0],
    ),
    "limit cycle": (
        0.1,
        steps(15, 1.5),
        lambda u, T: held(u, T, lambda x, v: [x[1], 1.5 * (1 - x[0] ** 2) * x[1] - x[0] + v], (1.0, 0.0))[:, 0],
    ),
    "pendulum": (
        0.05,
        steps(20, 2.0),
        lambda u, T: held(u, T, lambda x, v: [x[1], -9.81 * np.sin(x[0]) - 0.3 * x[1] + 4.0 * v], (0.0, 0.0))[:, 1],
    ),
    "bilinear": (0.1, steps(10, 1.0), bilinear),
}


@cache
def run_of(plant: str) -> Array:
    T, u, made = PLANTS[plant]
    return made(u, T)


@cache
def advice_on(plant: str, noise: float) -> Advice:
    """Several tests ask it: a plant takes seconds to run, and seconds to look at."""
    T, u, _ = PLANTS[plant]
    return looked(u, run_of(plant), T, noise)


@pytest.mark.parametrize("noise", [0.01, 0.1])
@pytest.mark.parametrize("plant", PLANTS)
def test_a_curve_in_the_state_is_told_and_asks_for_a_network(plant: str, noise: float) -> None:
    """Of a spring that hardens it was said that a linear model may do, of a pendulum that none is seen."""
    found = advice_on(plant, noise)
    told = [one for one in found.findings if one.code in {"linearity.curved_state", "linearity.curved"}]
    assert [one.verdict for one in told] == [Verdict.LOOK]
    assert any(one.structure.kind == "NARX" for one in found.suggestions)


@pytest.mark.parametrize("noise", [0.01, 0.1])
@pytest.mark.parametrize("plant", ["pendulum", "spring that hardens", "two wells"])
def test_no_slower_rate_is_proposed_to_it(plant: str, noise: float) -> None:
    """0.3 s had been, to a pendulum that swings in 2 s and turns over faster."""
    assert advice_on(plant, noise).find("sampling.fast") is None


LINEAR = {
    "second order": ([0.0, 0.2, 0.1], [1.0, -1.5, 0.7]),
    "late": ([*np.zeros(30), 0.05], [1.0, -0.95]),
    "ringing": ([0.0, 0.1], np.poly([0.98 * np.exp(0.3j), 0.98 * np.exp(-0.3j), 0.9]).real),
    "slow": ([0.0, 0.003], [1.0, -0.997]),
}


@pytest.mark.parametrize("loud", range(4))
@pytest.mark.parametrize("place", range(len(LINEAR)), ids=list(LINEAR))
def test_a_linear_plant_has_none(place: int, loud: int) -> None:
    """Any two of plant, noise, hold and number of levels stand together in one of the records."""
    hold, two = (2, 40)[(place + loud) % 2], bool((place // 2 + loud // 2) % 2)
    u = steps(hold, 1.0, two=two)
    found = looked(u, np.asarray(lfilter(*list(LINEAR.values())[place], u)), 0.1, (0.0, 0.1, 0.5, 1.0)[loud])
    assert found.find("linearity.curved_state") is None


def test_nor_has_one_that_drifts_and_is_disturbed() -> None:
    rng, u = np.random.default_rng(3), steps(10, 1.0)
    v = lfilter([1.0], [1.0, -0.99], rng.standard_normal(N))
    found = looked(u, np.asarray(lfilter([0.0, 0.2, 0.1], [1.0, -1.5, 0.7], u)) + 0.1 * v, 0.1, 0.05)
    assert found.find("linearity.curved_state") is None


@pytest.mark.parametrize("seed", range(3, 9))
def test_nor_has_one_that_adds_up_twice_and_is_slow_beside_its_record(seed: int) -> None:
    """Its velocity goes with anything slow, cubes of its own output too, but not so in the other half."""
    rng = np.random.default_rng([7, seed])
    u = np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], 160), 25)
    y = np.cumsum(np.cumsum(u - u.mean())) * 1e-6 + 1e-4 * rng.standard_normal(4_000)
    found = sysid.advise(sysid.data((u, y), sample_time=1e-3), "u -> y")
    assert found.find("linearity.curved_state") is None


@pytest.mark.parametrize("seed", [2, 5])
def test_a_linear_plant_in_a_loop_with_a_set_point_of_two_levels_is_no_curve(seed: int) -> None:
    """Inputs within a step that is foretold tell its noise, by curves, where the set point has two levels."""
    n, rng = 1800, np.random.default_rng(seed)
    target = np.repeat(rng.choice([-1.0, 1.0], n // 20), 20)
    v = lfilter([1.0], [1.0, -0.9], 0.05 * rng.standard_normal(n))
    x, y, u = np.zeros(n), np.zeros(n), np.zeros(n)
    for k in range(n):
        x[k] = 0.8 * x[k - 1] + 0.2 * u[k - 2] if k > 1 else 0.0
        y[k] = x[k] + v[k] + 4.0
        u[k] = 1.5 * (target[k] - (y[k] - 4.0)) + 0.7
    found = {one.code for one in sysid.advise(sysid.data((u, y), sample_time=1.0), "u -> y").findings}
    assert "linearity.curved_state" not in found
