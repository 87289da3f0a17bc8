"""Comfortable deceleration: profile, characteristic found from a trace, controller that learns from stop to stop."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError, TraceError, UnitError
from sysid.estimation import fit_arx
from sysid.models import ARX, AbstractModel, Mapping
from sysid.rail.constants import MPH
from sysid.rail.transit.deceleration import (
    FULL_SERVICE,
    JERK,
    OPEN_LOOP,
    RATE,
    Characteristic,
    JerkProfile,
    grade_acceleration,
    identify_characteristic,
)
from sysid.rail.transit.transit import (
    DecelerationController,
    TransitVehicle,
    commanded_pressure,
    largest_jerk,
    stop_trace,
)
from sysid.traces import Channel, Trace
from sysid.units import Reference
from tests.traces.made import trace_of

STEP = 0.05
CRUISE_TIME, STOP_TIME = 10.0, 18.0


# --- the profile


def test_from_40_to_20_mph_takes_12_s() -> None:
    """20 mph at 2 mph/s and two corners of 1 mph/s2: the ramp active signal of the source lasts 11 to 12 s."""
    profile = JerkProfile(start=40 * MPH, stop=20 * MPH)
    assert profile.duration == pytest.approx(12.0)
    assert profile.corner == pytest.approx(OPEN_LOOP)
    assert profile.deceleration(0.7) == pytest.approx(0.7 * MPH)
    assert profile.deceleration(6.0) == pytest.approx(2.0 * MPH)


@given(
    start=st.floats(1.0, 40.0),
    share=st.floats(0.0, 0.95),
    jerk_rate=st.one_of(st.none(), st.floats(0.2, 5.0)),
)
def test_a_profile_ends_at_its_speed_within_its_limits(start: float, share: float, jerk_rate: float | None) -> None:
    profile = JerkProfile(start=start, stop=share * start, jerk_rate=jerk_rate)
    times = np.linspace(0.0, profile.duration, 401)
    step = times[1]
    rates = np.array([profile.deceleration(t) for t in times])
    speeds = np.array([profile.speed(t) for t in times])
    assert speeds[0] == pytest.approx(start)
    assert speeds[-1] == pytest.approx(share * start, abs=1e-6 * start)
    assert rates.max() <= RATE * (1.0 + 1e-9)
    assert np.abs(np.diff(rates)).max() <= JERK * step * (1.0 + 1e-6)
    if jerk_rate is not None:
        # A second difference over a corner of the jerk is at most its rate.
        assert np.abs(np.diff(rates, 2)).max() <= jerk_rate * step**2 * (1.0 + 1e-6) + 1e-12
    np.testing.assert_allclose(-np.gradient(speeds, step)[1:-1], rates[1:-1], atol=2.0 * JERK * step)


def test_what_is_no_deceleration_is_refused() -> None:
    with pytest.raises(ConfigError, match="not a deceleration"):
        JerkProfile(start=10.0, stop=12.0)


# --- the characteristic


def test_the_source_s_pressures() -> None:
    assert [commanded_pressure(p) for p in (32.0, 28.0, 60.0)] == [17.0, 21.0, 0.0]


def test_an_inverse_is_an_inverse_beyond_the_dead_band() -> None:
    nominal = Characteristic(signals=(60.0, 49.0, 43.0, 32.0, 20.0), decelerations=(0.3, 0.3, 0.9, 1.5, 2.2))
    assert nominal.segments == 4
    for request in np.linspace(0.301, 2.2, 50):
        assert nominal.deceleration(nominal.signal(float(request))) == pytest.approx(request)
    assert nominal.signal(0.2) == 60.0


@pytest.mark.parametrize(
    ("signals", "rates"),
    [((60.0, 20.0), (1.0, 0.5)), ((20.0, 60.0), (0.3, 2.0)), ((60.0,), (0.3,)), ((60.0, 20.0), (1.0, 1.0))],
    ids=["falling", "wrong order", "one point", "flat"],
)
def test_what_is_no_characteristic_is_refused(signals: tuple[float, ...], rates: tuple[float, ...]) -> None:
    with pytest.raises(ConfigError, match="not a brake characteristic"):
        Characteristic(signals=signals, decelerations=rates)


# --- the plant, fitted by the workbench


def pressure_trace() -> Trace:
    """A pneumatic servo: two lags in series, seen by a rig."""
    rng = np.random.default_rng(1)
    asked = np.repeat(rng.uniform(0.0, 29.0, 150), 40)
    first = second = 0.0
    reached = np.zeros(len(asked))
    for k, value in enumerate(asked):
        reached[k] = second
        first, second = first + STEP / 0.15 * (value - first), second + STEP / 0.25 * (first - second)
    channels = tuple(Channel(name=name, unit="psi", reference=Reference.GAUGE) for name in ("PC", "BC"))
    return Trace(name="rig", sample_time=STEP, channels=channels, values=np.column_stack([asked, reached]))


@pytest.fixture(scope="module")
def surrogate() -> AbstractModel:
    fit = fit_arx([pressure_trace()], Mapping.parse("PC -> BC"), ARX(na=2, nb=(2,), nk=(1,)), rest_output=0.0)
    assert fit.model is not None
    return fit.model


def slow_trace(surrogate: AbstractModel) -> Trace:
    vehicle = TransitVehicle(model=surrogate, speed=2000.0)
    signals = np.concatenate([np.full(100, 60.0), np.linspace(60.0, 20.0, 8000)])
    rates = []
    for signal in signals:
        vehicle.step(float(signal))
        rates.append(-vehicle.acceleration)
    return trace_of({"P": signals, "A": rates}, name="slow", sample_time=STEP, units={"P": "mA", "A": "m/s^2"})


@pytest.fixture(scope="module")
def characteristic(surrogate: AbstractModel) -> Characteristic:
    return identify_characteristic(slow_trace(surrogate))


@pytest.mark.parametrize(("rate", "signal"), [(0.5, 60.0), (2.0, 43.0), (5.0, 20.0)])
def test_the_characteristic_found_from_a_trace_has_the_source_s_points(
    characteristic: Characteristic, rate: float, signal: float
) -> None:
    assert characteristic.segments == 4
    assert characteristic.signal(rate * MPH) == pytest.approx(signal, abs=0.3)


@pytest.mark.parametrize(("unit", "scale"), [("A", 1e-3), ("mA", 1.0)])
def test_the_trace_may_have_its_signal_in_another_unit(
    surrogate: AbstractModel, characteristic: Characteristic, unit: str, scale: float
) -> None:
    """Its numbers had been taken for mA, whatever its unit."""
    trace = slow_trace(surrogate)
    channels = (Channel(name="P", unit=unit), trace.channels[1])
    other = replace(trace, channels=channels, values=trace.values * [scale, 1.0])
    assert identify_characteristic(other).signals == pytest.approx(characteristic.signals, rel=1e-6)
    with pytest.raises(UnitError, match="cannot convert V to mA"):
        identify_characteristic(replace(trace, channels=(Channel(name="P", unit="V"), trace.channels[1])))


def test_the_dead_band_ends_at_the_deceleration_of_friction_alone(characteristic: Characteristic) -> None:
    assert characteristic.decelerations[0] == pytest.approx(0.7 * MPH, rel=1e-3)


def test_a_trace_that_does_not_settle_shows_no_characteristic(surrogate: AbstractModel) -> None:
    with pytest.raises(TraceError, match="does not show"):
        identify_characteristic(slow_trace(surrogate), settle=1e-6)


def test_the_grade_is_what_the_pendulum_feels_beside_the_wheels(surrogate: AbstractModel) -> None:
    vehicle = TransitVehicle(model=surrogate, speed=20.0, grade=0.01)
    vehicle.step(60.0)
    assert grade_acceleration(vehicle.acceleration, vehicle.pendulum) == pytest.approx(-0.0980665)


# --- the controller


def stops(
    surrogate: AbstractModel, characteristic: Characteristic, friction: float, grade: float = 0.0, *, count: int = 5
) -> tuple[DecelerationController, list[Trace]]:
    controller = DecelerationController(characteristic=characteristic, sample_time=STEP)
    vehicle = TransitVehicle(model=surrogate, friction=friction, speed=40 * MPH, grade=grade)
    commands = np.repeat([40 * MPH, 20 * MPH], [round(CRUISE_TIME / STEP), round(STOP_TIME / STEP)])
    traces = []
    for _ in range(count):
        vehicle.speed = 40 * MPH
        traces.append(stop_trace(vehicle, controller, commands))
    return controller, traces


FRICTIONS = {"low": 0.7, "nominal": 1.0, "high": 1.3}


@pytest.mark.parametrize("friction", FRICTIONS.values(), ids=FRICTIONS.keys())
@pytest.mark.parametrize("grade", [0.0, 0.01, -0.01], ids=["level", "up", "down"])
def test_the_mean_deceleration_error_goes_to_zero_within_five_stops(
    surrogate: AbstractModel, characteristic: Characteristic, friction: float, grade: float
) -> None:
    controller, _ = stops(surrogate, characteristic, friction, grade)
    errors = np.abs(controller.mean_errors) / RATE
    assert len(errors) == 5
    assert errors[-1] < 0.01
    assert errors[-1] < 0.1 * max(errors[0], 0.05)
    assert np.sign(controller.modifier) == np.sign(1.0 - friction) or friction == 1.0


@pytest.mark.parametrize("friction", FRICTIONS.values(), ids=FRICTIONS.keys())
@pytest.mark.parametrize("grade", [0.0, 0.01, -0.01], ids=["level", "up", "down"])
def test_after_learning_the_jerk_of_the_whole_stop_is_within_its_limit(
    surrogate: AbstractModel, characteristic: Characteristic, friction: float, grade: float
) -> None:
    """From a second before the command to the end of the handing back to cruising; over half a second."""
    _, traces = stops(surrogate, characteristic, friction, grade)
    begin = round(CRUISE_TIME / STEP)
    assert largest_jerk(traces[-1]["A"][begin - 20 :], STEP) <= JERK


def test_before_it_has_learnt_the_open_loop_passes_the_friction_on(
    surrogate: AbstractModel, characteristic: Characteristic
) -> None:
    """Nothing that does not look at the vehicle can keep the limit with shoes that take more than they should."""
    _, traces = stops(surrogate, characteristic, 1.3, count=1)
    begin = round(CRUISE_TIME / STEP)
    window = slice(begin, begin + round(OPEN_LOOP / STEP))
    assert JERK * 1.05 < largest_jerk(traces[0]["A"][window], STEP) <= JERK * 1.3


def test_without_learning_the_error_stays(surrogate: AbstractModel, characteristic: Characteristic) -> None:
    controller = DecelerationController(characteristic=characteristic, sample_time=STEP, learns=False)
    vehicle = TransitVehicle(model=surrogate, friction=0.7)
    commands = np.repeat([40 * MPH, 20 * MPH], [200, 360])
    for _ in range(3):
        vehicle.speed = 40 * MPH
        stop_trace(vehicle, controller, commands)
    assert controller.modifier == 0.0
    assert abs(controller.mean_errors[-1]) > 0.1 * RATE


def test_the_modifier_holds_while_cruising_and_between_stops(
    surrogate: AbstractModel, characteristic: Characteristic
) -> None:
    _, traces = stops(surrogate, characteristic, 0.7)
    begin, ramp = round(CRUISE_TIME / STEP), round(12.0 / STEP)
    for before, trace in zip([None, *traces[:-1]], traces, strict=True):
        held = trace["M"][: begin + ramp - 5]
        assert np.ptp(held) == 0.0
        assert held[0] == (0.0 if before is None else before["M"][-1])
        assert np.ptp(trace["M"][begin + ramp + 5 :]) == 0.0
        assert trace["M"][-1] != held[0]


def test_two_seconds_of_open_loop_do_not_look_at_the_speed(
    surrogate: AbstractModel, characteristic: Characteristic
) -> None:
    requests = [
        stops(surrogate, characteristic, friction, count=1)[1][0]["REQ"][200 : 200 + round(OPEN_LOOP / STEP)]
        for friction in (0.7, 1.3)
    ]
    np.testing.assert_allclose(*requests, atol=1e-12)


def test_an_overspeed_while_cruising_brakes_fully(surrogate: AbstractModel, characteristic: Characteristic) -> None:
    controller = DecelerationController(characteristic=characteristic, sample_time=STEP)
    assert controller.step(10.0, 10.0, 0.0, 0.0) > 60.0
    assert controller.step(10.0, 12.0, 0.0, 0.0) == 20.0


@pytest.mark.parametrize("grade", [0.0, 0.02, -0.02], ids=["level", "up", "down"])
def test_while_a_ramp_runs_the_overspeed_control_looks_at_the_speed(
    surrogate: AbstractModel, characteristic: Characteristic, grade: float
) -> None:
    """The source: in the open loop the speed is ignored "except for overspeed control". Shoes faded to 0.2."""
    controller = DecelerationController(characteristic=characteristic, sample_time=STEP)
    vehicle = TransitVehicle(model=surrogate, friction=0.2, speed=40 * MPH, grade=grade)
    trace = stop_trace(vehicle, controller, np.repeat([40.0, 20.0], [200, 400]) * MPH)
    profile = JerkProfile(start=float(trace["V"][199]), stop=20 * MPH)
    wanted = np.array([profile.speed(k * STEP) for k in range(round(profile.duration / STEP))])
    over = trace["V"][199 : 199 + len(wanted)] - wanted > controller.settings.overspeed
    assert over.sum() > 20
    np.testing.assert_array_equal(trace["P"][200 : 200 + len(wanted)] == FULL_SERVICE, over)


def test_a_command_far_below_is_overspeed_in_the_open_loop_only_above_the_ramp(
    surrogate: AbstractModel, characteristic: Characteristic
) -> None:
    trace = stops(surrogate, characteristic, 1.0, count=1)[1][0]
    assert trace["P"].min() > FULL_SERVICE


@pytest.mark.parametrize(
    ("commands", "lasting"),
    [
        ([40, 20, 10], [10, 5, 40]),
        ([40, 20, 15, 5], [10, 3, 3, 40]),
        ([40, 20, 40], [10, 5, 50]),
        ([40, 20, 30], [10, 8, 50]),
        ([40, 20, 10], [10, 11, 40]),
        ([20, 40, 10], [5, 6, 50]),
        ([40, 20, 40, 10], [10, 5, 10, 50]),
    ],
    ids=["lower", "twice lower", "raised", "raised in part", "lower while leaving", "while it gains", "raised, lower"],
)
def test_another_command_within_a_ramp_keeps_to_the_limit_of_the_jerk(
    surrogate: AbstractModel, characteristic: Characteristic, commands: list[float], lasting: list[float]
) -> None:
    """A ramp that began from no deceleration had twice the jerk, and eight times after a vehicle that gained speed."""
    controller = DecelerationController(characteristic=characteristic, sample_time=STEP)
    vehicle = TransitVehicle(model=surrogate, speed=commands[0] * MPH)
    counts = [round(seconds / STEP) for seconds in lasting]
    trace = stop_trace(vehicle, controller, np.repeat(np.array(commands) * MPH, counts))
    assert largest_jerk(trace["A"], STEP) <= 1.1 * JERK
    assert trace["P"].min() > FULL_SERVICE
    assert trace["V"][-1] == pytest.approx(commands[-1] * MPH, abs=0.05)


def test_a_command_that_is_raised_again_ends_the_braking(
    surrogate: AbstractModel, characteristic: Characteristic
) -> None:
    """From 40 to 20 mph, and after 5 s back: 8 mph are lost by then, and 2 more while the deceleration goes."""
    controller = DecelerationController(characteristic=characteristic, sample_time=STEP)
    vehicle = TransitVehicle(model=surrogate, speed=40 * MPH)
    trace = stop_trace(vehicle, controller, np.repeat([40.0, 20.0, 40.0], [200, 100, 800]) * MPH)
    assert 27.0 * MPH < trace["V"].min() < 31.0 * MPH


def test_a_vehicle_needs_friction(surrogate: AbstractModel) -> None:
    with pytest.raises(ConfigError, match="brake of the vehicle"):
        TransitVehicle(model=surrogate, friction=0.0)
