"""Which structures are tried, in which order, and when a search ends."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from sysid.models import ARX, HammersteinWiener, LinearStateSpace, NeuralStateSpace, VectorGreyBox, WienerHammerstein
from sysid.workbench.auto.budget import FINAL, price
from sysid.workbench.auto.look import Looked
from sysid.workbench.auto.plan import AT_ONCE, FIRST, HELD, MET, PATIENCE
from sysid.workbench.auto.worth import error
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import LOOKED, by_size, linear, planned, searched, trial

UNASKED = 4
"""Rounds that are tried whatever comes of them: linear structures, then others; the least of each kind first."""


def test_linear_structures_come_first_and_alone() -> None:
    _, rounds = searched(lambda _: 1.0)
    # The least of each kind tells what the others of it cost.
    assert [point.structure.label for point in rounds[0]] == [
        "ARX [2; 2; 1]",
        "TF [1; 0; 1]",
        "SS 1 without noise model",
    ]
    assert all(map(linear, rounds[1]))
    assert {point.structure.kind for point in rounds[1]} >= {"SS", "TransferFunction"}
    assert not any(map(linear, (point for later in rounds[2:] for point in later)))


def test_linear_structures_leave_time_for_networks() -> None:
    clock = [0.0]
    plan = planned(100.0, clock=clock)
    tried: list[Point] = []
    while (points := plan.ask()) and len(tried) < 20:
        tried += points
        seconds = [15.0 if point.structure.kind == "TransferFunction" else 0.1 for point in points]
        clock[0] += sum(seconds)
        plan.tell([trial(p, 1.0).model_copy(update={"seconds": s}) for p, s in zip(points, seconds, strict=True)])
    assert plan.left_out == ["TF [2; 1; 1]"]
    assert any(not linear(point) for point in tried)


@pytest.mark.parametrize(("after", "workers", "some"), [(70.0, 1, 1), (70.0, 2, 2), (90.0, 2, 0)])
def test_a_slow_machine_tries_a_nonlinear_model_a_worker_where_that_leaves_time_for_the_last_fit(
    after: float, workers: int, some: int
) -> None:
    clock = [0.0]
    plan = planned(100.0, clock=clock, workers=workers)
    plan.tell([trial(point, 1.0) for point in plan.ask()])
    clock[0] = after
    while (points := plan.ask()) and all(map(linear, points)):  # what takes no time is tried in any case
        plan.tell([trial(point, 1.0) for point in points])
    assert [linear(point) for point in points] == [False] * some


def test_linear_structures_that_take_no_time_are_tried_however_late_it_is() -> None:
    clock = [0.0]
    plan = planned(100.0, clock=clock)
    plan.tell([trial(point, 1.0) for point in plan.ask()])
    clock[0] = 75.0
    tried = plan.ask()
    assert tried and all(map(linear, tried))
    assert plan.left_out == []


def test_the_least_linear_structures_are_tried_whatever_the_time_until_one_can_be_used() -> None:
    plan = planned(1.0, clock=[1000.0])
    tried: list[str] = []
    while points := plan.ask():
        tried += [point.structure.label for point in points]
        plan.tell([trial(point, 1.0 if len(tried) == 2 else math.inf) for point in points])
    assert tried == ["ARX [2; 2; 1]", "ARX [0; 10; 0]"]
    assert plan.hurried


def test_in_motion_one_network_is_tried_whatever_the_time_and_equations_of_events_before_it() -> None:
    """On a busy machine a ball, whose equations were found, had a linear model that begins at rest."""
    events = VectorGreyBox(equations="y = where(before >= 1, 0, before + u)\nbefore[k+1] = y", initial={"before": 0})
    for found, first, hurried in (
        ({}, "NSS", True),
        ({"resets": events}, "VectorGreyBox", False),
        ({"mechanism": (events,)}, "VectorGreyBox", True),  # which may be far off: its numbers were fitted once
    ):
        plan = planned(1.0, clock=[1000.0], looked=replace(LOOKED, in_motion=True, **found))
        (point,) = plan.ask()
        assert point.structure.kind.endswith(first)
        plan.tell([trial(point, 1.0)])
        assert plan.ask() == []
        assert plan.hurried is hurried


def test_curves_and_polynomials_are_tried_beside_networks() -> None:
    _, rounds = searched(lambda _: 1.0)
    # The least of each kind tells what the others of it cost; what takes several times as long waits.
    kinds = ["NSS", "NARX", "HammersteinWiener", "PolynomialNARX"]
    assert [point.structure.kind for point in rounds[2]] == kinds
    assert [point.structure.kind for point in rounds[3]][-2:] == ["WienerHammerstein"] * 2
    labels = [point.structure.label for one in rounds[2:UNASKED] for point in one]
    assert {"HW 2, piecewise 6 before", "HW 2, piecewise 6 behind"} <= set(labels)
    assert "polynomial NARX 2/2, degree 3, up to 20 terms" in labels
    assert any(label.startswith("NSS") for label in labels)


def test_a_block_with_a_good_curve_is_followed() -> None:
    def worth(point: Point) -> float:
        one = point.structure
        return 1.0 / (one.states + (one.output.kind != "none")) if isinstance(one, HammersteinWiener) else 1.0

    _, rounds = searched(worth)
    labels = {point.structure.label for one in rounds for point in one}
    assert {"HW 3, piecewise 6 behind", "HW 6, piecewise 6 behind"} <= labels
    assert "HW 3, piecewise 6 before, piecewise 6 behind" in labels


def test_a_search_that_gains_nothing_ends_soon() -> None:
    plan, rounds = searched(lambda _: 1.0)
    assert len(rounds) == UNASKED + PATIENCE
    assert "gained less" in plan.ended


def test_a_search_goes_where_it_gains() -> None:
    plan, _ = searched(by_size)
    best = min(plan.trials, key=error)
    assert (best.structure["states"], best.structure["neurons"]) >= (3, 20)


def test_nothing_is_tried_twice_and_nothing_that_cannot_be() -> None:
    _, rounds = searched(by_size)
    tried = [(point.structure.to_dict(), dict(point.training)) for one in rounds for point in one]
    assert all(tried.count(one) == 1 for one in tried)


def test_what_cannot_be_used_leads_nowhere() -> None:
    plan, rounds = searched(lambda point: 1.0 if linear(point) else math.inf)
    assert len(rounds) == UNASKED
    assert plan.least() == 1.0


@pytest.mark.parametrize("iterations", [5, 20, 400, 1000])
def test_iterations_are_not_overspent(iterations: int) -> None:
    plan, rounds = searched(by_size, iterations=iterations)
    assert sum(price(point) for one in rounds for point in one) <= iterations
    assert plan.ended == "the budget is spent"


def test_the_same_results_give_the_same_search() -> None:
    def said() -> list[str]:
        return [str((p.number, p.structure, p.training)) for one in searched(by_size, iterations=3000)[1] for p in one]

    assert said() == said()


@pytest.mark.parametrize("looked", [Looked(n_inputs=0, n_outputs=1), Looked(n_inputs=3, n_outputs=2), LOOKED])
def test_there_is_something_to_try_for_any_mapping(looked: Looked) -> None:
    _, rounds = searched(lambda _: 1.0, looked=looked)
    assert {linear(point) for one in rounds for point in one} == {True, False}


def test_one_linear_model_is_tried_where_networks_that_came_first_took_the_time() -> None:
    """Without it nobody knew that a furnace's network, with half the time, was worse than least squares."""
    clock = [0.0]
    plan = planned(100.0, clock=clock, looked=replace(LOOKED, in_motion=True))
    tried: list[Point] = []
    while points := plan.ask():
        tried += points
        clock[0] += 55.0 if len(tried) == len(points) else 1.0
        plan.tell([trial(point, 1.0) for point in points])
    assert "ARX [2; 2; 1]" in [point.structure.label for point in tried if linear(point)]


