"""A linear loop with a dead zone, limits or a relay in it is found, its equations are its run; others are refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

import sysid
from sysid.estimation.loops import Found, Loop, found_loop, grey_box_of
from sysid.estimation.loops.gate import law_of, pieces
from sysid.estimation.loops.loop import Records, Scaled
from sysid.estimation.loops.relays import relay_begun
from sysid.kernels.loop import DEAD_ZONE, RELAY, SATURATION, WAITS
from sysid.models import Mapping
from sysid.traces import Channel, Role, Trace, TraceSet
from tests.references import loop_models

Array = NDArray[np.float64]
Plant = Callable[[Array], Array]
gear, heater, thermostat = map(njit, (loop_models.gear_run, loop_models.heater_run, loop_models.thermostat_run))
PLANTS: dict[str, tuple[set[int], tuple[tuple[float, float, float], ...], int, Plant]] = {
    "gear": ({DEAD_ZONE}, ((-2.0, 2.0, 0.0),), 200, lambda u: gear(0.02, u, loop_models.GEARS[0])[:, :1]),
    "heater": (
        {SATURATION, WAITS}, ((15.0, 25.0, 18.0), (-5.0, 10.0, 5.0)), 160,
        lambda u: heater(60.0, u, loop_models.HEATERS[0]),
    ),
    "hidden thermostat": (
        {RELAY}, ((15.0, 25.0, 20.0), (-5.0, 10.0, 5.0)), 240,
        lambda u: thermostat(60.0, u, loop_models.THERMOSTATS[1]),
    ),
}  # fmt: skip
"""Elements, range and start of each input, samples, and the plant."""


def commands(ranges: tuple[tuple[float, float, float], ...], samples: int, seed: int) -> Array:
    """Levels that are held for random times, from the starts on."""
    rng, columns = np.random.default_rng(seed), []
    for low, high, start in ranges:
        holds = rng.integers(4, 25, samples)
        levels = rng.uniform(low, high, samples)
        columns.append(np.concatenate([[start] * 3, np.repeat(levels, holds)])[:samples])
    return np.column_stack(columns)


def records(name: str, count: int, seed: int = 0) -> Records:
    _, ranges, samples, plant = PLANTS[name]
    inputs = [commands(ranges, samples, 1000 * seed + k) for k in range(count)]
    return [(u, plant(u)) for u in inputs]


def off(found: Found, runs: Records) -> Array:
    """Root of the mean square of what the free run of each record is off, as a share of the range."""
    known = found.scaled
    scaled = Scaled(
        begin=known.begin, reach=known.reach, rest=known.rest, span=known.span,
        records=[((u - known.begin) / known.reach, (y - known.rest) / known.span) for u, y in runs],
    )  # fmt: skip
    samples = scaled.first(scaled.longest)
    error = found.loop.outputs(samples) - samples.outputs
    return np.asarray(np.sqrt((error**2).reshape(len(runs), -1).mean(axis=1)))


@pytest.mark.parametrize("name", PLANTS)
def test_a_loop_is_found_and_runs_on_over_records_that_it_has_not_seen(name: str) -> None:
    found = found_loop(records(name, 8))
    assert found is not None
    assert found.loop.kind in PLANTS[name][0]
    assert np.quantile(off(found, records(name, 40, seed=1)), 0.95) < 0.01


def test_what_a_hidden_relay_does_is_read_from_what_the_law_leaves() -> None:
    """Its switches within the sample, and what it sees: near enough that no race is run."""
    scaled = Scaled.of(records("hidden thermostat", 12))
    assert scaled is not None
    (law,) = pieces(scaled.records).values()
    assert law.order == 2
    begun = relay_begun(scaled, law, 0)
    assert begun is not None
    part = scaled.first(40)
    terms = begun.run(part, begun.theta)
    assert terms is not None
    left = part.outputs - terms @ np.linalg.lstsq(terms, part.outputs, rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 1e-3


def tanks(u: Array) -> Array:
    """Smooth, and not linear."""
    level, found = 1.0, []
    for (pump,) in u:
        level = max(level + 0.1 * (pump + 2.0) - 0.15 * np.sqrt(level), 0.01)
        found.append((level,))
    return np.array(found)


def linear(u: Array) -> Array:
    a, b, found = 0.0, 0.0, []
    for (one,) in u:
        a, b = 0.9 * a + 0.1 * one, 0.8 * b + 0.2 * a
        found.append((b,))
    return np.array(found)


def stiffening(u: Array) -> Array:
    x, found = 0.0, []
    for (one,) in u:
        x += 0.3 * (one - x - 0.3 * x**3)
        found.append((x,))
    return np.array(found)


def late(u: Array) -> Array:
    """Adds up what came seven samples ago: most samples follow a law that knows nothing of its input."""
    return np.cumsum(0.1 * np.vstack([np.zeros((7, u.shape[1])), u[:-7]])[:, :1], axis=0)


@pytest.mark.parametrize("plant", [tanks, linear, stiffening, late])
def test_what_is_smooth_or_linear_is_refused_before_any_race(plant: Plant) -> None:
    inputs = [commands(PLANTS["gear"][1], 200, k) for k in range(6)]
    runs = [(u, plant(u)) for u in inputs]
    scaled = Scaled.of(runs)
    assert scaled is not None
    assert pieces(scaled.records) == {}
    assert found_loop(runs) is None


def test_noise_and_records_that_say_nothing_are_refused() -> None:
    runs, rng = records("gear", 6), np.random.default_rng(0)
    assert found_loop([]) is None
    assert found_loop([(u[:10], y[:10]) for u, y in runs]) is None
    assert found_loop([(u[:, :0], y) for u, y in runs]) is None
    assert found_loop([(0.0 * u, y) for u, y in runs]) is None
    assert found_loop([(u, y + k) for k, (u, y) in enumerate(runs)]) is None
    assert (
        found_loop([(u, y + np.vstack([y[:1] * 0.0, 0.01 * rng.normal(size=(len(y) - 1, 1))])) for u, y in runs])
        is None
    )


def drawn(kind: int, seed: int, inputs: int, outputs: int) -> Found:
    """Some loop, with records of its own."""
    rng, n = np.random.default_rng(seed), 3
    theta = [
        rng.uniform(0.02, 0.6, n),
        rng.normal(size=n * inputs),
        -np.abs(rng.normal(size=n)),
        rng.normal(size=inputs),
    ]
    theta += [0.1 * rng.normal(size=n), np.array([-0.1, 0.15])]
    own = {DEAD_ZONE: np.array([0.05]), RELAY: np.ones(1), WAITS: 0.05 * rng.normal(size=n + inputs + 1)}
    numbers = np.concatenate([*theta, own.get(kind, np.zeros(0))])
    loop = Loop(
        kind=kind, states=n, steps=3, sizes=np.full(n, 0.2), theta=numbers, free=np.ones(len(numbers), dtype=bool),
        read=rng.normal(size=(n + 1, outputs)),
    )  # fmt: skip
    runs = [
        (commands(((-1.0, 2.0, 0.5),) * inputs, 60, 10 * seed + k), rng.normal(size=(60, outputs))) for k in range(2)
    ]
    scaled = Scaled.of(runs)
    assert scaled is not None
    return Found(left=0.0, scaled=scaled, loop=loop)


@pytest.mark.parametrize("kind", [DEAD_ZONE, SATURATION, WAITS, RELAY])
@given(seed=st.integers(0, 10_000), inputs=st.integers(1, 2), outputs=st.integers(1, 2))
@settings(max_examples=5, deadline=None)
def test_the_equations_of_a_loop_run_as_its_kernel_does(kind: int, seed: int, inputs: int, outputs: int) -> None:
    found = drawn(kind, seed, inputs, outputs)
    names = ["u 1", "max", "y", "t"]
    mapping = Mapping(inputs=tuple(names[:inputs]), outputs=tuple(names[2 : 2 + outputs]))
    channels = tuple(Channel(name=one, unit="1") for one in mapping.channels)
    scaled = found.scaled
    plain = [(scaled.begin + scaled.reach * u, scaled.rest + scaled.span * y) for u, y in scaled.records]
    traces = tuple(
        Trace(name=f"r{k}", sample_time=1.0, channels=channels, values=np.hstack(run)) for k, run in enumerate(plain)
    )
    known = TraceSet(name="runs", traces=traces, roles={one.name: Role.ESTIMATION for one in traces})
    structure = grey_box_of(found, mapping)
    fit = sysid.fit(known, mapping, structure, sysid.Training(starts=1), stability=None)
    samples = scaled.first(60)
    wanted = (scaled.rest + scaled.span * found.loop.outputs(samples)).reshape(2, 60, outputs)
    for k, (u, _) in enumerate(plain):
        np.testing.assert_allclose(fit.model.simulate(u), wanted[k], rtol=1e-9, atol=1e-9)


def test_a_law_that_most_samples_follow_is_found_with_its_rates() -> None:
    scaled = Scaled.of(records("heater", 12))
    assert scaled is not None
    law = law_of([(u, y[:, 0]) for u, y in scaled.records], order=2)
    assert law is not None
    assert 0.2 < law.share < 0.9
    assert len(law.rates) == 2
    assert replace(law, past=np.array([1.0, -0.9])).rates == []
