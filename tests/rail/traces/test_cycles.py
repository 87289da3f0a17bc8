"""Drive cycles: a driver holds descents by cycles of the brake, and what he did becomes a command vector."""

import numpy as np
import pytest

from sysid.airbrake.consist import Consist
from sysid.airbrake.variant import PHYSICAL
from sysid.errors import ConfigError
from sysid.ingest import find_dataset, load_dataset, read_description
from sysid.rail.constants import KMH
from sysid.rail.dynamics.drive import Run
from sysid.rail.dynamics.train import heavy_haul
from sysid.rail.traces.cycles import HabitSettings, command_of, drive_cycle, rolling_line
from sysid.traces import Role

SEEDS = (1, 2)


@pytest.fixture(scope="module", params=SEEDS)
def cycle(request: pytest.FixtureRequest) -> Run:
    return drive_cycle(heavy_haul(pairs=20), Consist(pairs=20), seed=request.param, duration=600.0)


def test_the_speed_is_held(cycle: Run) -> None:
    assert cycle.speed.max() < 70.0 * KMH
    assert cycle.speed.min() > 20.0 * KMH


def test_the_brake_is_cycled_with_full_releases_and_time_to_recharge(cycle: Run) -> None:
    handle, settings = cycle.handle, HabitSettings()
    assert handle.min() >= settings.running - settings.deepest
    moves = np.flatnonzero(np.diff(handle)) + 1
    up = [k for k in moves if handle[k] > handle[k - 1]]
    assert len(up) >= 2
    assert all(handle[k] == settings.running for k in up)
    for k in up:
        after = moves[moves > k]
        if len(after):
            assert (after[0] - k) * 0.1 >= settings.recharge - 0.1


def test_a_cycle_comes_from_its_seed() -> None:
    runs = [drive_cycle(heavy_haul(pairs=2), Consist(pairs=2), seed=seed, duration=200.0) for seed in (3, 3, 4)]
    np.testing.assert_array_equal(runs[0].handle, runs[1].handle)
    assert not np.array_equal(runs[0].speed, runs[2].speed)


def test_a_command_vector_is_the_handle_again(cycle: Run) -> None:
    command = command_of(cycle.handle, 0.1)
    np.testing.assert_array_equal(command.sampled(sample_time=0.1), cycle.handle)


def test_a_rolling_line_rises_and_falls() -> None:
    grades = rolling_line(5).grades
    assert grades.max() > 0.0 > grades.min()
    assert np.abs(grades).max() <= 0.012


@pytest.mark.parametrize("wrong", [{"first": 0.0}, {"deepest": 95.0}, {"band": 20.0}, {"recharge": -1.0}])
def test_impossible_habits_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="habits"):
        HabitSettings(**wrong)


def test_the_data_set_holds_such_a_cycle() -> None:
    """The first command vector in the data set is the one that the driver makes today on its physics."""
    described = read_description(find_dataset("abdx-drive-cycles"))
    assert {case.role for case in described.cases.values()} == {Role.ESTIMATION, Role.SELECTION}
    traces = load_dataset("abdx-drive-cycles", cases=["CYC01"])
    run = drive_cycle(heavy_haul(pairs=50), Consist(pairs=50), seed=1, duration=250.0, variant=PHYSICAL)
    np.testing.assert_array_equal(traces["CYC01"]["STP"][:2500], run.handle)
