"""The track card: file, read-ahead, refusals; and the notch choice on the source's own example track."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError, ReaderError
from sysid.rail.constants import KMH
from sysid.rail.dynamics.brake import no_brake
from sysid.rail.dynamics.drive import AbstractDriver, Limits, Run, drive
from sysid.rail.dynamics.motion import MovingTrain
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import heavy_haul, read_train
from sysid.rail.track.card import CardCode, CardReader, TrackCard, read_card
from sysid.rail.transit.ato import AtoSettings, CardDriver, FullNotchDriver, target_speed
from sysid.rail.transit.notch import Calm, Closeness, Predictor, choose, predicted_speed, true_acceleration

EXAMPLE = Path(sysid.__file__).parent.parent / "datasets" / "rail-example"
STOP, POINT = 1000.0, 700.0


@pytest.fixture(scope="module")
def card() -> TrackCard:
    return read_card(EXAMPLE / "card-a-b.csv")


# --- the card


def test_the_example_card_is_the_line_of_the_source(card: TrackCard) -> None:
    track = card.profile("A")
    x = np.array([50.0, 150.0, 600.0, 699.0, 701.0, 950.0])
    np.testing.assert_allclose(track.grade(x), [0.005, -0.020, -0.020, -0.020, 0.020, -0.005])
    np.testing.assert_allclose(track.curvature(np.array([399.0, 401.0, 499.0, 501.0])), [0.0, 1 / 600, 1 / 600, 0.0])
    assert float(track.speed_limit(351.0)) == pytest.approx(45.0 * KMH)
    assert float(track.speed_limit(349.0)) > 45.0 * KMH
    assert card.sections == ("A", "B")


@pytest.mark.parametrize(("travelled", "known"), [(0.0, -0.020), (599.0, -0.020), (600.0, 0.020), (800.0, -0.005)])
def test_a_row_is_known_once_the_train_is_the_offset_before_it(card: TrackCard, travelled: float, known: float) -> None:
    reader = CardReader(card, "A", offset=100.0)
    reader.read(travelled)
    assert float(reader.profile.grade(900.0)) == known


def test_rows_are_read_once_and_in_order(card: TrackCard) -> None:
    reader = CardReader(card, "A", offset=200.0)
    read = [row for x in (0.0, 149.9, 150.0, 800.0) for row in reader.read(x)]
    assert read == list(card.section("A"))
    assert reader.read(2000.0) == ()
    assert [row.code for row in CardReader(card, "A", offset=200.0).read(0.0)].count(CardCode.LIMIT) == 1


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("a,b\n", ReaderError, "no track card"),
        ("section,distance_km,code,value\nA,0.1,GRADIENT,5\n", ReaderError, "row of the card"),
        ("section,distance_km,code,value\nA,x,GRADE,5\n", ReaderError, "row of the card"),
        ("section,distance_km,code,value\nA,0.2,GRADE,5\nA,0.1,GRADE,4\n", ConfigError, "do not increase"),
        ("section,distance_km,code,value\nA,0.2,CURVE,0\n", ConfigError, "not positive"),
    ],
    ids=["header", "code", "number", "order", "radius"],
)
def test_what_is_no_card_is_refused(tmp_path: Path, text: str, error: type[Exception], message: str) -> None:
    file = tmp_path / "card.csv"
    file.write_text(text)
    with pytest.raises(error, match=message):
        read_card(file)


def test_a_section_that_is_not_on_the_card_is_refused(card: TrackCard) -> None:
    with pytest.raises(ConfigError, match="no section C"):
        card.profile("C")


# --- tables of the notch choice

ES = Closeness(band=1.0, above=2.0, below=8.0)


@pytest.mark.parametrize(
    ("difference", "value"),
    [(-9.0, 0.0), (-5.0, 0.5), (-1.0, 1.0), (0.0, 1.0), (1.0, 1.0), (2.0, 0.5), (3.0, 0.0), (math.inf, 0.0)],
)
def test_closeness_is_flat_then_falls_faster_above(difference: float, value: float) -> None:
    assert ES(difference) == pytest.approx(value)


@pytest.mark.parametrize(
    ("since", "difference", "value"),
    [
        (0.0, 0, 1.0),
        (1.0, 1, 0.5),
        (2.0, 1, 1.0),
        (2.0, -2, 0.5),
        (4.0, 2, 1.0),
        (3.0, 3, 0.5),
        (6.0, -3, 1.0),
        (3.0, 7, 0.5),
    ],
)
def test_calm_rises_to_one_at_t1_t2_t3(since: float, difference: int, value: float) -> None:
    assert Calm(times=(2.0, 4.0, 6.0))(since, difference) == pytest.approx(value)


@pytest.mark.parametrize(
    ("outcome", "since", "present", "chosen"),
    [
        ([0.0, 0.2, 0.9, 1.0], 9.0, 0, 2),
        ([0.0, 0.2, 0.9, 1.0], 1.0, 0, 1),
        ([0.0, 0.3, 0.3, 0.3], 9.0, 0, 0),
        ([0.5, 0.2, 0.5, 0.1], 9.0, 0, -1),
        ([1.0, 1.0, 1.0, 1.0], 9.0, 1, 1),
    ],
    ids=["the best outcome", "calm forbids the jump", "the present one of equals", "the lower of equals", "no need"],
)
def test_the_notch_with_the_largest_smaller_evaluation_wins(
    outcome: list[float], since: float, present: int, chosen: int
) -> None:
    verdict = choose((-1, 0, 1, 2), np.array(outcome), present=present, since_change=since, calm=Calm())
    assert verdict.chosen == chosen
    np.testing.assert_array_equal(verdict.total, np.minimum(verdict.outcome, verdict.comfort))


def test_the_predicted_speed_and_the_true_acceleration() -> None:
    assert predicted_speed(10.0, 0.3, 0.196, -0.011, 5.0) == pytest.approx(10.0 + 0.485 * 5.0)
    assert true_acceleration(0.485, 0.196, -0.011) == pytest.approx(0.3)


def test_the_predicted_stop_is_where_the_train_stops(card: TrackCard) -> None:
    train, track = read_train(EXAMPLE / "commuter.yaml"), card.profile("A")
    predicted = Predictor(train).stop_position(track, 500.0, 15.0, -3)
    moving = MovingTrain(train=train, track=track, speed=15.0, position=500.0)
    run = moving.advance(np.zeros((400, 4)), notch=-3)
    assert run.positions[-1, 0] == pytest.approx(predicted, abs=1.0)
    assert Predictor(train).stop_position(track, 500.0, 15.0, 0) == math.inf


def test_a_train_without_notches_cannot_be_driven_by_them() -> None:
    train = dataclasses.replace(heavy_haul(pairs=1), vehicles=heavy_haul(pairs=1).vehicles[1:])
    with pytest.raises(ConfigError, match="no notches"):
        Predictor(train)


def test_a_lower_limit_ahead_is_approached_by_a_braking_curve() -> None:
    track = TrackProfile.from_steps("limits", speed_limit=[(0.0, 20.0), (300.0, 10.0), (400.0, 20.0)])
    target = [target_speed(track, x, margin=1.0, planned=0.5, length=50.0) for x in (10.0, 200.0, 299.0, 430.0, 460.0)]
    expected = [math.sqrt(81.0 + 290.0), math.sqrt(81.0 + 100.0), math.sqrt(82.0), 9.0, 19.0]
    assert target == pytest.approx([min(value, 19.0) for value in expected])


# --- the example run


def run_of(driver: AbstractDriver, card: TrackCard) -> Run:
    train = read_train(EXAMPLE / "commuter.yaml")
    moving = MovingTrain(train=train, track=card.profile("A"))
    return drive(moving, no_brake(len(train.vehicles)), driver, Limits(duration=300.0, block=1))


@pytest.fixture(scope="module")
def by_card(card: TrackCard) -> Run:
    return run_of(
        CardDriver(train=read_train(EXAMPLE / "commuter.yaml"), card=card, section="A", stop=STOP, point=POINT), card
    )


@pytest.fixture(scope="module")
def full_notch(card: TrackCard) -> Run:
    train = read_train(EXAMPLE / "commuter.yaml")
    return run_of(FullNotchDriver(train=train, limits=card.profile("A"), stop=STOP, point=POINT), card)


def overspeed(run: Run, card: TrackCard) -> float:
    track, length = card.profile("A"), 80.0
    limits = [track.lowest_limit(x - length, x) for x in run.position]
    return float((run.speed - limits).max())


def test_the_card_changes_notches_less_often_than_the_full_notch(by_card: Run, full_notch: Run) -> None:
    assert by_card.notch_changes < full_notch.notch_changes


def test_the_card_takes_less_energy_than_the_full_notch(by_card: Run, full_notch: Run) -> None:
    assert by_card.traction_work < full_notch.traction_work
    # Not by being late.
    assert by_card.motion.time[-1] <= full_notch.motion.time[-1]


def test_the_card_enters_the_limit_within_it_and_the_full_notch_does_not(
    by_card: Run, full_notch: Run, card: TrackCard
) -> None:
    assert overspeed(by_card, card) < 0.0
    assert overspeed(full_notch, card) > 0.0


def test_the_card_stops_at_the_station(by_card: Run) -> None:
    assert by_card.position[-1] == pytest.approx(STOP, abs=0.5)
    assert by_card.speed[-1] < 0.01


def test_braking_starts_late_because_the_ascent_is_known(by_card: Run) -> None:
    """The source: from the point at 0.7 km the train goes on, and is decelerated later and harder."""
    braking = by_card.position[np.flatnonzero((by_card.notch < 0) & (by_card.position > 650.0))[0]]
    assert braking > POINT + 50.0


@pytest.mark.parametrize("limit", [55.0, 60.0, 65.0])
def test_the_comparison_holds_for_other_speeds_of_the_line(card: TrackCard, limit: float) -> None:
    rows = tuple(
        dataclasses.replace(row, value=limit) if row.code is CardCode.LIMIT and row.value == 70.0 else row
        for row in card.rows
    )
    other, train = TrackCard(rows=rows), read_train(EXAMPLE / "commuter.yaml")
    first = run_of(CardDriver(train=train, card=other, section="A", stop=STOP, point=POINT), other)
    second = run_of(FullNotchDriver(train=train, limits=other.profile("A"), stop=STOP, point=POINT), other)
    assert first.notch_changes < second.notch_changes
    assert first.traction_work < second.traction_work
    assert overspeed(first, other) < 0.0
    assert first.position[-1] == pytest.approx(STOP, abs=0.7)


def test_the_settings_are_named_and_can_be_changed() -> None:
    assert AtoSettings(margin=1.0).margin == 1.0
    with pytest.raises(ConfigError, match="closeness"):
        Closeness(band=0.0, above=2.0, below=1.0)
    with pytest.raises(ConfigError, match="calm"):
        Calm(times=(2.0, 2.0, 3.0))
