"""Terrain features: the figures of the source, closed forms on the triangle profile, rules by table."""

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.rail.dynamics.motion import MovingTrain
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train, heavy_haul, locomotive, wagon
from sysid.rail.dynamics.vehicle import Davis, Vehicle
from sysid.rail.track import terrain
from sysid.rail.track.features import Severity, StartRule, Thresholds, crest_starts, features
from sysid.rail.track.handling import (
    Quadrant,
    crest_handling,
    lateral_ratio,
    peak_force,
    quadrant,
    sag_acceleration,
    sub_trains,
)
from sysid.rail.track.terrain import (
    CREST,
    PATTERNS,
    SAG,
    Pattern,
    Shape,
    correlation,
    effective_grade,
    equivalent_grade_change,
    quasi_static_forces,
    stringlining_risk,
    uniform,
)

L, Y = 1000.0, 0.012
TRIANGLE = TrackProfile.from_steps("triangle", grade=[(-5.0 * L, Y), (0.0, -Y)])
TROUGH = TrackProfile.from_steps("trough", grade=[(-5.0 * L, -Y), (0.0, Y)])
LINE = np.linspace(-3.0 * L, 3.0 * L, 601)
ACROSS = Pattern(name="front against rear", edges=(-1.0, -0.5, 0.0), values=(1.0, -1.0))
HEAVY_FRONT = Shape(lengths=np.array([500.0, 500.0]), masses=np.array([3.0, 1.0]))


@pytest.mark.parametrize("pattern", [*PATTERNS, SAG, ACROSS], ids=lambda pattern: pattern.name)
def test_a_constant_grade_has_no_crest_and_no_sag_whatever_the_loading(pattern: Pattern) -> None:
    even = TrackProfile.from_steps("even", grade=[(-9000.0, 0.01)])
    heavy_rear = Shape(lengths=np.full(10, 100.0), masses=np.repeat([1.0, 3.0], 5))
    for shape in (heavy_rear, HEAVY_FRONT, uniform(L)):
        assert correlation(even, shape, np.array([0.0, 321.0]), pattern=pattern) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("at", "expected"), [(-1.0, 0.0), (-0.5, 0.5), (0.0, 1.0), (0.5, 0.5), (1.0, 0.0)], ids=lambda v: f"{v:g}"
)
@pytest.mark.parametrize(("track", "sign"), [(TRIANGLE, 1.0), (TROUGH, -1.0)], ids=["crest", "sag"])
def test_the_worked_example(track: TrackProfile, sign: float, at: float, expected: float) -> None:
    """0 one train length before, the grade itself with the locomotive on the apex, 0 one train length after."""
    value = correlation(track, uniform(L), np.array([at * L]))[0]
    assert value == pytest.approx(sign * Y * expected, abs=1e-15)
    assert correlation(track, uniform(L), np.array([at * L]), pattern=SAG)[0] == -value


def test_the_correlation_of_the_worked_example_is_linear_between() -> None:
    values = correlation(TRIANGLE, uniform(L), LINE)
    np.testing.assert_allclose(values, Y * np.clip(1.0 - np.abs(LINE) / L, 0.0, None), atol=1e-15)


def test_the_correlation_agrees_with_a_plain_sum() -> None:
    rng = np.random.default_rng(3)
    rows = [(float(x), float(g)) for x, g in zip(np.arange(-40, 40) * 130.0, rng.normal(0, 0.01, 80), strict=True)]
    track = TrackProfile.from_steps("rough", grade=rows)
    shape = Shape(lengths=rng.uniform(10, 30, 20), masses=rng.uniform(20e3, 120e3, 20))
    step = 0.01
    s = np.arange(-shape.length, shape.length, step) + 0.5 * step
    weights = shape.masses / shape.lengths / (shape.mass / shape.length)
    w = np.where(s < 0.0, weights[np.clip(np.searchsorted(shape.edges, -s, side="right") - 1, 0, 19)], 1.0)
    x, ahead = 217.0, 55.0
    plain = (track.grade(x + ahead + s) * np.where(s < 0.0, 1.0, -1.0) * w).sum() * step / (2.0 * shape.length)
    exact = correlation(track, shape, np.array([x]), look_ahead=ahead)[0]
    assert exact == pytest.approx(plain, abs=1e-6)


