"""The way in: what is recorded, what is refused, and what a train does that the acceptance set does not ask."""

import numpy as np
import pytest

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import Probe
from sysid.airbrake.simulate import simulate
from sysid.airbrake.variant import LISTING, PHYSICAL, Variant
from sysid.errors import ConfigError, StabilityError

SERVICE = Command.from_rows([[0, 90], [1, 70], [60, 90]])
ONE = Consist(pairs=1)


def test_a_train_left_alone_stays_as_it_is() -> None:
    record = simulate(Command.from_rows([[0, 90], [60, 90]]), consist=Consist(pairs=3), variant=PHYSICAL)
    np.testing.assert_array_equal(record.pressures, np.broadcast_to(record.pressures[0], record.pressures.shape))
    assert record.gauge_psi("pipe", 7)[0] == pytest.approx(90.0)
    assert record.gauge_psi("cylinder", 3)[0] == 0.0


def test_only_the_probes_asked_for_are_recorded() -> None:
    probes = (Probe(quantity="cylinder", node=5), Probe(quantity="pipe", node=2))
    record = simulate(SERVICE, consist=Consist(pairs=2), probes=probes)
    everything = simulate(SERVICE, consist=Consist(pairs=2))
    assert record.pressures.shape == (600, 2)
    np.testing.assert_array_equal(record["cylinder", 5], everything["cylinder", 5])
    np.testing.assert_array_equal(record["pipe", 2], everything["pipe", 2])
    with pytest.raises(ConfigError, match="was not recorded"):
        record.gauge_psi("pipe", 3)


def test_a_sample_is_the_mean_of_its_steps() -> None:
    fine = simulate(SERVICE, consist=ONE, sample_time=1e-3)
    coarse = simulate(SERVICE, consist=ONE, sample_time=0.1)
    np.testing.assert_allclose(coarse.pressures, fine.pressures.reshape(600, 100, -1).mean(axis=1), rtol=1e-12)


def test_the_same_command_gives_the_same_bits() -> None:
    first, second = (simulate(SERVICE, consist=Consist(pairs=5)).pressures.tobytes() for _ in range(2))
    assert first == second


@pytest.mark.parametrize(
    # The listing's pipe chatters by hundredths of a psi about whatever it stands at.
    ("variant", "margin"),
    [(LISTING, 0.1), (PHYSICAL, 1e-6)],
    ids=["listing", "physical"],
)
@pytest.mark.parametrize("quantity", ["pipe", "auxiliary", "emergency", "cylinder", "action"])
def test_pressures_stay_between_atmosphere_and_supply(variant: Variant, margin: float, quantity: str) -> None:
    command = Command.from_rows([[0, 90], [5, 60], [40, 90], [100, 0], [150, 90], [300, 90]])
    record = simulate(command, consist=Consist(pairs=4), variant=variant)
    for node in Consist(pairs=4).valve_nodes:
        pressure = record.gauge_psi(quantity, node)
        assert pressure.min() >= -margin
        assert pressure.max() <= 90.0 + margin


def test_a_small_rise_of_the_pipe_releases_nothing_and_a_larger_one_everything() -> None:
    def cylinder(rise: float) -> float:
        command = Command.from_rows([[0, 90], [1, 75], [40, 75 + rise], [140, 90]])
        return float(simulate(command, consist=ONE).gauge_psi("cylinder", 3)[-1])

    assert cylinder(1.0) > 30.0
    assert cylinder(3.0) < 0.5


def test_full_service_on_a_short_train_is_no_emergency() -> None:
    record = simulate(Command.from_rows([[0, 90], [1, 64.2], [60, 90]]), consist=ONE)
    assert record.gauge_psi("emergency", 3).min() == pytest.approx(90.0)
    emergency = simulate(Command.from_rows([[0, 90], [1, 0], [60, 90]]), consist=ONE)
    assert emergency.gauge_psi("emergency", 3).min() < 80.0


def test_a_train_at_rest_recharges_as_printed() -> None:
    record = simulate(SERVICE, consist=ONE, variant=LISTING, speed=0.0)
    assert record.gauge_psi("cylinder", 3).max() == 0.0
    physical = simulate(SERVICE, consist=ONE, variant=PHYSICAL, speed=0.0)
    assert physical.gauge_psi("cylinder", 3).max() > 40.0


def test_speed_may_change_under_way() -> None:
    speed = np.where(np.arange(600) < 300, 10.0, 0.0)
    record = simulate(SERVICE, consist=ONE, variant=LISTING, speed=speed)
    assert record.gauge_psi("cylinder", 3)[299] > 40.0
    assert record.gauge_psi("cylinder", 3)[-1] < 20.0


def test_a_vent_at_the_tail_brakes_from_the_rear() -> None:
    command = Command.from_rows([[0, 90], [10, 90]])
    tail = np.where(np.arange(100) < 10, 0.0, 2.85e-4)  # m2: the 3/4 in valve of 49 CFR 232.405
    record = simulate(command, consist=Consist(pairs=30), tail_vent=tail)
    last, first = (int(np.argmax(record.gauge_psi("cylinder", node) > 1.0)) for node in (61, 3))
    assert 0 < last < first


@pytest.mark.parametrize("place", [10, 20], ids=["inside", "last"])
def test_a_second_locomotive_applies_the_brakes_behind_it_sooner(place: int) -> None:
    command = Command.from_rows([[0, 90], [1, 70], [30, 70]])
    alone, helped = Consist(pairs=20), Consist(pairs=20, locomotives=(place,))
    plain = simulate(command, consist=alone).gauge_psi("cylinder", alone.valve_nodes[-1])
    two = simulate(command, consist=helped).gauge_psi("cylinder", helped.valve_nodes[-1])
    assert np.argmax(two > 10.0) < np.argmax(plain > 10.0)


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({"time_step": 2e-3}, StabilityError, "too large"),
        ({"time_step": 0.0}, StabilityError, "too large"),
        ({"time_step": 7e-4}, StabilityError, "whole number of time steps"),
        ({"consist": Consist(pairs=1, running_pressure=70.0)}, ConfigError, "exceeds the running pressure"),
        ({"probes": (Probe(quantity="cylinder", node=2),)}, ConfigError, "no cylinder pressure at node 2"),
        ({"probes": (Probe(quantity="pipe", node=99),)}, ConfigError, "no pipe pressure at node 99"),
        ({"probes": (Probe(quantity="steam", node=1),)}, ConfigError, "no steam pressure"),
        ({"speed": np.zeros(3)}, ConfigError, "speed does not fit"),
        ({"tail_vent": -1.0}, ConfigError, "tail_vent does not fit"),
    ],
    ids=["step", "no step", "odd step", "overcharge", "no valve there", "no such car", "quantity", "speed", "vent"],
)
def test_what_cannot_be_simulated_is_refused(options: dict, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        simulate(SERVICE, **({"consist": ONE} | options))


def test_a_finer_step_is_asked_for_where_the_laminar_branch_is_steeper() -> None:
    with pytest.raises(StabilityError, match=r"at most 0\.66"):
        simulate(SERVICE, consist=ONE, variant=PHYSICAL.with_options({"laminar_ratio": 0.999}))
