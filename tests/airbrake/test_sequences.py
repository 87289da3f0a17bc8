"""Random commands stay within their declared range and repeat from their seed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid.airbrake.sequences import RandomCommand
from sysid.errors import ConfigError

SEEDS = st.integers(0, 2**32)


@settings(max_examples=50)
@given(SEEDS, st.floats(5.0, 3000.0))
def test_service_commands_stay_between_full_service_and_release(seed: int, duration: float) -> None:
    command = RandomCommand(duration=duration).draw(seed)
    assert command.duration == duration
    assert command.pressures[0] == 90.0
    assert 64.2 <= min(command.pressures) <= max(command.pressures) <= 90.0
    # Positions are held for at least ten seconds.
    assert np.all(np.diff(command.times) >= 9.9)


@settings(max_examples=30)
@given(SEEDS)
def test_a_seed_is_a_command(seed: int) -> None:
    draws = RandomCommand(duration=900.0, emergency=0.3)
    assert draws.draw(seed) == draws.draw(seed)
    assert draws.draw(seed) != draws.draw(seed + 1)


def test_every_kind_of_braking_is_drawn() -> None:
    commands = [RandomCommand(duration=2000.0, emergency=0.2).draw(seed) for seed in range(20)]
    pressures = {p for command in commands for p in command.pressures}
    assert {0.0, 90.0, 84.2, 64.2} <= pressures
    assert len(pressures) > 50  # and much between
    rises = [(a, b) for c in commands for a, b in zip(c.pressures, c.pressures[1:], strict=False) if 0.0 < a < b < 90.0]
    assert rises  # partial releases


def test_without_emergencies_none_is_drawn() -> None:
    assert all(min(RandomCommand(duration=2000.0).draw(seed).pressures) > 0.0 for seed in range(50))


@pytest.mark.parametrize(
    "limits",
    [
        {"hold": (20.0, 10.0)},
        {"recharge": (0.0, 10.0)},
        {"minimum_reduction": 30.0},
        {"full_reduction": 95.0},
        {"steps": 0},
        {"partial_release": 1.5},
        {"emergency": -0.1},
        {"duration": 0.0},
    ],
    ids=lambda limits: next(iter(limits)),
)
def test_limits_that_are_none_are_refused(limits: dict) -> None:
    with pytest.raises(ConfigError, match=f"{next(iter(limits))} is out of range"):
        RandomCommand(**({"duration": 100.0} | limits))


def test_applications_keep_to_the_positions_they_are_confined_to():
    positions = (84.2, 74.0, 64.2)
    for seed in range(20):
        command = RandomCommand(duration=2000.0, positions=positions, partial_release=0.5).draw(seed)
        assert set(command.pressures) <= {90.0, *positions}
        held = [p for p in command.pressures if p != 90.0]
        assert len(set(held)) >= 2


@pytest.mark.parametrize("positions", [(), (0.0,), (90.0,)], ids=["none", "emergency", "released"])
def test_positions_that_are_no_application_are_refused(positions):
    with pytest.raises(ConfigError, match="positions is out of range"):
        RandomCommand(duration=100.0, positions=positions)
