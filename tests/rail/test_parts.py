"""Vehicles, couplers, tracks and trains: formulas, files, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import sysid
from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.rail.dynamics.coupler import Coupler
from sysid.rail.dynamics.track import TrackProfile, read_track
from sysid.rail.dynamics.train import Train, heavy_haul, read_train
from sysid.rail.dynamics.vehicle import Davis, NotchCurves, Rigging, Shoe, Vehicle, diesel_electric, modified_davis
from sysid.rail.judging.scenario_catalogue import standard_scenarios

# --- vehicles


def test_the_modified_davis_equation_in_its_own_units() -> None:
    """A loaded car of 100 short tons on four axles at 50 mph: 0.6 + 20/25 + 0.5 + 0.07 * 2500/100 = 3.65 lb/ton."""
    resistance = modified_davis(100 * 907.18474, 4).force(50 * 0.44704)
    assert resistance / 4.4482216 / 100 == pytest.approx(3.65)


@pytest.mark.parametrize(("kmh", "friction"), [(0.0, 0.36), (75.0, 0.36 * 225 / 300), (150.0, 0.24)])
def test_the_friction_of_a_shoe_falls_with_speed(kmh: float, friction: float) -> None:
    assert Shoe().friction(kmh / 3.6) == pytest.approx(friction)


def test_a_rigging_is_an_area_a_ratio_and_a_spring() -> None:
    rigging = Rigging(area=0.1, ratio=5.0, efficiency=0.8, spring_pressure=2e4)
    assert rigging.shoe_force(1.2e5) == pytest.approx(0.1 * 5.0 * 0.8 * 1e5)
    assert rigging.shoe_force(1e4) == 0.0


def test_notches_are_limited_by_effort_and_power() -> None:
    curves = diesel_electric(power=2e6, starting_effort=4e5, notches=8)
    assert curves.force(8, 0.0) == 4e5
    assert curves.force(8, 20.0) == pytest.approx(1e5)
    assert curves.force(4, 0.0) == 2e5
    assert curves.force(4, 20.0) == pytest.approx(1e5 * 0.5**1.5)
    assert curves.force(0, 10.0) == 0.0
    assert curves.force(-8, 10.0) < 0.0
    assert (curves.lowest, curves.highest) == (-8, 8)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Davis(a=-1.0, b=0.0, c=0.0),
        lambda: Shoe(slope=0.5),
        lambda: Rigging(efficiency=1.2),
        lambda: Vehicle(mass=0.0, length=10.0, davis=Davis(a=0, b=0, c=0)),
        lambda: NotchCurves(speed_step=1.0, forces={2: np.ones(3)}),
        lambda: NotchCurves(speed_step=1.0, forces={1: np.ones(3), -1: -np.ones(3)}),
        lambda: NotchCurves(speed_step=1.0, forces={1: np.ones(3), 2: np.ones(4)}),
        lambda: Coupler(friction=1.0),
        lambda: Coupler(toe=0.2),
        lambda: Train(vehicles=()),
        lambda: Train(vehicles=heavy_haul(pairs=1).vehicles, couplers=(Coupler(),) * 3),
    ],
    ids=[
        "negative resistance",
        "friction that rises",
        "efficiency above 1",
        "no mass",
        "notch 1 missing",
        "braking force with a sign",
        "curves of two lengths",
        "all friction",
        "toe beyond travel",
        "no vehicle",
        "too many couplers",
    ],
)
def test_impossible_parts_are_refused(make: object) -> None:
    with pytest.raises(ConfigError):
        make()


# --- couplers


@given(st.floats(-0.3, 0.3), st.floats(0.0, 0.05))
def test_a_coupler_s_energy_is_the_integral_of_its_force(extension: float, slack: float) -> None:
    coupler = Coupler(slack=slack)
    kinks = [0.5 * slack, 0.5 * slack + coupler.toe, 0.5 * slack + coupler.travel]
    points = [float(np.copysign(kink, extension)) for kink in kinks if kink < abs(extension)]
    area = quad(coupler.force, 0.0, extension, points=points or None, epsabs=1e-9, epsrel=1e-10)[0]
    assert coupler.energy(extension) == pytest.approx(area, rel=1e-7, abs=1e-6)


def test_a_coupler_is_alike_in_draft_and_buff() -> None:
    coupler = Coupler()
    for extension in (0.005, 0.014, 0.05, 0.2):
        assert coupler.force(-extension) == -coupler.force(extension)
        assert coupler.loading_force(-extension) == -coupler.loading_force(extension)


def test_four_to_six_inches_lie_between_bunched_and_stretched() -> None:
    """The play per coupler of the source of the terrain features, under 0.4 MN of loading force."""
    coupler = Coupler()
    grid = np.linspace(0.0, 0.2, 20001)
    out = grid[np.argmax([coupler.loading_force(float(x)) >= 4e5 for x in grid])]
    assert 4 * 0.0254 * 0.5 <= 2.0 * out <= 6 * 0.0254


# --- tracks

TRACK = """
name: example
description: three properties
grade: [[0, 5], [100, -20]]
curve: [[400, 600], [500, 99999]]
superelevation: [[400, 80], [500, 0]]
speed_limit: [[350, 45]]
"""


def test_a_track_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "track.yaml"
    file.write_text(TRACK)
    track = read_track(file)
    x = np.array([-50.0, 50.0, 450.0, 600.0])
    np.testing.assert_allclose(track.grade(x), [0.005, 0.005, -0.02, -0.02])
    np.testing.assert_allclose(track.curvature(x), [0.0, 0.0, 1.0 / 600.0, 0.0])
    np.testing.assert_allclose(track.superelevation(x), [0.0, 0.0, 0.08, 0.0])
    assert track.speed_limit(x).tolist() == [np.inf, np.inf, 12.5, 12.5]
    assert float(track.elevation(600.0) - track.elevation(0.0)) == pytest.approx(0.5 - 10.0)
    assert track.lowest_limit(0.0, 349.0) == np.inf
    assert track.lowest_limit(0.0, 351.0) == 12.5


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[100, -20]", "[100, -300]", "too steep"),
        ("[100, -20]", "[-100, -20]", "not in order"),
        ("[400, 600]", "[400, 0]", "no radius"),
        ("[350, 45]", "[350, 0]", "speed limit"),
        ("grade:", "gradient:", "unknown field"),
    ],
)
def test_impossible_tracks_are_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    file = tmp_path / "track.yaml"
    file.write_text(TRACK.replace(old, new))
    with pytest.raises(ConfigError, match=message):
        read_track(file)


@given(st.lists(st.tuples(st.floats(0.1, 500.0), st.floats(-0.04, 0.04)), min_size=1, max_size=8))
def test_elevation_is_the_integral_of_grade(rows: list[tuple[float, float]]) -> None:
    ends = np.cumsum([length for length, _ in rows])
    track = TrackProfile.from_steps("random", grade=[(float(x), g) for x, (_, g) in zip(ends, rows, strict=True)])
    x = np.linspace(-100.0, float(ends[-1]) + 100.0, 20_001)
    step = x[1] - x[0]
    rise = np.concatenate([[0.0], np.cumsum(track.grade(0.5 * (x[:-1] + x[1:])) * step)])
    np.testing.assert_allclose(track.elevation(x) - track.elevation(x[0]), rise, atol=0.08 * step * len(rows))


# --- trains from files

TRAIN = """
name: short
coupler: {slack: 0.02}
vehicles:
  - {name: locomotive, mass: 180000, length: 20, axles: 6, brake: none, power: {power: 2.0e6, notches: 4}}
  - {count: 3, mass: 80000, length: 12, brake: {ratio: 6.0, shoe: {base: 0.3}}}
  - {name: trailer, mass: 30000, length: 12, davis: [500, 10, 2]}