def test_the_correlation_is_additive_in_the_profile() -> None:
    rng = np.random.default_rng(5)
    starts = np.arange(-10, 10) * 300.0
    grades = rng.normal(0.0, 0.01, (2, 20))
    tracks = [
        TrackProfile.from_steps("part", grade=list(zip(starts.tolist(), g.tolist(), strict=True)))
        for g in (grades[0], grades[1], grades.sum(axis=0))
    ]
    parts = [correlation(track, HEAVY_FRONT, LINE) for track in tracks]
    np.testing.assert_allclose(parts[0] + parts[1], parts[2], atol=1e-14)


def test_weights_change_nothing_for_a_uniform_train() -> None:
    shape = Shape(lengths=np.full(50, 20.0), masses=np.full(50, 90e3))
    weighted, plain = (correlation(TRIANGLE, shape, LINE, weighted=flag) for flag in (True, False))
    np.testing.assert_allclose(weighted, plain, atol=1e-15)


def test_a_heavy_front_moves_the_peak() -> None:
    """Weights 3:1: on the way over the crest the heavy half passes first."""
    values = correlation(TRIANGLE, HEAVY_FRONT, LINE)
    light = correlation(TRIANGLE, Shape(lengths=HEAVY_FRONT.lengths, masses=np.array([1.0, 3.0])), LINE)
    # The half behind the front has the weights 1.5 and 0.5 of the mean.
    at = np.searchsorted(LINE, 0.5 * L)
    assert values[at] == pytest.approx(0.5 * (-0.5 * 1.5 + 0.5 * 0.5 + 1.0) * Y)
    assert light[at] == pytest.approx(0.5 * (-0.5 * 0.5 + 0.5 * 1.5 + 1.0) * Y)


@pytest.mark.parametrize("ahead", [0.0, 130.0, 2500.0])
def test_look_ahead_is_a_shift(ahead: float) -> None:
    shifted = correlation(TRIANGLE, HEAVY_FRONT, LINE, look_ahead=ahead)
    np.testing.assert_allclose(shifted, correlation(TRIANGLE, HEAVY_FRONT, LINE + ahead), atol=1e-15)


def test_every_pattern_gives_the_grade_itself_on_the_apex() -> None:
    for pattern in PATTERNS:
        assert correlation(TRIANGLE, uniform(L), np.array([0.0]), pattern=pattern)[0] == pytest.approx(Y)


@pytest.mark.parametrize(("how", "expected"), [("max", 3.0), ("min", 0.0), ("median", 1.0), ("mean", 4.0 / 3.0)])
def test_patterns_are_combined(how: str, expected: float) -> None:
    assert terrain.combined([np.array([v]) for v in (0.0, 1.0, 3.0)], how)[0] == pytest.approx(expected)


def test_an_unknown_combination_is_refused() -> None:
    with pytest.raises(ConfigError, match="unknown combination"):
        terrain.combined([np.zeros(1)], "most")


def test_the_effective_grade_is_the_mean_under_the_train_and_lags_by_it() -> None:
    grades = effective_grade(TRIANGLE, uniform(L), LINE)
    np.testing.assert_allclose(grades, np.clip(Y - 2.0 * Y * LINE / L, -Y, Y), atol=1e-15)
    ahead = effective_grade(TRIANGLE, uniform(L), LINE + L)
    np.testing.assert_allclose(0.5 * (grades - ahead), correlation(TRIANGLE, uniform(L), LINE), atol=1e-15)
    change = equivalent_grade_change(correlation(TRIANGLE, uniform(L), LINE))
    np.testing.assert_allclose(change, ahead - grades, atol=1e-15)


def test_risk_is_nil_on_tangent_track_grows_with_the_curve_and_falls_with_speed() -> None:
    curve = TrackProfile.from_steps("curve", curvature=[(0.0, 1.0 / 300.0)], superelevation=[(0.0, 0.1)])
    x = np.array([-10.0, 2.0 * L])
    risk = stringlining_risk(curve, uniform(L), x, 10.0)
    assert risk.tolist() == [0.0, pytest.approx(np.sqrt(2.0))]
    np.testing.assert_allclose(stringlining_risk(curve, uniform(L), x, 20.0), 0.5 * risk)


# --- rules and levels

