"""The end of the train: orders carried out and refused, self-test, telemetry, and braking from both ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import BrakeOutput, RecordedBrake, ReferenceBrake
from sysid.rail.end_of_train.brake_computer import Message, Order
from sysid.rail.end_of_train.tail_unit import (
    AbstractTestBench,
    Answer,
    SelfTest,
    TailSettings,
    TailUnit,
    Telemetry,
    TwoEndedBrake,
    full_braking_times,
    self_test,
)
from sysid.units import PSI_IN_PA

SETTINGS = TailSettings()


def charged_unit(pressure: float = 88.0) -> TailUnit:
    unit = TailUnit(sample_time=0.1)
    for _ in range(100):
        unit.step(pressure)
    unit.receive(Message(order=Order.UPDATE, time=unit.time))
    return unit


def order(unit: TailUnit, kind: Order, reduction: float = 0.0, age: float = 0.0) -> Answer:
    return unit.receive(Message(order=kind, time=unit.time - age, reduction=reduction))


# --- orders


def test_the_target_follows_the_reduction_at_the_head() -> None:
    unit = charged_unit(88.0)
    assert order(unit, Order.SERVICE, reduction=20.0) is Answer.DONE
    assert unit.target == pytest.approx(68.0)
    assert unit.step(68.0 + SETTINGS.service_band) == SETTINGS.service_area
    assert 0.0 < unit.step(68.0 + 0.1 * SETTINGS.service_band) < 0.2 * SETTINGS.service_area
    assert unit.step(68.0) == 0.0


def test_a_release_lets_go() -> None:
    unit = charged_unit()
    order(unit, Order.SERVICE, reduction=20.0)
    assert order(unit, Order.RELEASE) is Answer.DONE
    assert unit.step(88.0) == 0.0


def test_a_second_minimum_application_is_refused_until_the_release() -> None:
    unit = charged_unit()
    answers = [order(unit, kind, 2.0) for kind in (Order.MINIMUM, Order.MINIMUM, Order.RELEASE, Order.MINIMUM)]
    assert answers == [Answer.DONE, Answer.REPEATED, Answer.DONE, Answer.DONE]


@pytest.mark.parametrize(("fall", "answer"), [(1.9, Answer.DONE), (2.0, Answer.OVERTAKEN), (9.0, Answer.OVERTAKEN)])
def test_a_minimum_application_that_the_pipe_has_overtaken_is_refused(fall: float, answer: Answer) -> None:
    unit = charged_unit(88.0)
    for _ in range(10):
        unit.step(88.0 - fall)
    assert order(unit, Order.MINIMUM, 2.0, age=1.0) is answer


def test_a_fall_before_the_time_stamp_does_not_count() -> None:
    unit = charged_unit(88.0)
    for _ in range(10):
        unit.step(80.0)
    assert order(unit, Order.MINIMUM, 2.0, age=0.5) is Answer.DONE


def test_no_application_before_an_operating_pressure_is_known() -> None:
    unit = TailUnit(sample_time=0.1)
    with pytest.raises(ConfigError, match="no pressure"):
        order(unit, Order.SERVICE, 5.0)
    unit.step(88.0)
    assert order(unit, Order.SERVICE, 5.0) is Answer.UNKNOWN_PRESSURE


def test_the_emergency_valve_stays_open_for_15_s() -> None:
    unit = charged_unit()
    order(unit, Order.EMERGENCY)
    areas = [unit.step(0.0) for _ in range(200)]
    assert areas == [SETTINGS.emergency_area] * 150 + [0.0] * 50


@pytest.mark.parametrize("wrong", [{"emergency_hold": 10.0}, {"emergency_delay": 1.5}, {"service_area": 0.0}])
def test_the_rules_of_232_405_cannot_be_set_aside(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        TailSettings(**wrong)


# --- self-test


class Bench(AbstractTestBench):
    """A volume that leaks at given rates in psi/s, closed and with the supply valve open."""

    def __init__(self, closed: float, opened: float) -> None:
        self.value, self.rates, self.supply, self.log = 90.0, (closed, opened), False, []

    def pressure(self) -> float:
        return self.value

    def wait(self, seconds: float) -> None:
        self.value -= self.rates[self.supply] * seconds

    def release_valve(self, *, opened: bool) -> None:
        self.log.append(("release", opened))

    def supply_valve(self, *, opened: bool) -> None:
        self.supply = opened
        self.log.append(("supply", opened))


@pytest.mark.parametrize(
    ("closed", "opened", "outcome"),
    [
        (0.0, 0.0, SelfTest.HELD),
        (0.1, 0.1, SelfTest.HELD),
        (0.3, 0.0, SelfTest.FAIL_FIRST),
        (0.0, 0.3, SelfTest.FAIL_SECOND),
    ],
    ids=["tight", "within the limit", "leak", "valve does not hold"],
)
def test_the_self_test(closed: float, opened: float, outcome: SelfTest) -> None:
    bench = Bench(closed, opened)
    assert self_test(bench) is outcome
    assert bench.supply is False
    if outcome is not SelfTest.FAIL_FIRST:
        assert bench.log == [("release", True), ("release", False), ("supply", True), ("supply", False)]


# --- telemetry


@given(st.lists(st.floats(0.0, 110.0), min_size=1, max_size=80), st.integers(0, 5))
def test_what_is_shown_is_never_further_off_than_gauge_step_and_delay_allow(values: list[float], seed: int) -> None:
    pressure = np.array(values)
    shown = Telemetry(delay=0.0).reported(pressure, 1.0, seed=seed)
    assert np.abs(shown - pressure).max() <= 3.0 + 2.0


def test_a_steady_pressure_is_reported_every_70_s() -> None:
    rising = 80.0 + np.arange(1000) * 0.001
    shown = Telemetry(accuracy=0.0, delay=0.0).reported(rising, 1.0, seed=0)
    changes = np.flatnonzero(np.diff(shown))
    assert np.diff(changes).tolist() == [70] * (len(changes) - 1)


def test_reports_come_late_by_the_delay_and_may_be_lost() -> None:
    pressure = np.repeat([90.0, 80.0, 70.0], 20)
    late = Telemetry(accuracy=0.0, delay=3.0).reported(pressure, 1.0, seed=0)
    assert late[22], late[23] == (90.0, 80.0)
    lossy = Telemetry(accuracy=0.0, delay=0.0, loss=0.5)
    runs = [lossy.reported(pressure, 1.0, seed=seed)[25] for seed in range(200)]
    assert 0.35 < np.mean(np.array(runs) == 90.0) < 0.65


# --- both ends


def braked(consist: Consist, command: np.ndarray, *, both: bool) -> BrakeOutput:
    brake = ReferenceBrake(consist=consist)
    return (TwoEndedBrake(brake) if both else brake).advance(command)


def test_an_emergency_from_both_ends_of_150_cars_is_complete_in_the_published_16_s() -> None:
    """NASEM 24698, figure F-9: 150 cars on the rack, two ends, all brakes fully actuated after 16 s."""
    command = np.repeat([90.0, 0.0], [20, 600])
    times = {
        both: np.nanmax(
            full_braking_times(braked(Consist(pairs=75), command, both=both).cylinders, 0.1, from_sample=20)
        )
        for both in (True, False)
    }
    assert times[True] == pytest.approx(16.0, abs=1.0)
    assert times[False] > times[True] + 3.0


class Watched(ReferenceBrake):
    """A brake that remembers what was open behind its last vehicle."""

    def advance(self, command: np.ndarray, *, speed: float = 1.0, tail_vent: float = 0.0) -> BrakeOutput:
        self.vents = [*getattr(self, "vents", []), tail_vent]
        return super().advance(command, speed=speed, tail_vent=tail_vent)


@pytest.mark.parametrize(
    ("sample_time", "delay"), [(0.1, 1.0), (0.1, 0.25), (0.1, 0.1), (0.04, 0.5), (0.3, 1.0), (1.0, 1.0)]
)
def test_an_emergency_valve_opens_within_1_s_and_for_15_s_whatever_the_samples(
    sample_time: float, delay: float
) -> None:
    watched = Watched(consist=Consist(pairs=1), sample_time=sample_time)
    brake = TwoEndedBrake(watched, tail=TailSettings(emergency_delay=delay))
    brake.advance(np.repeat([90.0, 0.0], [round(3.0 / sample_time), round(25.0 / sample_time)]))
    message, answer = brake.log[0]
    assert (message.order, answer) == (Order.EMERGENCY, Answer.DONE)
    opened = np.flatnonzero(np.array(watched.vents) == SETTINGS.emergency_area)
    waited = opened[0] * sample_time - message.time
    assert 0.0 < waited <= delay + 1e-9
    assert len(opened) * sample_time >= 15.0 - 1e-9
    assert np.all(np.diff(opened) == 1)


@pytest.mark.parametrize("pairs", [2, 3, 4])
def test_a_short_train_swings_below_the_atmosphere_and_is_not_taken_for_charged(pairs: int) -> None:
    brake = TwoEndedBrake(ReferenceBrake(consist=Consist(pairs=pairs), sample_time=0.02))
    brake.advance(np.repeat([90.0, 0.0], [100, 1500]))
    assert [message.order for message, _ in brake.log] == [Order.EMERGENCY]


def test_samples_that_are_longer_than_the_delay_are_refused() -> None:
    with pytest.raises(ConfigError, match="cannot open the valve of the tail in time"):
        TwoEndedBrake(ReferenceBrake(consist=Consist(pairs=1), sample_time=2.0))


@pytest.mark.parametrize("handle", [84.2, 74.0, 64.2], ids=["minimum", "service", "full service"])
def test_from_both_ends_the_cylinders_hold_what_one_end_gives_them(handle: float) -> None:
    command = np.repeat([90.0, handle], [50, 1500])
    one, two = (braked(Consist(pairs=50), command, both=both).cylinders[-1, 1:] / PSI_IN_PA for both in (False, True))
    np.testing.assert_allclose(two, one, atol=0.05)


def test_a_service_application_from_both_ends_comes_to_the_tail_sooner() -> None:
    command = np.repeat([90.0, 64.2], [20, 900])
    first = {
        both: int(np.argmax(braked(Consist(pairs=50), command, both=both).cylinders[:, -1] > 1e5))
        for both in (True, False)
    }
    assert 0 < first[True] < first[False]


def test_an_application_and_its_release_order_the_tail_in_turn() -> None:
    brake = TwoEndedBrake(ReferenceBrake(consist=Consist(pairs=10)))
    output = brake.advance(np.repeat([90.0, 74.0, 90.0], [20, 400, 1500]))
    orders = [message.order for message, _ in brake.log]
    assert orders[0] is Order.MINIMUM
    assert Order.RELEASE in orders
    assert orders.index(Order.RELEASE) > orders.index(Order.SERVICE)
    assert output.cylinders[-1].max() < 1e4


def test_a_brake_without_a_pipe_cannot_be_braked_from_both_ends() -> None:
    with pytest.raises(ConfigError, match="no pipe pressures"):
        TwoEndedBrake(RecordedBrake(pressures=np.zeros((1, 3)), sample_time=0.1)).advance(np.array([90.0]))
