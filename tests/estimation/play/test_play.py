"""Play of an input is found with its width, and its equations come to the plant; what has none is left alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import sysid
from sysid.estimation.play import found_play, grey_boxes_of
from sysid.models import Mapping
from sysid.traces import Channel, Role, Trace, TraceSet

Array = NDArray[np.float64]
Plant = Callable[[Array], Array]
WIDTH = 0.12


def sticky(inputs: Array) -> Array:
    """A tank that begins half full, with an inflow and a valve whose stem sticks; level and outflow."""
    level, stem, found = 0.5, 0.3, []
    for fill, command in inputs:
        stem = min(max(stem, command - WIDTH), command + WIDTH)
        out = stem * (0.3 + 0.7 * level)
        level += 0.1 * (fill - out)
        found.append((level, out))
    return np.array(found)


def plain(inputs: Array) -> Array:
    """The same without play."""
    level, found = 0.5, []
    for fill, command in inputs:
        out = command * (0.3 + 0.7 * level)
        level += 0.1 * (fill - out)
        found.append((level, out))
    return np.array(found)


def lag(inputs: Array) -> Array:
    """Follows late, which looks like play from afar; what is behind it is not measured."""
    first = y = 0.0
    found = []
    for fill, command in inputs:
        first += 0.2 * (command - first)
        y += 0.2 * (first + 0.1 * fill - y)
        found.append((y, y * y))
    return np.array(found)


def records(plant: Plant, runs: int = 8) -> list[tuple[Array, Array]]:
    found = []
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        u = np.column_stack([np.append([0.3] * 3, rng.uniform(0.0, 0.8, 20).repeat(8)) for _ in range(2)])
        found.append((u, plant(u)))
    return found


def test_play_is_found_with_its_width_and_its_equations_come_to_the_plant() -> None:
    runs = records(sticky, 12)
    found = found_play(runs[:8])
    assert found is not None
    assert found.input == 1
    assert found.width == pytest.approx(WIDTH, rel=0.05)
    names = ("dt", "p_stem", "level", "pi")  # words of the language, and what a name of ours would be
    mapping = Mapping(inputs=names[:2], outputs=names[2:])
    (box, _) = grey_boxes_of(found, runs[:8], mapping)
    channels = tuple(Channel(name=name, unit="1") for name in names)
    traces = tuple(
        Trace(name=f"r{k}", sample_time=1.0, channels=channels, values=np.hstack(one)) for k, one in enumerate(runs)
    )
    roles = {f"r{k}": Role.ESTIMATION if k < 8 else Role.TEST for k in range(12)}
    training = sysid.Training(starts=1, shooting="growing", max_iterations=60)
    rest = dict(zip(names[2:], runs[0][1][0], strict=True))
    fit = sysid.fit(
        TraceSet(name="runs", traces=traces, roles=roles), str(mapping), box, training, start="rest", rest_output=rest
    )
    span = np.ptp(np.concatenate([y for _, y in runs]), axis=0)
    off = [np.sqrt(np.mean((np.asarray(fit.model.simulate(u)) - y) ** 2, axis=0)) / span for u, y in runs[8:]]
    assert np.max(off) < 0.005


@pytest.mark.parametrize("plant", [plain, lag])
def test_what_has_no_play_is_left_alone(plant: Plant) -> None:
    assert found_play(records(plant)) is None


def test_records_that_do_not_fit_are_left_alone() -> None:
    runs = records(sticky)
    assert found_play([]) is None
    assert found_play([(u[:, :0], y) for u, y in runs]) is None
    assert found_play([(u, y + 0.1 * k) for k, (u, y) in enumerate(runs)]) is None
    assert found_play([(np.hstack([u, u, u]), y) for u, y in runs]) is None
    assert found_play([(u, 0.0 * y) for u, y in runs]) is None