RISE_AND_FALL = np.array([0.0, 2.0, 4.0, 6.0, 8.0, 7.0, 5.0, 3.0, 1.0, 0.0, 5.0, 6.0, 2.0]) * 1e-3
GRADES = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, -1.0])


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        (StartRule.MAGNITUDE, (3, 10)),
        (StartRule.NEGATIVE_GRADE, (4, 12)),
        (StartRule.SLOPE_CHANGE, (5, 12)),
        (StartRule.DECLINE, (6, 12)),
    ],
    ids=lambda v: v.name if isinstance(v, StartRule) else "",
)
def test_the_four_rules_of_a_crest_s_beginning(rule: StartRule, expected: tuple[int, ...]) -> None:
    assert crest_starts(RISE_AND_FALL, GRADES, rule=rule, threshold=0.005, decline=0.003) == expected


def test_a_low_correlation_never_begins_a_crest() -> None:
    for rule in StartRule:
        assert crest_starts(RISE_AND_FALL, GRADES, rule=rule, threshold=0.01) == ()


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0.0, Severity.NONE),
        (0.0019, Severity.NONE),
        (0.002, Severity.LOW),
        (0.005, Severity.MEDIUM),
        (0.0101, Severity.HIGH),
        (-0.002, Severity.NONE),
        (-0.004, Severity.LOW),
        (-0.02, Severity.HIGH),
    ],
)
def test_severity_may_differ_between_crest_and_sag(value: float, expected: Severity) -> None:
    assert Thresholds(sag=(0.003, 0.006, 0.02)).severity(value) is expected


def test_features_of_a_hill_and_a_valley() -> None:
    track = TrackProfile.from_steps("both", grade=[(-9e3, Y), (0.0, -Y), (4.0 * L, 0.5 * Y)])
    x = np.arange(-3000.0, 8000.0, 10.0)
    crest, sag = features(x, correlation(track, uniform(L), x))
    assert (crest.kind, crest.apex, crest.severity) == ("crest", 0.0, Severity.HIGH)
    assert (sag.kind, sag.apex, sag.severity) == ("sag", 4.0 * L, Severity.MEDIUM)
    assert crest.correlation == pytest.approx(Y)
    assert sag.correlation == pytest.approx(-0.75 * Y)
    assert crest.start == pytest.approx(-L * (1.0 - 0.002 / Y), abs=10.0)
    assert crest.end == pytest.approx(L * (1.0 - 0.002 / Y), abs=10.0)


# --- handling


@pytest.mark.parametrize(
    ("x", "allowed", "car"), [(-10.0, False, 0), (20.0, False, 2), (49.0, False, 5), (50.0, True, 5)]
)
def test_power_is_cut_until_half_the_train_is_past_the_crest(x: float, allowed: bool, car: int) -> None:
    shape = Shape(lengths=np.full(10, 10.0), masses=np.full(10, 1.0))
    (crest,) = features(LINE, correlation(TRIANGLE, shape, LINE))
    handling = crest_handling(crest, shape, x)
    assert (handling.power_allowed, handling.car_at_apex) == (allowed, car)
    assert handling.mass_before + handling.mass_past == pytest.approx(10.0)


def test_the_handling_of_a_crest_needs_a_crest() -> None:
    (sag,) = features(LINE, correlation(TROUGH, uniform(L), LINE))
    with pytest.raises(ConfigError, match="not a crest"):
        crest_handling(sag, uniform(L), 0.0)


def test_a_sag_is_taken_with_the_natural_acceleration() -> None:
    assert sag_acceleration(TROUGH, uniform(L), 0.0) == pytest.approx(9.80665 * Y)
    assert sag_acceleration(TROUGH, uniform(L), 0.5 * L) == pytest.approx(0.0, abs=1e-12)
    assert sag_acceleration(TROUGH, uniform(L), 0.0, share=0.9) == pytest.approx(0.9 * 9.80665 * Y)


def free(masses: list[float]) -> Train:
    davis = Davis(a=0.0, b=0.0, c=0.0)
    return Train(vehicles=tuple(Vehicle(mass=mass, length=10.0, davis=davis) for mass in masses))


def test_the_largest_force_over_a_crest_is_at_the_apex_and_half_the_weight_times_the_grade() -> None:
    train = free([100e3] * 100)
    x = 495.0  # fifty vehicles past the apex
    estimate = peak_force(TRIANGLE, train, x)
    assert estimate.coupler == 50
    assert estimate.force == pytest.approx(0.5 * train.mass * 9.80665 * Y)
    # The correlation is half its peak there: the force is the correlation times the weight.
    assert estimate.force == pytest.approx(
        correlation(TRIANGLE, Shape.of(train), np.array([500.0]))[0] * train.mass * 9.80665
    )


