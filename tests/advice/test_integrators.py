"""A plant that adds up is told from one that is slow, and from one that is hidden in noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.advice import Advice, Verdict, advise
from sysid.advice.equation import least_bic
from sysid.advice.integrators import integrates
from sysid.models import Mapping, NeuralStateSpace
from sysid.traces import Role, Trace, TraceSet
from tests.traces.made import trace_of

Array = NDArray[np.float64]
MAPPING = Mapping.parse("u -> y")
N = 450
STEPS = np.repeat(np.random.default_rng(3).uniform(-1.0, 1.0, N // 15), 15)


def a_trace(u: Array, y: Array, noise: float = 0.01) -> Trace:
    """With noise as a share of the output's deviation."""
    noisy = y + noise * np.std(y) * np.random.default_rng(9).standard_normal(len(y))
    return trace_of({"u": u, "y": noisy}, name="a", sample_time=0.1, units={"u": "V", "y": "m"})


def carriage(n: int = N) -> tuple[Array, Array]:
    """Friction, a load that nobody measures, and a controller: as machines that position something are recorded."""
    wanted = np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, n // 45), 45)
    u, y, speed, place = np.empty(n), np.empty(n), 0.0, 0.0
    for t in range(n):
        y[t] = place
        u[t] = 2.0 * (wanted[t] - place) - 1.5 * speed
        place += 0.1 * speed
        speed += 0.1 * (u[t] + 0.1 - 0.8 * speed - 0.06 * np.tanh(20.0 * speed))
    return u, y


def first_order(pole: float) -> Array:
    return np.asarray(lfilter([0.0, 1.0], [1.0, -pole], STEPS))


@pytest.mark.parametrize(
    ("u", "y"),
    [
        pytest.param(STEPS, np.cumsum(STEPS), id="an integrator"),
        pytest.param(STEPS + 0.3, np.cumsum(lfilter([0.2], [1.0, -0.8], STEPS)), id="an offset of the input"),
        pytest.param(*carriage(), id="with friction, in a loop"),
    ],
)
def test_what_adds_up_is_found(u: Array, y: Array) -> None:
    assert integrates([a_trace(u, y + 40.0)], MAPPING)


@pytest.mark.parametrize(
    ("u", "y", "noise"),
    [
        pytest.param(STEPS, first_order(0.99), 0.01, id="a very slow one"),
        pytest.param(STEPS, lfilter([0.1], [1.0, -1.8, 0.9], STEPS), 0.01, id="a resonance"),
        pytest.param(STEPS, first_order(0.9) + np.linspace(0.0, 5.0, N), 0.01, id="a drift beside it"),
        pytest.param(STEPS, first_order(0.6) + np.linspace(0.0, 8.0, N), 0.01, id="a drift that is most of it"),
        pytest.param(STEPS, np.cumsum(STEPS), 0.5, id="nothing but noise can be said"),
    ],
)
def test_what_settles_is_not_taken_for_it(u: Array, y: Array, noise: float) -> None:
    assert not integrates([a_trace(u, y, noise)], MAPPING)


def test_a_sum_that_other_slow_poles_take_off_again_is_none() -> None:
    """Of a curve and three inputs, two of which do nothing, a sum brought more than the output's movement."""
    rng = np.random.default_rng(11)
    heat, flow = (
        np.repeat(rng.uniform(low, high, -(-1500 // k)), k)[:1500] for low, high, k in ((0, 100, 40), (2, 12, 60))
    )
    air = 18 + 3 * np.sin(np.arange(1500) / 180) + 0.1 * rng.standard_normal(1500)
    y = np.asarray(lfilter([0.0, 0.3], [1.0, -0.7], 0.012 * flow**2)) + 0.01 * rng.standard_normal(1500)
    means = [x.reshape(500, 3).mean(axis=1) for x in (heat, flow, air, y)]
    trace = trace_of(
        dict(zip(("heat", "flow", "air", "y"), means, strict=True)), name="a", sample_time=6.0,
        units={"heat": "1", "flow": "1", "air": "1", "y": "1"},
    )  # fmt: skip
    assert not integrates([trace], Mapping.parse("heat+flow+air -> y"))


def look(u: Array, y: Array) -> Advice:
    return advise(TraceSet(name="x", traces=(a_trace(u, y),), roles={"a": Role.ESTIMATION}), MAPPING)


def test_what_adds_up_has_no_rise_to_be_sampled_by() -> None:
    """A rise of hundreds of samples, and a rate of a few a minute, had been proposed for a tank."""
    u = np.repeat(np.random.default_rng(4).uniform(-1.0, 1.0, 60), 17)[:1000]
    found = look(u, 3.0 + np.cumsum(u - u.mean()) * 0.05)
    assert found.find("settling.integrates", "u") is not None
    assert found.find("sampling.unknown") is not None
    assert found.find("sampling.fast", "u") is None


def test_it_is_told_and_what_is_suggested_has_it() -> None:
    found = look(*carriage())
    told = found.find("settling.integrates", "u")
    assert told is not None
    assert told.verdict is Verdict.NOTE
    networks = [one.structure for one in found.suggestions if isinstance(one.structure, NeuralStateSpace)]
    assert [one.integrators for one in networks] == [1]
    assert "integrates" in str(found)


def test_a_response_that_is_small_at_first_is_no_dead_time_after_which_the_plant_runs_away() -> None:
    """A joint that a controller positions: its place answers the first samples by next to nothing."""
    n, T = 2400, 0.005
    wanted = np.repeat(np.random.default_rng(1).uniform(-0.3, 0.3, n // 400), 400)
    u, y, speed, place = np.empty(n), np.empty(n), 0.0, 0.0
    for t in range(n):
        y[t] = place
        u[t] = np.clip(160.0 * (wanted[t] - place) - 24.0 * speed, -4.0, 4.0)
        speed += T * (u[t] * 0.36 - 2.0 * speed - 0.2 * np.tanh(50.0 * speed))
        place += T * speed
    # By the response alone its dead time is some twenty samples.
    found = least_bic([a_trace(u, y, noise=1e-5)], MAPPING, [20], at_once=False)
    assert found is not None
    assert max(found.structure.nk) <= 2
    assert not found.grows
    assert found.explained > 0.9
