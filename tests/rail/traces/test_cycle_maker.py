"""Command sequences by drivers and by the deceleration controller, as a data set."""

import numpy as np
import pytest
from pydantic import ValidationError

from sysid.ingest.datasets.description import DatasetDescription
from sysid.rail.constants import MPH
from sysid.rail.traces.cycle_maker import MAKER, CycleOptions
from sysid.rail.traces.stop_cycles import characteristic_of, handle_of_signal, servo, speed_commands, stop_cycle

CHANNELS = [{"name": "STP", "unit": "psi", "reference": "gauge"}, {"name": "BC", "unit": "psi", "reference": "gauge"}]


def options(**case: object) -> CycleOptions:
    first = {"name": "A", "role": "selection", "driver": "controller", "seed": 4, "duration": 120.0, **case}
    return CycleOptions(pairs=2, channels=CHANNELS, quantities={"STP": "command", "BC": {"cylinder": 3}}, cases=[first])


@pytest.mark.parametrize("driver", ["habits", "notches", "controller"])
def test_what_a_driver_does_becomes_a_data_set(driver: str) -> None:
    chosen = options(driver=driver, name=driver)
    (step,) = MAKER.steps(chosen)
    results = {step.name: step.run()}
    fields = MAKER.dataset(chosen, results)
    description = DatasetDescription.model_validate({"name": "made", **fields})
    recipe = description.cases[driver].recipe
    assert recipe is not None
    assert recipe["duration"] == 120.0
    assert recipe["command"][0] == [0.0, 90.0]
    # The dynamic brake alone holds so light a train.
    assert (len(recipe["command"]) > 1) == (driver != "notches")
    assert driver in description.provenance


def test_a_seed_is_a_cycle_and_another_is_another() -> None:
    first, again, other = (stop_cycle(seed, 200.0) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_friction_and_grade_are_the_controllers() -> None:
    handles = [MAKER.steps(options(friction=friction, grade=-0.01))[0].run() for friction in (0.7, 1.3)]
    assert handles[0] != handles[1]
    with pytest.raises(ValidationError, match="are the controller's"):
        options(driver="habits", friction=0.7)


def test_a_direct_release_brake_is_never_let_off_in_part() -> None:
    handle = stop_cycle(1, 400.0)
    up = np.flatnonzero(np.diff(handle) > 0.0)
    assert len(up) > 1
    assert (handle[up + 1] == 90.0).all()
    assert set(np.round(90.0 - np.unique(handle), 6)) <= {0.0, *(round(5.8 + 2.0 * k, 6) for k in range(11)), 25.8}


def test_full_service_is_asked_for_at_20_ma() -> None:
    assert handle_of_signal(np.array([20.0, 60.0, 59.0])).tolist() == [64.2, 90.0, 84.2]


def test_the_controller_s_plant_has_the_source_s_points() -> None:
    characteristic = characteristic_of(servo())
    for rate, signal in ((2.0, 43.0), (5.0, 20.0)):
        assert characteristic.signal(rate * MPH) == pytest.approx(signal, abs=0.4)


def test_speed_commands_change_and_are_held() -> None:
    commands = speed_commands(3, 500.0)
    assert len(commands) == 5000
    moves = np.flatnonzero(np.diff(commands)) + 1
    assert (np.diff(moves) * 0.1 >= 20.0 - 0.1).all()
    assert commands[0] == 40.0 * MPH


def test_two_cases_of_one_name_are_refused() -> None:
    case = {"name": "A", "role": "test", "driver": "habits", "seed": 1}
    with pytest.raises(ValidationError, match="name of its own"):
        CycleOptions(channels=CHANNELS, quantities={}, cases=[case, case])