def test_a_train_that_crawls_over_a_crest_has_the_quasi_static_forces() -> None:
    train = free([100e3] * 20)
    moving = MovingTrain(train=train, track=TRIANGLE, speed=3.0, position=60.0)
    motion = moving.advance(np.zeros((300, 20)))
    k = int(np.argmin(np.abs(motion.positions[:, 0] - 100.0)))
    expected = quasi_static_forces(TRIANGLE, train, float(motion.positions[k, 0]))
    middle = slice(7, 12)
    np.testing.assert_allclose(motion.forces[k, middle].mean(), expected[middle].mean(), rtol=0.35)
    assert (motion.forces[k, middle] > 0.0).all()


BENT = TrackProfile.from_steps(
    "bent crest", grade=[(-5.0 * L, Y), (0.0, -Y)], curvature=[(-5.0 * L, 0.0), (-600.0, 1.0 / 500.0)]
)


@pytest.mark.parametrize(
    ("track", "expected"),
    [
        (TRIANGLE, Quadrant.STRAIGHT_CREST),
        (BENT, Quadrant.CURVED_CREST),
        (TROUGH, Quadrant.STRAIGHT_SAG),
    ],
    ids=["crest", "crest in a curve", "sag"],
)
def test_a_feature_lies_in_a_quadrant_of_grade_and_curvature(track: TrackProfile, expected: Quadrant) -> None:
    shape, x = uniform(L, 1e7), np.arange(-2000.0, 2000.0, 25.0)
    (found,) = features(x, correlation(track, shape, x))
    assert quadrant(found, track, shape) is expected


def test_draft_in_a_curve_pulls_inside_by_force_times_length_over_radius() -> None:
    train = free([100e3] * 100)
    ratios = lateral_ratio(BENT, train, 495.0)
    force = peak_force(BENT, train, 495.0).force
    # The fiftieth vehicle has the largest force behind it and one a fiftieth less before it.
    assert ratios[49] == pytest.approx(force * (1.0 - 0.5 / 50.0) * 10.0 / 500.0 / (100e3 * 9.80665))
    np.testing.assert_array_equal(lateral_ratio(TRIANGLE, train, 495.0), 0.0)


def test_speed_pushes_outside_and_cant_holds_against_it() -> None:
    level = TrackProfile.from_steps("canted", curvature=[(-5.0 * L, 1.0 / 500.0)], superelevation=[(-5.0 * L, 0.12)])
    balanced = np.sqrt(9.80665 * 0.12 / 1.5 * 500.0)
    assert lateral_ratio(level, free([5e4] * 3), 0.0, speed=balanced) == pytest.approx(0.0, abs=1e-12)
    assert lateral_ratio(level, free([5e4] * 3), 0.0, speed=2.0 * balanced) == pytest.approx(-3.0 * 0.12 / 1.5)


def test_sub_trains_share_the_wagons_by_power() -> None:
    train = Train(vehicles=(locomotive(), *[wagon()] * 30, locomotive(), locomotive(), *[wagon()] * 30))
    front, rear = sub_trains(train)
    assert len(front.lengths) + len(rear.lengths) == 63
    assert front.mass / train.mass == pytest.approx(1.0 / 3.0, abs=0.02)
    assert rear.offset == pytest.approx(front.length)
    assert len(sub_trains(heavy_haul(pairs=3))) == 1


def test_a_sub_train_is_felt_where_it_is() -> None:
    train = free([50e3] * 40)
    rear = Shape.of(train, 20)
    values = correlation(TRIANGLE, rear, LINE)
    assert LINE[np.argmax(values)] == pytest.approx(rear.offset)


@pytest.mark.parametrize(
    ("edges", "values"),
    [((0.0, 1.0), (1.0, 2.0)), ((1.0, 0.0), (1.0,)), ((0.0, 1.0), (0.0,))],
    ids=["count", "order", "nil"],
)
def test_what_is_no_pattern_is_refused(edges: tuple[float, ...], values: tuple[float, ...]) -> None:
    with pytest.raises(ConfigError, match="not a pattern"):
        Pattern(name="x", edges=edges, values=values)


def test_the_crest_pattern_is_the_one_of_the_example() -> None:
    assert (CREST.edges, CREST.values, CREST.size) == ((-1.0, 0.0, 1.0), (1.0, -1.0), 2.0)
