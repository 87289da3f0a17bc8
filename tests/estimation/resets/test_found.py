"""What is linear between events is found exactly, whatever its events are; what is not is left alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import sysid
from sysid.estimation.resets import ResetMap, derived_from, found_resets, grey_box_of
from sysid.estimation.resets.found import simplest
from sysid.models import Mapping, Start

Array = NDArray[np.float64]
Reference = Callable[[Array], Array]
"""Inputs, shape ``(n, n_inputs)``, to outputs."""


def ball(steps: int) -> Reference:
    """Let go at 1 m, with the share of its speed that an impact leaves as an input; it looks for impacts so often."""

    def run(inputs: Array) -> Array:
        h, v, found, dt = 1.0, 0.0, [], 0.01 / steps
        moves = True
        for e in inputs[:, 0]:
            for _ in range(steps):
                h, v = (h + dt * v, v - 9.81 * dt) if moves else (h, v)
                if h <= 0.0 and v < 0.0:
                    h, v = 0.0, -e * v
                    moves = v >= 0.1
                    v = v if moves else 0.0
            found.append((h, v))
        return np.array(found)

    return run


def neuron(inputs: Array) -> Array:
    """Charges towards its input, and is emptied at 1."""
    y, found = 0.0, []
    for u in inputs[:, 0]:
        y += 0.05 * (u - y)
        y = 0.0 if y >= 1.0 else y
        found.append((y,))
    return np.array(found)


def between_walls(inputs: Array) -> Array:
    """Driven by a force, and thrown back at -1 and at 2 with 0.9 and 0.7 of its speed."""
    x, v, found = 0.0, 0.0, []
    for force in inputs[:, 0]:
        x, v = x + 0.02 * v, v + 0.02 * (force - 0.3 * v)
        x, v = (-1.0, -0.9 * v) if x <= -1.0 else (2.0, -0.7 * v) if x >= 2.0 else (x, v)
        found.append((x, v))
    return np.array(found)


def thermostat(looks: int, *, first: bool) -> Reference:
    """Heats from half a degree below the second input to half a degree above it; looks before it moves, or behind."""

    def run(inputs: Array) -> Array:
        temp, on, found = 18.0, 0.0, []

        def switched(off: float) -> float:
            return 1.0 if off < -0.5 else 0.0 if off > 0.5 else on

        for outside, wanted in inputs:
            for _ in range(looks):
                on = switched(temp - wanted) if first else on
                temp += (0.02 * (outside - temp) + 0.7 * on) / looks
                on = on if first else switched(temp - wanted)
            found.append((temp, on))
        return np.array(found)

    return run


def relay(inputs: Array) -> Array:
    """Goes on above 2 and off below 1 of its input; it has no other state."""
    on, found = 0.0, []
    for u in inputs[:, 0]:
        on = 1.0 if u > 2.0 else 0.0 if u < 1.0 else on
        found.append((on,))
    return np.array(found)


def flushed(inputs: Array) -> Array:
    """Two tanks, the upper of which is flushed at a level into the lower, the less the wider that is."""
    upper, lower, found = 0.0, 0.0, []
    for pump, area in inputs:
        upper, lower = upper + 0.05 * (pump - 0.4 * upper), lower + 0.05 * (0.4 * upper - 0.3 * lower)
        upper, lower = (0.2, lower + 0.3 / area) if upper >= 1.0 else (upper, lower)
        found.append((upper, lower))
    return np.array(found)


def beside(low: float, high: float, *, stands: bool) -> Callable[[np.random.Generator, Array], Array]:
    """A second input: it stands over a record, or begins at 18 as in all of them, and is held from place to place."""

    def with_other(rng: np.random.Generator, inputs: Array) -> Array:
        if stands:
            return np.hstack([inputs, np.full((len(inputs), 1), rng.uniform(low, high))])
        return np.vstack([[inputs.mean(), 18.0], np.hstack([inputs, held(rng, low, high, 15)])[1:]])

    return with_other


def held(rng: np.random.Generator, low: float, high: float, each: int, n: int = 300) -> Array:
    return np.repeat(rng.uniform(low, high, (n // each, 1)), each, axis=0)


REFERENCES = {
    "ball, by the sample": (ball(1), 0.5, 0.9, 300),
    "ball, ten times a sample": (ball(10), 0.6, 0.9, 300),
    "neuron": (neuron, 0.5, 3.0, 20),
    "between walls": (between_walls, -12.0, 12.0, 15),
    "thermostat, by the sample": (thermostat(1, first=False), -5.0, 10.0, 15),
    "thermostat, ten times a sample, looks first": (thermostat(10, first=True), -5.0, 10.0, 15),
    "relay": (relay, 0.0, 3.0, 10),
    "flushed by a quotient": (flushed, 0.3, 1.0, 15),
}


OTHERS = {
    "thermostat, by the sample": beside(16.0, 24.0, stands=False),
    "thermostat, ten times a sample, looks first": beside(16.0, 24.0, stands=False),
    "flushed by a quotient": beside(1.0, 2.0, stands=True),
}
"""Second inputs."""


@cache
def of(name: str) -> tuple[ResetMap | None, list[tuple[Array, Array]]]:
    """What is found in twelve records, and twenty others."""
    run, low, high, each = REFERENCES[name]
    rng = np.random.default_rng(0)
    inputs = [OTHERS.get(name, lambda _, u: u)(rng, held(rng, low, high, each)) for _ in range(32)]
    records = [(u, run(u)) for u in inputs]
    return found_resets(records[:12]), records[12:]


@pytest.mark.parametrize("name", REFERENCES)
def test_what_is_found_runs_as_the_reference_does(name: str) -> None:
    found, others = of(name)
    assert found is not None
    off = [np.sqrt(np.mean((found.run(u) - y) ** 2, axis=0)) / np.ptp(y, axis=0) for u, y in others]
    # Where the ball's last impact is, two of a sample may have been taken for one; it hardly moves then.
    assert np.median(off) < 1e-9
    assert np.max(off) < 2e-3


@pytest.mark.parametrize("name", REFERENCES)
def test_its_equations_run_as_it_does(name: str) -> None:
    found, others = of(name)
    assert found is not None
    u, y = others[0]
    # Words of the language, a quotation mark, and what names of ours would be.
    names = ("and", 'u "2"', "event_0_0", "pi")[: u.shape[1]]
    mapping = Mapping(inputs=names, outputs=("max", "before_0", "y 2")[: found.n_outputs])
    record = sysid.data({"r": (u, y)}, inputs=names, outputs=mapping.outputs, sample_time=0.01, split=["estimation"])
    rest = dict(zip(mapping.outputs, found.begin.tolist(), strict=True))
    fit = sysid.fit(record, mapping, grey_box_of(found, mapping), start=Start(), rest_output=rest)
    np.testing.assert_allclose(np.reshape(fit.simulate(u), y.shape), found.run(u), atol=1e-9)


def test_the_events_are_those_of_the_reference() -> None:
    found, _ = of("ball, ten times a sample")
    assert found is not None
    assert found.rest is not None
    (guard,) = found.guards
    assert (found.steps, guard.row.tolist(), guard.sign, guard.level) == (10, [1.0, 0.0, 0.0], 1, 0.0)
    assert (found.rest.output, found.rest.below, found.rest.values.tolist()) == (1, 0.1, [0.0, 0.0])
    np.testing.assert_allclose(found.begin, [1.0, 0.0], atol=1e-12)
    walls, _ = of("between walls")
    assert walls is not None
    assert sorted((*one.row.tolist(), one.level) for one in walls.guards) == [
        (1.0, 0.0, 0.0, -1.0),
        (1.0, 0.0, 0.0, 2.0),
    ]
    assert walls.rest is None


def test_a_relay_is_its_two_levels_each_while_its_output_is_at_the_other_value() -> None:
    found, _ = of("thermostat, ten times a sample, looks first")
    assert found is not None
    assert (found.steps, found.looks_first) == (10, True)
    told = {
        (one.sign, one.level): (one.row.tolist(), one.armed and (one.armed.output, one.armed.sign))
        for one in found.guards
    }
    assert told == {(1, -0.5): ([1.0, 0.0, 0.0, -1.0], (1, 1)), (-1, 0.5): ([1.0, 0.0, 0.0, -1.0], (1, -1))}
    alone, _ = of("relay")
    assert alone is not None
    assert sorted((one.sign, one.level, *one.row.tolist()) for one in alone.guards) == [
        (-1, 2.0, 0.0, 1.0),
        (1, 1.0, 0.0, 1.0),
    ]


def test_a_quotient_is_looked_for_by_what_stands_still_in_each_record() -> None:
    found, _ = of("flushed by a quotient")
    assert found is not None
    assert found.ratios == ((None, 1), (0, 1))
    assert of("ball, by the sample")[0].ratios == ()  # type: ignore[union-attr]


def test_an_output_in_another_unit_is_written_beside_the_others() -> None:
    """As the height in feet of the ball of FMI 3.0; it stands between the two that are the state."""
    rng = np.random.default_rng(0)
    own = [(u, ball(10)(u)) for u in (held(rng, 0.6, 0.9, 300) for _ in range(12))]
    outputs = [np.column_stack([y[:, 0], 3.28084 * y[:, 0] + 2.0, y[:, 1]]) for _, y in own]
    derived = derived_from(np.concatenate(outputs))
    assert list(derived) == [1]
    np.testing.assert_allclose(derived[1], [3.28084, 0.0, 2.0], atol=1e-9)
    found, mapping = found_resets(own), Mapping.parse("e -> h+feet+v")
    assert found is not None
    record = sysid.data(
        {"r": (own[0][0][:, 0], outputs[0])}, inputs="e", outputs=mapping.outputs, sample_time=0.01,
        split=["estimation"],
    )  # fmt: skip
    grey = grey_box_of(found, mapping, {"feet": derived[1]})
    fit = sysid.fit(record, mapping, grey, start=Start(), rest_output={"h": 1.0, "feet": 5.28084, "v": 0.0})
    run = found.run(own[0][0])
    expected = np.column_stack([run[:, 0], 3.28084 * run[:, 0] + 2.0, run[:, 1]])
    np.testing.assert_allclose(fit.simulate(own[0][0][:, 0]), expected, atol=1e-9)


def smooth(inputs: Array) -> Array:
    """Van der Pol, driven."""
    x, v, found = 1.0, 0.0, []
    for u in inputs[:, 0]:
        x, v = x + 0.05 * v, v + 0.05 * ((1.0 - x**2) * v - x + u)
        found.append((x, v))
    return np.array(found)


def noisy(inputs: Array) -> Array:
    return neuron(inputs) + 1e-3 * np.random.default_rng(1).standard_normal((len(inputs), 1))


def bent(inputs: Array) -> Array:
    """A pendulum against a stop: not linear between its impacts."""
    x, v, found = 1.0, 0.0, []
    for u in inputs[:, 0]:
        x, v = x + 0.05 * v, v + 0.05 * (u - 9.0 * np.sin(x))
        x, v = (-0.5, -0.8 * v) if x <= -0.5 else (x, v)
        found.append((x, v))
    return np.array(found)


@pytest.mark.parametrize("reference", [smooth, noisy, bent, lambda u: 2.0 * u, lambda u: np.zeros((len(u), 1))])
def test_what_is_no_such_thing_is_left_to_the_search(reference: Reference) -> None:
    rng = np.random.default_rng(0)
    assert found_resets([(u, reference(u)) for u in (held(rng, 0.5, 3.0, 20) for _ in range(8))]) is None


def test_records_that_begin_elsewhere_or_are_short_have_none() -> None:
    rng = np.random.default_rng(0)
    records = [(u, neuron(u)) for u in (held(rng, 0.5, 3.0, 20) for _ in range(8))]
    assert found_resets(records) is not None
    assert found_resets([(u[7 * k :], y[7 * k :]) for k, (u, y) in enumerate(records)]) is None
    assert found_resets([(u[:3], y[:3]) for u, y in records]) is None
    assert found_resets([]) is None


@pytest.mark.parametrize(
    ("low", "high", "level"),
    [(-1e-5, 2e-4, 0.0), (0.0993, 0.1012, 0.1), (-2.45, -2.35, -2.4), (0.99, 1.02, 1.0), (1234.5, 1234.6, 1234.5)],
)
def test_a_level_is_the_shortest_number_between(low: float, high: float, level: float) -> None:
    assert simplest(low, high) == level
