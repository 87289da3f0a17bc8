"""A train's motion against closed forms, its balances of energy and momentum, and its plain twin."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sysid.errors import ConfigError, StabilityError
from sysid.rail.dynamics.coupler import Coupler
from sysid.rail.dynamics.motion import CURVE_RESISTANCE, MovingTrain
from sysid.rail.dynamics.reference import PlainTrain
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train, heavy_haul, locomotive, wagon
from sysid.rail.dynamics.vehicle import Davis, NotchCurves, Rigging, Shoe, Vehicle

FREE = Davis(a=0.0, b=0.0, c=0.0)
LEVEL = TrackProfile.level()
HILLS = TrackProfile.from_steps(
    "hills",
    grade=[(0.0, 0.0), (1500.0, 0.008), (3000.0, -0.008), (4500.0, 0.0)],
    curvature=[(2000.0, 1.0 / 600.0), (2500.0, 0.0)],
)


def single(davis: Davis = FREE, *, mass: float = 100e3, **options: object) -> Train:
    return Train(vehicles=(Vehicle(mass=mass, length=10.0, davis=davis, **options),))


def pair(coupler: Coupler, first: float = 80e3, second: float = 120e3) -> Train:
    vehicles = tuple(Vehicle(mass=mass, length=10.0, davis=FREE) for mass in (first, second))
    return Train(vehicles=vehicles, couplers=(coupler,))


def unbraked(samples: int, train: Train) -> np.ndarray:
    return np.zeros((samples, len(train.vehicles)))


# --- closed forms


def test_free_rolling_follows_the_solution_of_davis_equation() -> None:
    a, b, c, mass, v0 = 1500.0, 40.0, 6.0, 100e3, 25.0
    moving = MovingTrain(train=single(Davis(a=a, b=b, c=c), mass=mass), track=LEVEL, speed=v0)
    motion = moving.advance(np.zeros((3000, 1)))
    # m v' = -(a + b v + c v^2): arctan of a shifted speed falls linearly.
    root = math.sqrt(4.0 * a * c - b * b)
    angle = math.atan((2.0 * c * v0 + b) / root) - root / (2.0 * mass) * motion.time
    expected = (root * np.tan(angle) - b) / (2.0 * c)
    np.testing.assert_allclose(motion.speeds[:, 0], expected, rtol=1e-7)


def test_a_constant_force_stops_in_v_squared_over_2a() -> None:
    shoe = Shoe(base=0.3, slope=1.0)
    rigging = Rigging(spring_pressure=0.0, shoe=shoe)
    train, v0, pressure = single(rigging=rigging), 20.0, 3e5
    deceleration = rigging.shoe_force(pressure) * 0.3 / train.mass
    moving = MovingTrain(train=train, track=LEVEL, speed=v0)
    motion = moving.advance(np.full((1200, 1), pressure))
    assert motion.positions[-1, 0] == pytest.approx(v0**2 / (2.0 * deceleration), rel=1e-5)
    stopped = motion.time[np.argmax(motion.speeds[:, 0] < 1e-3)]
    assert stopped == pytest.approx(v0 / deceleration, abs=0.11)
    assert np.abs(motion.speeds[-100:]).max() < 1e-6


def test_friction_that_falls_with_speed_stops_as_its_integral_says() -> None:
    rigging, v0, pressure = Rigging(spring_pressure=0.0), 22.0, 3e5
    train = single(rigging=rigging)
    motion = MovingTrain(train=train, track=LEVEL, speed=v0).advance(np.full((1200, 1), pressure))
    shoe, normal = rigging.shoe, rigging.shoe_force(pressure)

    def way(v: float) -> float:
        # ds = m v dv / (N mu(v)), mu = base (v + r) / (slope v + r)
        r, q = shoe.reference, shoe.slope
        # integral of v (q v + r) / (v + r): q v^2 / 2 + (r - q r) v - (r - q r) r ln(v + r)
        return q * v * v / 2.0 + (r - q * r) * v - (r - q * r) * r * math.log(v + r)

    expected = train.mass / (normal * shoe.base) * (way(v0) - way(0.0))
    assert motion.positions[-1, 0] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("grade", [0.01, -0.01], ids=["up", "down"])
def test_a_grade_gives_g_times_its_slope(grade: float) -> None:
    track = TrackProfile.from_steps("slope", grade=[(0.0, grade)])
    motion = MovingTrain(train=single(), track=track, speed=20.0).advance(np.zeros((500, 1)))
    np.testing.assert_allclose(motion.speeds[:, 0], 20.0 - 9.80665 * grade * motion.time, rtol=1e-10)


def test_a_curve_resists_in_proportion_to_its_curvature() -> None:
    track = TrackProfile.from_steps("curve", curvature=[(-1.0, 1.0 / 300.0)])
    motion = MovingTrain(train=single(), track=track, speed=20.0).advance(np.zeros((100, 1)))
    assert (20.0 - motion.speeds[-1, 0]) / 10.0 == pytest.approx(CURVE_RESISTANCE / 300.0, rel=1e-6)
    manual = 0.8 * 4.4482216 / 907.18474 * 1746.4
    assert pytest.approx(manual, rel=1e-3) == CURVE_RESISTANCE


def test_traction_does_the_work_of_its_curve() -> None:
    curves = NotchCurves(speed_step=50.0, forces={1: np.array([1e5, 1e5])})
    moving = MovingTrain(train=single(notches=curves), track=LEVEL)
    motion = moving.advance(np.zeros((200, 1)), notch=1)
    assert motion.speeds[-1, 0] == pytest.approx(20.0, rel=1e-9)
    assert moving.works["traction"] == pytest.approx(1e5 * motion.positions[-1, 0], rel=1e-9)


def linear_coupler(friction: float) -> Coupler:
    # No preload over a vanishing toe: a linear spring; the slack is wide enough for one impact alone.
    return Coupler(slack=1.0, preload=0.0, toe=1e-9, stiffness=8e6, travel=10.0, friction=friction, friction_speed=1e-4)


def test_an_elastic_impact_exchanges_speeds_with_the_spring_s_peak_force() -> None:
    coupler, speeds = linear_coupler(0.0), np.array([0.0, 2.0])
    train = pair(coupler)
    moving = MovingTrain(train=train, track=LEVEL, speed=speeds, time_step=1e-3)
    motion = moving.advance(unbraked(7, train))
    m1, m2 = train.masses
    after = [2.0 * m2 * 2.0 / (m1 + m2), (m2 - m1) * 2.0 / (m1 + m2)]
    np.testing.assert_allclose(motion.speeds[-1], after, rtol=1e-9)
    reduced = m1 * m2 / (m1 + m2)
    assert moving.peak(draft=False).force == pytest.approx(-2.0 * math.sqrt(8e6 * reduced), rel=1e-3)


@pytest.mark.parametrize("friction", [0.2, 0.5, 0.8])
def test_an_impact_with_friction_loses_the_area_of_its_loop(friction: float) -> None:
    """Loading (1 + mu) k a, unloading (1 - mu) k a: the square of the restitution is the quotient of the two."""
    train, speeds = pair(linear_coupler(friction)), np.array([0.0, 2.0])
    moving = MovingTrain(train=train, track=LEVEL, speed=speeds, time_step=1e-3)
    motion = moving.advance(unbraked(7, train))
    restitution = (motion.speeds[-1, 0] - motion.speeds[-1, 1]) / 2.0
    assert restitution**2 == pytest.approx((1.0 - friction) / (1.0 + friction), rel=2e-3)
    reduced = 80e3 * 120e3 / 200e3
    assert moving.works["coupler_friction"] == pytest.approx(-0.5 * reduced * 4.0 * (1.0 - restitution**2), rel=1e-9)


def test_impacts_converge_to_scipy_s_solution_of_the_continuous_equations() -> None:
    coupler = Coupler()
    train = pair(coupler)

    def rates(_: float, y: np.ndarray) -> list[float]:
        extension, relative = y[0] - y[1] - 10.0, y[2] - y[3]
        sign = relative / math.hypot(relative, coupler.friction_speed)
        pull = coupler.force(extension) + coupler.friction_force(extension) * sign
        return [y[2], y[3], -pull / 80e3, pull / 120e3]

    exact = solve_ivp(rates, (0.0, 0.5), [0.0, -10.0, 0.0, 3.0], rtol=1e-10, atol=1e-12, max_step=1e-3).y[:, -1]
    errors = []
    for step in (4e-3, 1e-3, 2.5e-4):
        moving = MovingTrain(train=train, track=LEVEL, speed=np.array([0.0, 3.0]), time_step=step)
        motion = moving.advance(unbraked(5, train))
        errors.append(np.abs(np.concatenate([motion.positions[-1], motion.speeds[-1]]) - exact).max())
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]
    assert errors[2] < 3e-4


# --- balances


def balance(moving: MovingTrain, samples: np.ndarray, notch: np.ndarray | int = 0) -> tuple[float, float]:
    """Relative errors of energy and momentum over a run: states against works and impulses."""
    before, momentum = moving.energies, moving.momentum
    moving.advance(samples, notch=notch)
    after, works = moving.energies, moving.works
    change = sum(dataclasses.astuple(after)) - sum(dataclasses.astuple(before))
    done = sum(work for name, work in works.items() if name != "gravity")
    turned = max(before.kinetic, after.kinetic, *(abs(work) for work in works.values()))
    height = after.potential - before.potential
    assert height == pytest.approx(-works["gravity"], abs=1e-9 * turned)
    moved = max(abs(momentum), abs(moving.momentum), abs(moving.impulse))
    return (change - done) / turned, (moving.momentum - momentum - moving.impulse) / moved


def test_two_masses_keep_the_balance_over_600_s_of_impacts() -> None:
    train = pair(dataclasses.replace(Coupler(), friction=0.001))
    moving = MovingTrain(train=train, track=LEVEL, speed=np.array([5.0, 6.0]))
    energy, momentum = balance(moving, unbraked(6000, train))
    assert abs(energy) < 1e-9
    assert abs(momentum) < 1e-9
    assert moving.energies.stored + abs(moving.works["coupler_friction"]) > 0.0


def test_101_vehicles_keep_the_balance_over_600_s_of_hills_traction_and_braking() -> None:
    train = heavy_haul(pairs=50)
    moving = MovingTrain(train=train, track=HILLS, speed=80.0 / 3.6)
    time = 0.1 * np.arange(6000)
    ramp = np.clip((time[:, None] - 50.0 - 0.1 * np.arange(101)) / 40.0, 0.0, 1.0)
    pressures = ramp * 2e5 * (time[:, None] < 150.0)
    notch = np.select([time < 30.0, (time > 200.0) & (time < 500.0), time >= 500.0], [8, 8, -8], 0)
    energy, momentum = balance(moving, pressures, notch)
    assert abs(energy) < 1e-6
    assert abs(momentum) < 1e-6
    assert all(abs(work) > 1e6 for name, work in moving.works.items() if name != "gravity")


def test_what_dissipates_takes_energy_away() -> None:
    train = heavy_haul(pairs=10)
    moving = MovingTrain(train=train, track=HILLS, speed=15.0)
    works = moving.advance(np.tile(np.where(np.arange(21) % 2, 2e5, 0.0), (900, 1))).works
    assert (np.diff(works[:, [2, 3]], axis=0) <= 1e-9).all()
    assert works[-1, 5] < 0.0


# --- rest, steps, chunks


def test_a_braked_train_stays_on_a_slope() -> None:
    track = TrackProfile.from_steps("slope", grade=[(0.0, -0.01)])
    train = heavy_haul(pairs=5)
    moving = MovingTrain(train=train, track=track)
    motion = moving.advance(np.full((6000, 11), 4e5))
    assert np.abs(motion.speeds[-1]).max() < 1e-3
    # It settles into its couplers by centimetres and then creeps at the width of the friction's turn.
    assert abs(motion.positions[-1, 0] - motion.positions[600, 0]) < 0.3


def test_half_the_step_changes_peak_forces_by_less_than_half_a_percent() -> None:
    train, peaks = heavy_haul(pairs=50), []
    time = 0.1 * np.arange(900)[:, None]
    pressures = np.clip((time - 0.05 * np.arange(101)) / 10.0, 0.0, 1.0) * 4.4e5
    for step in (1e-2, 5e-3):
        moving = MovingTrain(train=train, track=HILLS, speed=80.0 / 3.6, time_step=step)
        moving.advance(pressures)
        peaks.append([moving.peak(draft=True).force, moving.peak(draft=False).force])
    assert peaks[0][1] < -1e5
    np.testing.assert_allclose(*peaks, rtol=5e-3)


def test_a_run_in_chunks_is_the_run_in_one_piece() -> None:
    train = heavy_haul(pairs=3)
    pressures = np.linspace(0.0, 3e5, 60)[:, None] * np.ones(7)
    whole = MovingTrain(train=train, track=HILLS, speed=20.0).advance(pressures)
    moving = MovingTrain(train=train, track=HILLS, speed=20.0)
    parts = [moving.advance(part) for part in np.split(pressures, [1, 17, 40])]
    np.testing.assert_array_equal(np.concatenate([part.speeds for part in parts]), whole.speeds)
    np.testing.assert_allclose(np.concatenate([part.time for part in parts]), whole.time, atol=1e-9)


TWINS = {
    "one locomotive": Train(vehicles=(locomotive(),)),
    "wagons of two kinds": Train(vehicles=(locomotive(), wagon(), wagon(mass=30e3), wagon())),
    "stiff couplers": Train(
        vehicles=(locomotive(), *[wagon()] * 3),
        couplers=tuple(Coupler(slack=slack, travel=0.03) for slack in (0.0, 0.01, 0.05)),
    ),
}


@pytest.mark.parametrize("train", TWINS.values(), ids=TWINS.keys())
def test_steps_agree_with_the_plain_ones(train: Train) -> None:
    rng = np.random.default_rng(4)
    track = TrackProfile.from_steps("short", grade=[(0.0, 0.01), (15.0, -0.02)], curvature=[(5.0, 0.003)])
    n = len(train.vehicles)
    speeds = 8.0 + rng.normal(0.0, 0.5, n)
    compiled = MovingTrain(train=train, track=track, speed=speeds, sample_time=0.01, time_step=0.01)
    plain = PlainTrain(train=train, track=track, speed=speeds, position=0.0, time_step=0.01)
    for _ in range(150):
        pressures, notch = rng.uniform(0.0, 4e5, n), int(rng.integers(-8, 9))
        compiled.advance(pressures[None], notch=notch)
        plain.step(pressures, np.array([notch] + [0] * (n - 1)))
        np.testing.assert_allclose(compiled.state.speed, plain.speeds, atol=2e-8)
        np.testing.assert_allclose(compiled.state.position, plain.positions, atol=2e-8)


# --- what is refused


@pytest.mark.parametrize(
    ("pressures", "notch", "message"),
    [
        (np.zeros((3, 4)), 0, "cylinder pressures"),
        (np.full((3, 3), np.nan), 0, "cylinder pressures"),
        (np.zeros((3, 3)), 9, "no such notch"),
        (np.zeros((3, 3)), 0.5, "notches do not fit"),
    ],
    ids=["wrong width", "not finite", "notch too high", "half a notch"],
)
def test_drives_that_do_not_fit_are_refused(pressures: np.ndarray, notch: int, message: str) -> None:
    moving = MovingTrain(train=heavy_haul(pairs=1), track=LEVEL)
    with pytest.raises(ConfigError, match=message):
        moving.advance(pressures, notch=notch)


def test_a_sample_that_holds_no_whole_number_of_steps_is_refused() -> None:
    with pytest.raises(StabilityError, match="whole number"):
        MovingTrain(train=heavy_haul(pairs=1), track=LEVEL, sample_time=0.1, time_step=0.03)


def test_a_speed_for_every_vehicle_or_for_none_else() -> None:
    with pytest.raises(ConfigError, match="speed does not fit"):
        MovingTrain(train=heavy_haul(pairs=1), track=LEVEL, speed=np.zeros(2))
