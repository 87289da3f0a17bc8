"""Consequences: scenarios with the reference, a surrogate and a brake of known error; figures and how they compare."""

import dataclasses
import json
import math

import numpy as np
import pytest

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import RecordedBrake, ReferenceBrake, no_brake
from sysid.rail.dynamics.drive import Limits, Schedule, drive
from sysid.rail.dynamics.motion import MovingTrain
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train, heavy_haul
from sysid.rail.dynamics.vehicle import Davis, Rigging, Shoe, Vehicle
from sysid.rail.end_of_train.tail_unit import TwoEndedBrake
from sysid.rail.judging.judge import (
    ErringBrake,
    ErrorSensitivity,
    compare,
    cylinder_mse,
    error_sensitivity,
    tolerable_mse,
)
from sysid.rail.judging.scenario_catalogue import standard_scenarios
from sysid.rail.judging.scenarios import Consequence, Scenario, consequence
from sysid.units import PSI_IN_PA

SHORT = Consist(pairs=5)
TRAIN = heavy_haul(pairs=5)
SCENARIOS = standard_scenarios(TRAIN)


def reference() -> ReferenceBrake:
    return ReferenceBrake(consist=SHORT)


@pytest.fixture(scope="module")
def consequences() -> dict[str, Consequence]:
    return {name: consequence(scenario, scenario.run(reference())) for name, scenario in SCENARIOS.items()}


# --- figures


def test_a_stop_with_a_constant_force_has_its_closed_form() -> None:
    rigging = Rigging(spring_pressure=0.0, shoe=Shoe(base=0.3, slope=1.0))
    vehicle = Vehicle(mass=100e3, length=10.0, davis=Davis(a=0.0, b=0.0, c=0.0), rigging=rigging)
    train = Train(vehicles=(vehicle, vehicle))
    rate = 0.3 * rigging.shoe_force(3e5) / 100e3
    scenario = Scenario(
        name="stop",
        train=train,
        track=TrackProfile.level(),
        command=Command.from_rows([[0, 90]], duration=100.0),
        speed=20.0,
    )
    found = consequence(scenario, scenario.run(RecordedBrake(pressures=np.full((1, 2), 3e5), sample_time=0.1)))
    assert found.stopped
    assert found.distance == pytest.approx(200.0 / rate, rel=1e-4)
    assert found.time == pytest.approx(20.0 / rate, abs=0.2)
    assert found.deceleration == pytest.approx(rate, rel=1e-3)
    assert found.largest_force < 1.0


def test_every_scenario_stops_and_its_figures_are_json(consequences: dict[str, Consequence]) -> None:
    for name, found in consequences.items():
        assert found.stopped, name
        assert json.loads(json.dumps(found.to_dict()))["scenario"] == name
        assert found.draft.force >= 0.0 >= found.buff.force


def test_stopping_distances_stand_in_the_order_of_their_scenarios(consequences: dict[str, Consequence]) -> None:
    distance = {name: found.distance for name, found in consequences.items()}
    assert distance["emergency"] < distance["full service"] < distance["half service"]
    assert distance["sag, full service"] < distance["full service"] < distance["crest, full service"]
    assert distance["curve, full service"] < distance["full service"]


def test_braking_from_the_front_bunches_and_both_ends_bunch_less() -> None:
    consist, train = Consist(pairs=50), heavy_haul(pairs=50)
    scenario = standard_scenarios(train)["emergency"]
    head = consequence(scenario, scenario.run(ReferenceBrake(consist=consist)))
    both = consequence(scenario, scenario.run(TwoEndedBrake(ReferenceBrake(consist=consist))))
    assert both.distance < head.distance
    assert -both.buff.force < -head.buff.force
    assert head.buff.force < -1e5


def test_notches_are_set_at_their_times() -> None:
    scenario = dataclasses.replace(
        SCENARIOS["full service"],
        notch=((0.0, 0), (2.0, 4), (5.0, -8)),
        command=Command.from_rows([[0, 90]], duration=8.0),
    )
    run = scenario.run(no_brake(11))
    assert [run.notch[k] for k in (0, 19, 20, 49, 50, 79)] == [0, 0, 4, 4, -8, -8]
    assert run.traction_work > 0.0