"""


def test_a_train_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "train.yaml"
    file.write_text(TRAIN)
    train = read_train(file)
    assert (len(train.vehicles), train.mass, train.length) == (5, 450e3, 68.0)
    assert train.powered == (0,)
    rigging = train.vehicles[1].rigging
    assert rigging is not None
    assert (rigging.ratio, rigging.shoe.base) == (6.0, 0.3)
    assert train.vehicles[4].davis == Davis(a=500.0, b=10.0, c=2.0)
    assert train.coupler(2).slack == 0.02


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("slack", "slackness"),
        ("power: 2.0e6", "horse: 2.0e6"),
        ("ratio: 6.0", "leverage: 6.0"),
        ("mass: 30000", "mass: 0"),
        ("mass: 80000", "mass: 80"),
        ("mass: 80000", "mass: 8.0e+6"),
        ("length: 20", "length: 20000"),
        ("notches: 4", "notches: 0"),
        ("notches: 4", "notches: 3.5"),
    ],
)
def test_impossible_trains_are_refused(tmp_path: Path, old: str, new: str) -> None:
    file = tmp_path / "train.yaml"
    file.write_text(TRAIN.replace(old, new))
    with pytest.raises(ConfigError):
        read_train(file)


EXAMPLE = Path(sysid.__file__).parent.parent / "datasets" / "rail-example"


@pytest.mark.parametrize(("file", "pairs"), [("heavy-haul-101.yaml", 50), ("heavy-haul-151.yaml", 75)])
def test_the_example_trains_are_the_mechanical_side_of_the_air_brake_s(file: str, pairs: int) -> None:
    train, made = read_train(EXAMPLE / file), heavy_haul(pairs=pairs)
    assert len(train.vehicles) == Consist(pairs=pairs).vehicles
    np.testing.assert_array_equal(train.masses, made.masses)
    np.testing.assert_array_equal(train.lengths, made.lengths)
    assert train.powered == made.powered == (0,)
    assert train.vehicles[-1].rigging == made.vehicles[-1].rigging
    assert train.lengths[1] == Consist(pairs=pairs).pipe.vehicle_length


@pytest.mark.parametrize("name", ["crest", "sag", "curve"])
def test_the_example_lines_are_those_of_the_scenarios(name: str) -> None:
    track, scenario = (
        read_track(EXAMPLE / f"{name}.yaml"),
        standard_scenarios(heavy_haul(pairs=1))[f"{name}, full service"],
    )
    x = np.linspace(-3000.0, 600.0, 500)
    np.testing.assert_allclose(track.grade(x), scenario.track.grade(x))
    np.testing.assert_allclose(track.curvature(x), scenario.track.curvature(x))