def test_what_stands_at_ends_has_first_what_is_held_there() -> None:
    for ends in (False, True):
        _, rounds = searched(lambda _: 1.0, looked=replace(LOOKED, ends=ends, all_end=ends))
        held = [point for points in rounds for point in points if "limits found" in point.structure.label]
        assert bool(held) is ends
        assert ("limits found" in rounds[0][0].structure.label) is ends
        assert all(point.training["pretraining"] for point in held)
        assert len({tuple(map(len, point.structure.input_delays)) for point in held}) > 1 or not ends


def test_what_is_held_at_ends_leaves_time_for_other_kinds_however_long_it_gains() -> None:
    """On the tanks it had taken ten minutes, and no state space was tried that has half of its error."""

    def worth(point: Point) -> float:
        return 0.9**point.number if "limits found" in point.structure.label else 1.0

    plan, rounds = searched(worth, iterations=8_000, looked=replace(LOOKED, ends=True, all_end=True))
    tried = [point for points in rounds for point in points]
    first = next(k for k, point in enumerate(tried) if point.structure.kind == "SS" and point.structure.states > 1)
    assert sum(price(point) for point in tried[:first]) < (FIRST + 0.2) * 8_000
    assert len([point for point in tried[first:] if point.structure.kind == "NSS"]) >= 3
    assert plan.ended == "the budget is spent"


