"""The best networks are trained on side by side: who comes from behind is chosen, at a known price."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest

from sysid.models import ARX, NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.race import AHEAD, FINALISTS, Race, as_far, as_rival, behind
from sysid.workbench.auto.worth import error, ranked_by
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import trial

NETWORKS = 6


class Track:
    """Trains nothing: what a network comes to is said beforehand, look by look."""

    def __init__(self, becomes: Callable[[int, int], float]) -> None:
        self.becomes, self.looks = becomes, list[tuple[list[int], list[dict[str, Any]]]]()
        self.last = dict.fromkeys(range(1, NETWORKS + 1), "trial")

    def run_on(
        self,
        points: Sequence[Point],
        before: Mapping[int, Trial],  # noqa: ARG002 - as a driver
        options: Callable[[Point], Mapping[str, Any]],
    ) -> list[Trial]:
        self.looks.append(([point.number for point in points], [dict(options(point)) for point in points]))
        for point in points:
            self.last[point.number] = f"look {len(self.looks)}"
        values = [self.becomes(point.number, len(self.looks)) for point in points]
        return [trial(point, value) for point, value in zip(points, values, strict=True)]

    def is_stored_on(self, *_: object) -> bool:
        return False


def point(number: int) -> Point:
    return Point(number=number, structure=NeuralStateSpace(states=1, neurons=number), training={}, values={})


def tried(number: int, mse: float, status: str = "TIME_LIMIT") -> Trial:
    return trial(point(number), mse).model_copy(update={"status": status})


def raced(
    track: Track, trials: Sequence[Trial], *, wall_s: float | None = None, at: float = 0.6
) -> tuple[Race, list[Trial], float]:
    points = {one.number: point(one.number) for one in trials if one.structure["kind"] == "NSS"}
    linear = Point(number=99, structure=ARX(na=1, nb=(1,), nk=(1,)), training={}, values={})
    race = Race(
        driver=track,  # type: ignore[arg-type] - stands for one
        points={**points, 99: linear}, rank=ranked_by(error, None), n_outputs=1, wall_s=wall_s,
        iterations=None if wall_s else 1000, workers=2, clock=lambda: at * (wall_s or 0.0), kept=0.2,
    )  # fmt: skip
    found, spent = race.run(trials)
    return race, found, spent


def test_who_is_behind_after_a_short_trial_and_ahead_later_is_the_best_in_the_end() -> None:
    trials = [tried(number, float(number)) for number in range(1, NETWORKS + 1)]
    track = Track(lambda number, look: {1: 0.9, 2: 0.8, 3: 0.1, 4: 0.7}[number] / look)
    race, found, spent = raced(track, trials)
    assert [numbers for numbers, _ in track.looks] == [[1, 2, 3, 4], [3, 4]]
    assert len(race.in_it) == FINALISTS
    assert min(found, key=race.rank).number == 3
    assert [one.number for one in found] == [one.number for one in trials]
    # 8 and 12 % of the iterations, shared out; one start, which goes on.
    assert spent == pytest.approx(0.2)
    assert [[(one["max_iterations"], one["starts"]) for one in options] for _, options in track.looks] == [
        [(20, 1)] * 4,
        [(60, 1)] * 2,
    ]


def test_what_does_not_become_better_is_kept_as_it_was_and_is_trained_no_more() -> None:
    track = Track(lambda number, _: math.inf if number == 1 else 5.0)
    _, found, _ = raced(track, [tried(1, 1.0), tried(2, 2.0), tried(3, 6.0)])
    assert [(one.number, one.selection_free_run_mse) for one in found] == [(1, 1.0), (2, 2.0), (3, 5.0)]
    assert [track.last[number] for number in (1, 2, 3)] == ["trial", "trial", "look 1"]
    assert len(track.looks) == 1


def test_a_network_that_has_converged_behind_another_and_a_linear_model_are_not_trained_on() -> None:
    linear = trial(Point(number=99, structure=ARX(na=1, nb=(1,), nk=(1,)), training={}, values={}), 0.5)
    track = Track(lambda number, _: 0.1 * number)
    raced(track, [linear, tried(1, 1.0, "CONVERGED"), tried(2, 2.0, "CONVERGED"), tried(3, 3.0), tried(4, math.inf)])
    assert track.looks[0][0] == [1, 3]
    alone = Track(lambda *_: 0.0)
    assert raced(alone, [linear, tried(1, 1.0), tried(2, 2.0, "STALLED")])[2] == 0.0
    assert not alone.looks


def test_what_is_ahead_on_every_trace_by_more_than_chance_goes_on_alone() -> None:
    shares = {1: [0.001, 0.002, 0.001, 0.003], 2: [0.1, 0.2, 0.15, 0.2], 3: [0.3] * 4, 4: [0.4] * 4}
    one, two = (tried(number, 1.0).model_copy(update={"selection_rms_shares": shares[number]}) for number in (1, 2))
    assert behind(one, two)
    assert not behind(one, two.model_copy(update={"selection_rms_shares": [0.0005, 0.2, 0.0005, 0.2]}))
    assert not behind(one, two.model_copy(update={"selection_rms_shares": [0.1]}))
    few = [some.model_copy(update={"selection_rms_shares": some.selection_rms_shares[:3]}) for some in (one, two)]
    assert not behind(*few), "three traces tell nothing from chance"


def test_of_what_stays_within_the_tolerance_on_more_traces_a_mean_says_nothing() -> None:
    more, less = (
        tried(number, mse).model_copy(update={"selection_rms_shares": some})
        for number, mse, some in ((1, 2.0, [0.009, 0.009]), (2, 1.0, [0.001, 0.02]))
    )
    assert min((more, less), key=ranked_by(error, 0.01)).number == 1
    assert min((more, less), key=ranked_by(error, None)).number == 2
    assert ranked_by(error, 0.01)(tried(3, math.inf)) > ranked_by(error, 0.01)(less)


def test_each_is_trained_on_for_its_share_of_the_time() -> None:
    trials = [tried(1, 1.0), tried(2, 2.0)]
    track = Track(lambda number, look: 1.0 / look / number)
    _, _, spent = raced(track, trials, wall_s=100.0)
    assert spent == pytest.approx(0.12)
    # Two workers train two networks side by side: each has all of the share.
    assert [[one["max_time_s"] for one in options] for _, options in track.looks] == [[12.0, 12.0]]


def test_where_trials_have_overrun_the_two_best_go_on_all_the_same() -> None:
    trials = [tried(number, float(number)) for number in range(1, NETWORKS + 1)]
    late = Track(lambda number, _: 0.1 / number)
    _, found, spent = raced(late, trials, wall_s=100.0, at=0.75)
    assert [numbers for numbers, _ in late.looks] == [[1, 2]]
    assert spent == pytest.approx(0.12)
    assert [one.selection_free_run_mse for one in found[:3]] == [0.1, 0.05, 3.0]


def test_a_network_that_is_not_stable_yet_is_trained_on_where_it_is_far_ahead() -> None:
    """Random sequences refuse what few iterations have left in it, and a linear model of four times its error came."""
    young = tried(1, 1.0, "UNSTABLE").model_copy(update={"usable": False})
    assert (error(young), as_far(young), as_rival(young)) == (math.inf, 1.0, AHEAD**2)
    assert as_far(tried(2, 2.0)) == as_rival(tried(2, 2.0)) == 2.0
    linear = Point(number=99, structure=ARX(na=1, nb=(1,), nk=(1,)), training={}, values={})
    lost = trial(linear, 1.0).model_copy(update={"status": "UNSTABLE", "usable": False})
    assert as_far(lost) == math.inf, "its training does not go on"
    for stopped in ({"status": "NOT_IMPROVED"}, {"dropped_at": 1}, {"selection_free_run_mse": math.inf}):
        assert as_far(young.model_copy(update=stopped)) == math.inf
    order = sorted([tried(2, 3.0), young, tried(3, 5.0)], key=ranked_by(as_rival, None))
    assert [one.number for one in order] == [2, 1, 3]