def test_a_drive_ends_when_all_stand_still() -> None:
    run = SCENARIOS["full service"].run(reference())
    assert run.motion.time[-1] < 399.0
    assert np.abs(run.motion.speeds[-1]).max() < 0.01


def test_a_schedule_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ConfigError, match="notch does not fit"):
        Schedule(handle=np.full(5, 90.0), notch=np.zeros(4, dtype=np.int64), sample_time=0.1)


def test_a_brake_of_another_train_is_refused() -> None:
    moving = MovingTrain(train=TRAIN, track=TrackProfile.level())
    schedule = Schedule(handle=np.full(5, 90.0), sample_time=0.1)
    with pytest.raises(ConfigError, match="does not fit the train"):
        drive(moving, no_brake(7), schedule, Limits(duration=1.0))


# --- comparison

TWO = {name: SCENARIOS[name] for name in ("full service", "emergency")}


def test_a_brake_compared_with_itself_has_no_consequence() -> None:
    same = compare(TWO, reference=reference, other=reference)
    for difference in same.differences.values():
        assert (difference.mse, difference.distance, difference.time, difference.force) == (0.0, 0.0, 0.0, 0.0)
    assert json.loads(json.dumps(same.to_dict()))["emergency"]["mse_psi2"] == 0.0


def test_a_record_of_the_reference_has_no_consequence() -> None:
    run = TWO["full service"].run(reference())
    record = compare(
        {"full service": TWO["full service"]},
        reference=reference,
        other=lambda: RecordedBrake(pressures=run.cylinders, sample_time=0.1),
    )
    assert record.worst("distance") == 0.0
    assert record.worst("force") == 0.0


@pytest.mark.parametrize("bias", [-2.0, 2.0], ids=["too little", "too much"])
def test_a_bias_has_its_mean_square_error_and_its_sign(bias: float) -> None:
    erring = compare(TWO, reference=reference, other=lambda: ErringBrake(reference(), bias=bias))
    for difference in erring.differences.values():
        # Empty cylinders have no error: the mean is over less than the whole run.
        assert 0.5 * bias**2 < difference.mse <= bias**2
        assert np.sign(difference.distance) == -np.sign(bias)
        assert 0.002 < abs(difference.distance) < 0.1


def test_noise_has_the_spread_asked_for_and_comes_from_its_seed() -> None:
    command = np.full(4000, 64.2)
    plain = reference().advance(command).cylinders
    noisy = [ErringBrake(reference(), noise=1.0, seed=seed).advance(command).cylinders for seed in (1, 1, 2)]
    error = (noisy[0] - plain)[500:, 1:] / PSI_IN_PA
    assert error.std() == pytest.approx(1.0, rel=0.1)
    np.testing.assert_array_equal(noisy[0], noisy[1])
    assert not np.array_equal(noisy[0], noisy[2])


def test_the_tolerable_error_is_where_the_consequence_passes_the_limit() -> None:
    series = [error_sensitivity(TWO, reference=reference, size=size) for size in (0.1, 0.4, 1.6, 6.4)]
    worst = [one.distance for one in series]
    assert worst == sorted(worst)
    assert worst[0] < 0.01 < worst[-1]
    found = tolerable_mse(series)
    assert max(r.mse for r in series if r.distance <= 0.01) <= found <= min(r.mse for r in series if r.distance > 0.01)


def test_where_no_error_or_every_error_is_tolerable_that_is_said() -> None:
    one = ErrorSensitivity(size=1.0, mse=1.0, distance=0.02, time=0.0, force=0.5)
    assert math.isnan(tolerable_mse([one]))
    assert tolerable_mse([one], figure="time") == math.inf


def test_the_mean_square_error_is_over_the_braked_vehicles() -> None:
    run = TWO["full service"].run(reference())
    other = dataclasses.replace(run, cylinders=run.cylinders + PSI_IN_PA)
    assert cylinder_mse(run, other) == pytest.approx(1.0)


@pytest.mark.parametrize("wrong", [{"noise": -1.0}, {"time_constant": 0.0}])
def test_impossible_errors_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match="error of a brake"):
        ErringBrake(reference(), **wrong)


def test_an_unknown_figure_is_refused() -> None:
    with pytest.raises(ConfigError, match="unknown figure"):
        compare({}, reference=reference, other=reference).worst("comfort")