def test_no_round_of_what_is_held_at_ends_lasts_for_all_of_the_time() -> None:
    """As one of large networks does on a busy machine."""
    spent, when = [0.0], dict[str, float]()
    looked = replace(LOOKED, ends=True, all_end=True)
    plan = planned(600.0, clock=spent, workers=2, looked=looked, training={"max_time_s": 90.0})
    while points := plan.ask():
        found = []
        for point in points:
            held = "limits found" in point.structure.label
            when.setdefault(point.structure.label, spent[0])
            told = {"seconds": 80.0 if held else 2.0, "cpu_s": 80.0 if held else 2.0}
            found.append(trial(point, 0.9**point.number if held else 1.0).model_copy(update=told))
        spent[0] += sum(one.seconds for one in found) / 2
        plan.tell(found)
    assert when["SS 2 without noise model"] < (FIRST + 0.1) * 600.0
    assert plan.left_out == []


def test_where_some_of_several_outputs_end_one_network_has_all_of_them() -> None:
    for all_end in (False, True):
        _, rounds = searched(lambda _: 1.0, looked=replace(LOOKED, ends=True, all_end=all_end, n_outputs=2))
        kinds = {p.structure.kind for points in rounds for p in points if "limits found" in p.structure.label}
        assert kinds == ({"NARX", "VectorNARX"} if all_end else {"VectorNARX"})


def test_of_several_outputs_an_arx_model_of_all_is_tried_beside_one_an_output() -> None:
    for outputs in (1, 2):
        _, rounds = searched(lambda _: 1.0, looked=replace(LOOKED, n_outputs=outputs))
        tried = [point.structure.label for points in rounds for point in points]
        assert tried[:2] == ["ARX [2; 2; 1]", "VectorARX [1; 1; 1]" if outputs > 1 else "TF [1; 0; 1]"]
        assert ("VectorARX [2; 2; 1]" in tried) is (outputs > 1)


def test_of_two_outputs_in_motion_what_has_a_state_for_each_comes_first() -> None:
    """A short search tries one or two: an oscillator of two outputs had one state, and an error of a third."""
    for outputs, first in ((1, "NSS 1/4"), (2, "NSS 2/8"), (3, "NSS 3/8")):
        _, rounds = searched(lambda _: 1.0, looked=replace(LOOKED, in_motion=True, n_outputs=outputs))
        assert rounds[0][0].structure.label == first


def test_what_begins_in_motion_has_first_what_remembers_one_sample_or_learns_where_it_begins() -> None:
    for in_motion in (False, True):
        _, rounds = searched(lambda _: 1.0, looked=replace(LOOKED, in_motion=in_motion))
        tried = [point.structure.label for points in rounds[:3] for point in points]
        assert linear(rounds[0][0]) is not in_motion
        assert all((label in tried) is in_motion for label in ("ARX [1; 1; 1]", "NSS 2/0", "NSS 1/4", "NARX 1/1/10"))


def test_what_adds_up_has_first_what_adds_up_exactly() -> None:
    for sums in (0, 1, 2):
        _, rounds = searched(lambda _: 1.0, looked=replace(LOOKED, integrators=sums, n_outputs=max(sums, 1)))
        spaces = [p.structure for points in rounds for p in points if isinstance(p.structure, NeuralStateSpace)]
        assert {one.integrators for one in spaces} == {sums}
        assert {one.integrators_seen for one in spaces} == ({False, True} if sums else {False})
        assert {one.output for one in spaces} <= {"plain", "absolute"} - ({"absolute"} if sums else set())
        assert linear(rounds[0][0]) is (sums == 0)
        assert min(one.states for one in spaces) > sums or not sums


