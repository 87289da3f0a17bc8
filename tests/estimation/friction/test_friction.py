"""What dry friction holds is found, and its equations come to it; what stands for another reason is left alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import sysid
from sysid.estimation.friction import found_friction, grey_boxes_of
from sysid.models import Mapping
from sysid.traces import Channel, Role, Trace, TraceSet

Array = NDArray[np.float64]
H, STEPS = 0.05, 50


def sledge(inputs: Array) -> Array:
    """A motor that lags pushes a sledge between stops, against Coulomb friction; place."""
    current, v, x, found, dt = 0.0, 0.0, 0.0, [], H / STEPS
    for volts in inputs[:, 0]:
        for _ in range(STEPS):
            current += dt / 0.1 * (volts - 0.2 * v - current)
            free = v + dt * (current - 0.5 * v)
            v = np.sign(free) * max(abs(free) - dt * 0.6, 0.0)
            x = x + dt * v
            if abs(x) > 0.6:
                x, v = np.clip(x, -0.6, 0.6), 0.0
        found.append((x,))
    return np.array(found)


def pulled(inputs: Array) -> Array:
    """A block on a table behind a spring that is pulled, which sticks harder than it slips; force, place and speed."""
    v = x = end = 0.0
    found, dt = [], H / STEPS
    for pull in inputs[:, 0]:
        for _ in range(STEPS):
            end += dt * pull
            rubs = 4.0 + 2.0 * np.exp(-((v / 0.05) ** 2))
            free = v + dt * (20.0 * (end - x) - 0.5 * v)
            v = np.sign(free) * max(abs(free) - dt * rubs, 0.0)
            x += dt * v
        found.append((20.0 * (end - x), x, v))
    return np.array(found)


def lag(inputs: Array) -> Array:
    """Stands where its input stands, and is held by nothing."""
    y, found = 0.0, []
    for u in inputs[:, 0]:
        y += 0.5 * (u - y)
        found.append((y,))
    return np.array(found)


def tank(inputs: Array) -> Array:
    """Stands at its edges alone."""
    level, found = 0.0, []
    for u in inputs[:, 0]:
        level = min(max(level + 0.1 * u, 0.0), 1.0)
        found.append((level,))
    return np.array(found)


def noisy(inputs: Array) -> Array:
    """A sledge whose place is measured with noise never stands."""
    return sledge(inputs) + 1e-3 * np.random.default_rng(7).standard_normal((len(inputs), 1))


def dead_band(inputs: Array) -> Array:
    """Always stands at the same place while its input moves on."""
    drawn = np.abs(np.sin(np.arange(len(inputs)) / 9.0))[:, np.newaxis] * inputs
    return np.sign(drawn) * np.maximum(np.abs(drawn) - 0.8, 0.0)


def coarse(inputs: Array) -> Array:
    """Stands at a few places until its input has moved on by a step of the sensor."""
    return np.round(5.0 * lag(inputs)) / 5.0


def records(plant: Callable[[Array], Array], reach: float, runs: int = 8) -> list[tuple[Array, Array]]:
    found = []
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        u = np.concatenate([np.zeros(3), rng.uniform(-reach, reach, 20).repeat(15)])[:, np.newaxis]
        found.append((u, plant(u)))
    return found


def test_a_sledge_is_found_with_its_stops_and_its_equations_come_to_it() -> None:
    near = free_runs(sledge, 1.5, ("u",), ("x",), which=0)
    assert near < 0.003


def test_a_block_that_sticks_harder_than_it_slips_is_found_beside_its_force_and_speed() -> None:
    # One is a word of the language, one has the prefix that names of ours have.
    assert free_runs(pulled, 1.5, ("t",), ("force", "max", "f_speed"), which=0) < 0.02


def free_runs(
    plant: Callable[[Array], Array], reach: float, inputs: tuple[str, ...], outputs: tuple[str, ...], *, which: int
) -> float:
    """Error of new free runs of what is found and fitted, a share of the range, the worst of some."""
    runs = records(plant, reach, 12)
    mapping, channels = (
        Mapping(inputs=inputs, outputs=outputs),
        [Channel(name=n, unit="1") for n in (*inputs, *outputs)],
    )
    found = found_friction(runs[:8])
    assert found is not None
    traces = [
        Trace(name=f"r{k}", sample_time=H, channels=tuple(channels), values=np.hstack(one))
        for k, one in enumerate(runs)
    ]
    roles = {f"r{k}": Role.ESTIMATION if k < 8 else Role.TEST for k in range(12)}
    training = sysid.Training(starts=1, shooting="growing", max_iterations=100)
    rest = found.rest[0] if len(outputs) == 1 else dict(zip(outputs, found.rest, strict=True))
    data = TraceSet(name="runs", traces=tuple(traces), roles=roles)
    fit = sysid.fit(data, str(mapping), grey_boxes_of(found, mapping)[which], training, start="rest", rest_output=rest)
    span = np.ptp(np.concatenate([y for _, y in runs]), axis=0)
    off = [np.asarray(fit.model.simulate(u)).reshape(y.shape) - y for u, y in runs[8:]]
    return max(float((np.sqrt(np.mean(one**2, axis=0)) / span).max()) for one in off)


def test_stops_are_those_that_are_met_and_not_where_it_happens_to_stand() -> None:
    found = found_friction(records(sledge, 1.5))
    assert found is not None
    assert found.ends == (-0.6, 0.6)
    free = found_friction(records(pulled, 1.5))
    assert free is not None
    assert (free.output, free.ends) == (1, (None, None))
    assert [(one.output, bool(one.by_inputs)) for one in free.beside] == [(0, True), (2, False)]


@pytest.mark.parametrize("plant", [lag, tank, noisy, dead_band, coarse])
def test_what_stands_for_another_reason_or_never_is_left_alone(plant: Callable[[Array], Array]) -> None:
    assert found_friction(records(plant, 1.5)) is None


def test_what_comes_late_is_held_by_nothing() -> None:
    """Through a curve, and seven samples late: it stands while its input moves on, as that stood before."""
    runs = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        turns = np.cumsum(rng.integers(5, 30, 20))
        u = np.interp(np.arange(300), turns, np.repeat(rng.uniform(-1.5, 1.5, 10), 2))[:, np.newaxis]
        u -= u[0]
        runs.append((u, np.tanh(np.vstack([np.zeros((7, 1)), u[:-7]]))))
    assert found_friction(runs) is None


def test_records_that_begin_at_several_places_or_have_no_input_are_left_alone() -> None:
    runs = records(sledge, 1.5)
    shifted = [(u, y + 0.1 * k) for k, (u, y) in enumerate(runs)]
    assert found_friction(shifted) is None
    assert found_friction([(u[:, :0], y) for u, y in runs]) is None
    assert found_friction([]) is None
