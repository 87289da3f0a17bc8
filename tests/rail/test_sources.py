"""Every computable function of the four sources: where it is, which test holds it, and the sources' own figures.

The first table is complete by construction: a function whose code or whose test is gone fails it. The second gives the
figures that the sources print and that can be computed in a line.
"""

from __future__ import annotations

import ast
import importlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sysid.rail.constants import MPH
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.end_of_train.brake_computer import ComputerSettings
from sysid.rail.track.card import CardCode, read_card
from sysid.rail.track.terrain import correlation, equivalent_grade_change, uniform
from sysid.rail.transit.deceleration import COAST, COAST_RATE, CRUISE, FULL_SERVICE, JERK, OPEN_LOOP, RATE, JerkProfile
from sysid.rail.transit.transit import braking, commanded_pressure

HERE = Path(__file__).parent
CARD = HERE.parents[1] / "datasets" / "rail-example" / "card-a-b.csv"

# source and function: (where it is, test file, test)
FUNCTIONS = {
    "000 F1 jerk-limited profile, cubic and quartic corners": (
        "transit.deceleration:JerkProfile",
        "transit",
        "test_a_profile_ends_at_its_speed_within_its_limits",
    ),
    "000 F2 inverse characteristic of four segments, found from a trace": (
        "transit.deceleration:identify_characteristic",
        "transit",
        "test_the_characteristic_found_from_a_trace_has_the_source_s_points",
    ),
    "000 F2 dead band of friction alone": (
        "transit.deceleration:Characteristic",
        "transit",
        "test_the_dead_band_ends_at_the_deceleration_of_friction_alone",
    ),
    "000 F3 open loop for two seconds, closed loop after": (
        "transit.transit:DecelerationController",
        "transit",
        "test_two_seconds_of_open_loop_do_not_look_at_the_speed",
    ),
    "000 F3 jerk in its limit": (
        "transit.transit:largest_jerk",
        "transit",
        "test_after_learning_the_jerk_of_the_whole_stop_is_within_its_limit",
    ),
    "000 F4 grade from tachometer and pendulum": (
        "transit.deceleration:grade_acceleration",
        "transit",
        "test_the_grade_is_what_the_pendulum_feels_beside_the_wheels",
    ),
    "000 F5 mean deceleration error of a stop": (
        "transit.transit:DecelerationController",
        "transit",
        "test_the_mean_deceleration_error_goes_to_zero_within_five_stops",
    ),
    "000 F6 modifier held between stops": (
        "transit.transit:DecelerationController",
        "transit",
        "test_the_modifier_holds_while_cruising_and_between_stops",
    ),
    "000 F7 overspeed to full service": (
        "transit.transit:DecelerationController",
        "transit",
        "test_an_overspeed_while_cruising_brakes_fully",
    ),
    "001 rate over a ring buffer": ("end_of_train.ring:Ring", "brake_computer", "test_a_ring_forgets_the_oldest"),
    "001 states and their transitions": (
        "end_of_train.brake_computer:BrakeComputer",
        "brake_computer",
        "test_transitions",
    ),
    "001 emergency from any state, and its end": (
        "end_of_train.brake_computer:State",
        "brake_computer",
        "test_an_emergency_that_ends_after_the_setup_goes_to_release",
    ),
    "001 stability of reservoir, head and tail": (
        "end_of_train.brake_computer:ComputerSettings",
        "brake_computer",
        "test_an_unstable_tail_keeps_the_train_from_release",
    ),
    "001 qualify minimum: the reservoir has fallen": (
        "end_of_train.brake_computer:ComputerSettings",
        "brake_computer",
        "test_a_falling_pipe_without_the_reservoir_is_no_application",
    ),
    "001 orders of an application": (
        "end_of_train.brake_computer:Message",
        "brake_computer",
        "test_orders_of_an_application",
    ),
    "001 target at the tail from the reduction at the head": (
        "end_of_train.tail_unit:TailUnit",
        "tail_unit",
        "test_the_target_follows_the_reduction_at_the_head",
    ),
    "001 release lets go": ("end_of_train.tail_unit:TailUnit", "tail_unit", "test_a_release_lets_go"),
    "001 refusal of a second minimum application": (
        "end_of_train.tail_unit:Answer",
        "tail_unit",
        "test_a_second_minimum_application_is_refused_until_the_release",
    ),
    "001 refusal of what the pipe has overtaken since the time stamp": (
        "end_of_train.tail_unit:Answer",
        "tail_unit",
        "test_a_minimum_application_that_the_pipe_has_overtaken_is_refused",
    ),
    "001 self-test": ("end_of_train.tail_unit:self_test", "tail_unit", "test_the_self_test"),
    "001 telemetry: accuracy, step, interval, delay, loss": (
        "end_of_train.tail_unit:Telemetry",
        "tail_unit",
        "test_reports_come_late_by_the_delay_and_may_be_lost",
    ),
    "001 braking from both ends": (
        "end_of_train.tail_unit:TwoEndedBrake",
        "tail_unit",
        "test_an_emergency_from_both_ends_of_150_cars_is_complete_in_the_published_16_s",
    ),
    "001 annotation of a trace": (
        "traces.annotate:annotate",
        "brake_computer",
        "test_every_event_of_the_command_is_found_within_2_s_and_none_is_invented",
    ),
    "002 card rows": ("track.card:read_card", "card", "test_the_example_card_is_the_line_of_the_source"),
    "002 read-ahead": ("track.card:CardReader", "card", "test_a_row_is_known_once_the_train_is_the_offset_before_it"),
    "002 predicted speed, true acceleration": (
        "transit.notch:predicted_speed",
        "card",
        "test_the_predicted_speed_and_the_true_acceleration",
    ),
    "002 evaluation ES": ("transit.notch:Closeness", "card", "test_closeness_is_flat_then_falls_faster_above"),
    "002 evaluation ENC": ("transit.notch:Calm", "card", "test_calm_rises_to_one_at_t1_t2_t3"),
    "002 the notch with the largest minimum of both": (
        "transit.notch:choose",
        "card",
        "test_the_notch_with_the_largest_smaller_evaluation_wins",
    ),
    "002 predicted stop position": (
        "transit.notch:Predictor",
        "card",
        "test_the_predicted_stop_is_where_the_train_stops",
    ),
    "002 automatic stop, the lower notch winning": (
        "transit.ato:CardDriver",
        "card",
        "test_the_card_stops_at_the_station",
    ),
    "002 fewer notch changes": (
        "transit.ato:FullNotchDriver",
        "card",
        "test_the_card_changes_notches_less_often_than_the_full_notch",
    ),
    "002 less energy": ("transit.ato:FullNotchDriver", "card", "test_the_card_takes_less_energy_than_the_full_notch"),
    "002 no overspeed at the limit": (
        "transit.ato:target_speed",
        "card",
        "test_the_card_enters_the_limit_within_it_and_the_full_notch_does_not",
    ),
    "003 correlation with crest and sag": ("track.terrain:correlation", "terrain", "test_the_worked_example"),
    "003 weights of the cars": ("track.terrain:Shape", "terrain", "test_weights_change_nothing_for_a_uniform_train"),
    "003 look-ahead": ("track.terrain:correlation", "terrain", "test_look_ahead_is_a_shift"),
    "003 several patterns": ("track.terrain:combined", "terrain", "test_patterns_are_combined"),
    "003 effective grade": (
        "track.terrain:effective_grade",
        "terrain",
        "test_the_effective_grade_is_the_mean_under_the_train_and_lags_by_it",
    ),
    "003 curvature and superelevation": (
        "track.terrain:stringlining_risk",
        "terrain",
        "test_risk_is_nil_on_tangent_track_grows_with_the_curve_and_falls_with_speed",
    ),
    "003 four rules of a crest's beginning": (
        "track.features:crest_starts",
        "terrain",
        "test_the_four_rules_of_a_crest_s_beginning",
    ),
    "003 severity": ("track.features:Thresholds", "terrain", "test_severity_may_differ_between_crest_and_sag"),
    "003 features of a line": ("track.features:features", "terrain", "test_features_of_a_hill_and_a_valley"),
    "003 handling of a crest": (
        "track.handling:crest_handling",
        "terrain",
        "test_power_is_cut_until_half_the_train_is_past_the_crest",
    ),
    "003 handling of a sag": (
        "track.handling:sag_acceleration",
        "terrain",
        "test_a_sag_is_taken_with_the_natural_acceleration",
    ),
    "003 sub-trains of distributed power": (
        "track.handling:sub_trains",
        "terrain",
        "test_sub_trains_share_the_wagons_by_power",
    ),
    "003 slack of 4 to 6 in per coupler": (
        "dynamics.coupler:Coupler",
        "parts",
        "test_four_to_six_inches_lie_between_bunched_and_stretched",
    ),
    "003 peak coupler force against the correlation": (
        "track.handling:peak_force",
        "terrain",
        "test_the_largest_force_over_a_crest_is_at_the_apex_and_half_the_weight_times_the_grade",
    ),
}