def test_where_no_network_can_be_used_the_time_for_their_other_starts_is_for_more_of_them() -> None:
    clock = [0.0]
    plan = planned(100.0, clock=clock)
    rounds: list[list[Point]] = []
    while points := plan.ask():
        rounds.append(points)
        lost = [not linear(point) for point in points]
        clock[0] += 6.0 * sum(lost)
        plan.tell([
            trial(p, math.nan if one else 1.0).model_copy(update={"seconds": 6.0 if one else 0.1})
            for p, one in zip(points, lost, strict=True)
        ])  # fmt: skip
    tried = [(point.structure.label, str(point.training)) for points in rounds for point in points]
    assert plan.budget.kept == 0.0
    assert len(tried) == len(set(tried)), "nothing is tried twice"
    last = rounds[-1]
    assert not any(map(linear, last))
    before = clock[0] - 6.0 * len(last)
    refit = plan.budget.refit
    assert before <= (1.0 - refit - FINAL) * 100.0 < clock[0] <= (1.0 - refit) * 100.0


@pytest.mark.parametrize(("needed", "begun"), [(1, 2), (3, 3), (5, 5)])
def test_networks_begin_with_as_many_states_as_a_linear_model_needs(needed: int, begun: int) -> None:
    def worth(point: Point) -> float:
        one = point.structure
        if not isinstance(one, LinearStateSpace):
            return 2.0
        return max(1.0, 1.0 + needed - one.states) - 0.001 * one.states  # more than needed gain next to nothing

    plan, rounds = searched(worth)
    first = next(point.structure for one in rounds for point in one if point.structure.kind == "NSS")
    assert (plan.looked.states, first.states) == (needed, begun)


def test_linear_models_get_more_states_as_long_as_these_gain() -> None:
    def worth(point: Point) -> float:
        one = point.structure
        return 1.0 / min(one.states, 14) if isinstance(one, LinearStateSpace) else 1.0

    plan, rounds = searched(worth)
    tried = [point.structure.states for one in rounds for point in one if point.structure.kind == "SS"]
    assert tried == [1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 18]
    # Networks begin where linear models ended.
    assert plan.looked.states == 14
    assert any(point.structure.label.startswith("NSS 14/") for one in rounds for point in one)
    # Small ones say little then: blocks, which have many states, come before them.
    assert next(p for one in rounds for p in one if not linear(p)).structure.label == "WH 3/3, rounded 4"
    assert max(t.structure["states"] for t in searched(lambda _: 1.0)[0].trials if t.structure["kind"] == "SS") == 4


@pytest.mark.parametrize(
    ("shown", "block", "states"), [(6, "WH 3/3", None), (7, "WH 4/4", 7), (9, "WH 4/4", 8), (3, None, None)]
)
def test_states_that_a_curve_hides_from_free_runs_count_where_the_past_shows_them(
    shown: int, block: str | None, states: int | None
) -> None:
    """Beyond four states linear models gain next to nothing; twice as many as they have are believed at most."""

    def worth(point: Point) -> float:
        one = point.structure
        return 1.4 - 0.1 * min(one.states, 4) if isinstance(one, LinearStateSpace) else 1.0

    plan, rounds = searched(worth, looked=replace(LOOKED, shown=shown))
    assert plan.looked.states == 4
    nonlinear = [point.structure.label for one in rounds for point in one if not linear(point)]
    assert nonlinear[0].startswith(block or "NSS")
    assert states is None or any(label.startswith(f"NSS {states}/8") for label in nonlinear)


def test_what_answers_within_the_sample_has_linear_models_that_do() -> None:
    _, rounds = searched(lambda _: 1.0, looked=replace(LOOKED, orders=(ARX(na=2, nb=(2,), nk=(0,)),)))
    assert all(p.structure.feedthrough for one in rounds for p in one if isinstance(p.structure, LinearStateSpace))


def test_two_blocks_are_followed_where_they_lead() -> None:
    def worth(point: Point) -> float:
        one = point.structure
        size = isinstance(one, WienerHammerstein) and min(one.first, 3) + min(one.second, 4) + 3 * min(one.between, 1)
        return 1.0 / (1.0 + size)

    plan, _ = searched(worth)
    best = min(plan.trials, key=error).structure
    assert (best["second"], best["between"], best["delays"]) == (4, 1, 0)


