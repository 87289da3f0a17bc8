"""Events as an excitation: in steps, at least so far, taken back in part, with rest between."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sysid.references.config import InputPort
from sysid.references.design import Design
from sysid.references.events import Events

HANDLE = InputPort.model_validate({"unit": "psi", "reference": "gauge", "range": [60, 90], "start": 90})
BRAKE = Events(rest=(20.0, 60.0), steps=3, least=0.2, ends=0.5, back=0.3)


def stretches(x: np.ndarray) -> list[tuple[float, int]]:
    return [(float(level), len(list(some))) for level, some in itertools.groupby(x)]


def test_a_departure_goes_down_in_steps_at_least_so_far_and_rests_between() -> None:
    x = BRAKE.drawn(np.random.default_rng(1), 40_000, 0.5, (10, 30), HANDLE)
    runs = stretches(x)[:-1]  # the last is cut off
    away = [(level, count) for level, count in runs if level != 90.0]
    assert all(40 <= count <= 120 for level, count in runs if level == 90.0)
    assert all(count >= 10 for _, count in away)
    departures = [
        [level for level, _ in some] for out, some in itertools.groupby(runs, lambda one: one[0] != 90.0) if out
    ]
    firsts = [min(levels) for levels in departures]
    assert all(60.0 - 1e-9 <= far <= 84.0 + 1e-9 for far in firsts)
    # Half of them, and a fifth or so of the others that fall there, go to an end.
    ends = np.mean([min(abs(far - 60.0), abs(far - 84.0)) < 1e-9 for far in firsts])
    assert ends == pytest.approx(0.5, abs=0.1)
    assert {1, 2, 3} <= {len(levels) for levels in departures}
    assert any(np.diff(levels)[-1] > 0.0 for levels in departures if len(levels) > 1), "taken back in part"


def test_as_they_are_by_default_each_is_one_level_anywhere_in_the_range() -> None:
    x = Events().drawn(np.random.default_rng(1), 20_000, 0.5, (10, 30), HANDLE)
    away = [(level, count) for level, count in stretches(x)[:-1] if level != 90.0]
    assert all(10 <= count <= 30 for _, count in away)
    assert max(level for level, _ in away) > 88.0


@pytest.mark.parametrize("seed", range(20))
def test_few_departures_go_evenly_far_and_none_of_the_ends_is_missed(seed: int) -> None:
    x = Events().drawn(np.random.default_rng(seed), 4_000, 0.5, (10, 30), HANDLE)
    away = [level for level, _ in stretches(x) if level != 90.0]
    for first in (0, 8, 16):
        assert sorted(np.floor((np.array(away[first : first + 8]) - 60.0) / 30.0 * 8)) == list(range(8))
    x = BRAKE.drawn(np.random.default_rng(seed), 2_000, 0.5, (10, 30), HANDLE)
    assert {60.0, 84.0} <= {round(level, 9) for level, _ in stretches(x)}


def test_times_are_random_or_what_adds_up_would_not_for_long() -> None:
    x = Events(rest=(20.0, 59.5)).drawn(np.random.default_rng(0), 400_000, 0.5, (10, 25), HANDLE)
    rests = np.array([count for level, count in stretches(x) if level == 90.0], dtype=float)
    sums = rests[: len(rests) // 8 * 8].reshape(-1, 8).sum(axis=1)
    assert np.var(sums) == pytest.approx(8 * np.var(rests), rel=0.2)


@pytest.mark.parametrize("options", [{"steps": 0}, {"least": 2.0}, {"rest": [5, 1]}, {"stpes": 2}])
def test_options_that_cannot_be_are_refused(options: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="events cannot be so"):
        Design.model_validate({"duration": 5.0, "excitations": [{"kind": "events", "options": options}]})