@pytest.mark.parametrize("function", FUNCTIONS)
def test_a_function_of_a_source_is_there_and_tested(function: str) -> None:
    where, file, test = FUNCTIONS[function]
    module, name = where.split(":")
    assert callable(getattr(importlib.import_module(f"sysid.rail.{module}"), name))
    (tests,) = HERE.rglob(f"test_{file}.py")
    tree = ast.parse(tests.read_text(encoding="utf-8"))
    assert test in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def crest(at: float) -> float:
    """The worked example: as much up as down, in train lengths of 1,000 m from the apex, in shares of the grade."""
    track = TrackProfile.from_steps("triangle", grade=[(-5000.0, 0.01), (0.0, -0.01)])
    return float(correlation(track, uniform(1000.0), np.array([1000.0 * at]))[0]) / 0.01


FIGURES: dict[str, tuple[Callable[[], object], object]] = {
    "000 40 to 20 mph takes 12 s": (lambda: JerkProfile(start=40 * MPH, stop=20 * MPH).duration, 12.0),
    "000 2 mph/s, 1 mph/s2, open loop for 2 s": (lambda: [RATE / MPH, JERK / MPH, OPEN_LOOP], [2.0, 1.0, 2.0]),
    "000 60 mA coasts, 70 cruises, 20 is full service": (lambda: [COAST, CRUISE, FULL_SERVICE], [60.0, 70.0, 20.0]),
    "000 17 psi at 32 mA and 21 at 28": (lambda: [commanded_pressure(32.0), commanded_pressure(28.0)], [17.0, 21.0]),
    "000 friction alone gives 0.7 mph/s": (lambda: COAST_RATE / MPH, 0.7),
    "000 2 mph/s at 43 mA": (lambda: (COAST_RATE + braking(commanded_pressure(43.0))) / MPH, 2.0),
    "000 5 mph/s at 20 mA": (lambda: (COAST_RATE + braking(commanded_pressure(20.0))) / MPH, 5.0),
    "001 a minute of history": (lambda: ComputerSettings().history, 60.0),
    "002 the line falls by 20 and rises by 20 per mille": (
        lambda: sorted({row.value for row in read_card(CARD).section("A") if row.code is CardCode.GRADE}),
        [-20.0, -5.0, 5.0, 20.0],
    ),
    "002 45 km/h from 0.35 km": (
        lambda: [
            row.value for row in read_card(CARD).section("A") if row.code is CardCode.LIMIT and row.distance == 350.0
        ],
        [45.0],
    ),
    "002 a radius of 600 m from 0.4 to 0.5 km": (
        lambda: [
            row.distance for row in read_card(CARD).section("A") if row.code is CardCode.CURVE and row.value == 600.0
        ],
        [400.0],
    ),
    "003 triangle at -L, -L/2, 0, L/2, L": (
        lambda: [crest(at) for at in (-1.0, -0.5, 0.0, 0.5, 1.0)],
        [0.0, 0.5, 1.0, 0.5, 0.0],
    ),
    "003 the grade falls by twice the correlation": (
        lambda: equivalent_grade_change(np.array([0.01])).tolist(),
        [-0.02],
    ),
}


@pytest.mark.parametrize("figure", FIGURES)
def test_a_figure_of_a_source(figure: str) -> None:
    compute, printed = FIGURES[figure]
    found = compute()
    assert found == pytest.approx(printed, abs=1e-9)