def test_only_what_can_be_cut_short_has_a_limit_and_that_has_it() -> None:
    points = planned(100.0, training={"max_time_s": 10.0}).ask()
    assert {p.structure.kind: p.training.get("max_time_s") for p in points} == {
        "ARX": None, "TransferFunction": 10.0, "SS": 10.0,
    }  # fmt: skip


@pytest.mark.parametrize("shares", [(0.001, 0.004), (0.001, 0.04)])
def test_equations_of_events_come_first_and_end_the_search_where_they_stay_within_the_tolerance(
    shares: tuple[float, ...],
) -> None:
    events = VectorGreyBox(equations="y = where(before >= 1, 0, before + u)\nbefore[k+1] = y", initial={"before": 0})
    looked, training = replace(LOOKED, resets=events), {"max_iterations": 50}
    plan = planned(iterations=10**9, looked=looked, training=training, tolerance=0.01, again=0)
    (first,) = plan.ask()
    assert first.structure == events
    plan.tell([trial(first, 1e-6).model_copy(update={"selection_rms_shares": list(shares)})])
    assert bool(plan.ask()) is (max(shares) > 0.01)
    assert (plan.ended == MET) is (max(shares) <= 0.01)


@pytest.mark.parametrize(("errors", "tried"), [((0.004,), 1), ((0.04, 0.004), 2), ((0.04, 0.04), 2)])
def test_equations_of_what_holds_an_output_are_tried_one_by_one_before_networks(
    errors: tuple[float, ...], tried: int
) -> None:
    some = tuple(
        VectorGreyBox(equations=f"y = deadzone(before + a*u, -{k}, {k})\nbefore[k+1] = y", parameters={"a": 0.1})
        for k in (1, 2)
    )
    plan = planned(iterations=10**9, looked=replace(LOOKED, mechanism=some), tolerance=0.01, again=0)
    for share, structure in zip(errors, some, strict=False):
        (point,) = plan.ask()
        assert (point.structure, point.training["starts"]) == (structure, 1)
        plan.tell([trial(point, share**2).model_copy(update={"selection_rms_shares": [share, 0.001]})])
    more = plan.ask()
    assert len(plan.points) - len(more) == tried
    assert (plan.ended == HELD) is (min(errors) <= 0.01)
    assert bool(more) is (min(errors) > 0.01)


def test_of_records_without_noise_networks_with_clear_states_are_tried_before_blocks_and_polynomials() -> None:
    """Blocks took a fifth of the time, one model an output, and ended unstable."""
    _, rounds = searched(by_size, looked=replace(LOOKED, exact=True, clear=3))
    first = next(points for points in rounds if not linear(points[0]))
    assert [point.structure.label for point in first] == ["NSS 3/8", "NSS 3/16", "NSS 4/12"]
    near = {str(point.training.get("regularisation")) for points in rounds for point in points if points is not first}
    assert near == {"None"}, "sizes are changed, weights that hold noise down are not tried"


def test_a_map_without_memory_is_tried_before_states_and_alone_where_it_meets_the_tolerance() -> None:
    static = replace(LOOKED, static=True)
    _, rounds = searched(lambda _: 1.0, looked=static)
    assert [point.structure.label for point in rounds[0]] == ["NFIR 0:0/12", "NFIR 0:0/24"]
    assert any(linear(point) for some in rounds for point in some)
    plan = planned(iterations=10**9, looked=static, tolerance=0.01, again=0)
    points = plan.ask()
    plan.tell([trial(point, 1e-6).model_copy(update={"selection_rms_shares": [1e-3]}) for point in points])
    assert (plan.ask(), plan.ended) == ([], AT_ONCE)


def test_a_network_comes_before_trained_linear_models_where_the_look_took_their_time() -> None:
    for seconds, kinds in ((5.0, {"ARX", "TransferFunction", "SS"}), (45.0, {"NSS"})):
        plan = planned(100.0, clock=[seconds], looked=replace(LOOKED, exact=True), tolerance=0.01)
        tried = []
        while len(tried) < 2:
            tried.append({point.structure.kind for point in plan.ask()})
            plan.tell([trial(plan.points[n], 1.0) for n in sorted(plan.points)[len(plan.trials) :]])
        assert kinds in tried
