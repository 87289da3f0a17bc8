"""What a search may spend."""

from __future__ import annotations

import pytest

from sysid.estimation.clock import SLOWEST
from sysid.models import ARX, NeuralStateSpace
from sysid.workbench.auto.budget import REFIT, Budget, price
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import trial


def point(number: int, neurons: int, starts: int = 1) -> Point:
    training = {"max_iterations": 100, "starts": starts}
    return Point(number=number, structure=NeuralStateSpace(states=2, neurons=neurons), training=training, values={})


LINEAR = Point(number=1, structure=ARX(na=1, nb=(1,), nk=(1,)), training={}, values={})


def budget(seconds: float | None = None, *, clock: list[float] | None = None, **given: object) -> Budget:
    now = clock or [0.0]
    fields = {"wall_s": seconds, "iterations": None, "is_stored": lambda _: False, "kept": 0.0, **given}
    return Budget(clock=lambda: now[0], **fields)  # type: ignore[arg-type]


def test_a_price_counts_every_start_and_every_fold() -> None:
    assert price(LINEAR) == 1
    assert price(point(1, 5)) == 100
    assert price(point(1, 5), 4) == 400
    assert 100 < price(point(1, 5, starts=6)) < 600


def test_a_trial_that_would_take_too_long_is_not_begun() -> None:
    clock = [0.0]
    found = budget(100.0, clock=clock)
    (first,) = found.take([point(1, 4)])
    found.tell([trial(first, 1.0).model_copy(update={"seconds": 12.0})])
    clock[0] = 70.0  # 10 s are left, and what is kept for the last fit
    assert [one.number for one in found.take([point(2, 4), LINEAR])] == [1]


def test_time_is_kept_for_the_last_fit() -> None:
    assert budget(100.0, clock=[100.0 * (1.0 - REFIT) + 1.0]).take([LINEAR]) == []


def test_a_kind_that_was_not_tried_yet_is_taken_to_need_a_part_of_its_limit() -> None:
    """Of many that nobody knows, all at once would take more than there is."""
    limited = [point(n, 4) for n in range(1, 30)]
    for one in limited:
        one.training["max_time_s"] = 10.0
    found = budget(100.0, refit=0.4, trial=0.1)
    assert len(found.take(limited)) == 12  # of 5 s, until 60 s are spent
    assert len(budget(100.0, refit=0.4, trial=0.1, most=0.5).take(limited)) == 6


def test_what_is_stored_costs_no_time() -> None:
    found = budget(100.0, clock=[1000.0], is_stored=lambda one: one.number == 1)
    assert [one.number for one in found.take([point(1, 5), point(2, 5)])] == [1]


def test_iterations_know_no_time() -> None:
    found = budget(None, iterations=250, clock=[1e9])
    assert len(found.take([point(n, 5) for n in range(1, 5)])) == 2
    assert found.fraction() == pytest.approx(0.8)
    assert found.limits(0.1) == {}


def test_a_share_of_the_time_limits_a_training() -> None:
    assert budget(60.0).limits(0.5) == {"max_time_s": 30.0}


def test_a_share_is_kept_until_it_is_let_go() -> None:
    found = budget(None, iterations=100, kept=0.5)
    assert found.take([point(1, 5)]) == []
    found.kept = 0.0
    assert len(found.take([point(1, 5)])) == 1


def test_limits_count_processor_time_and_a_slow_machine_has_room_for_fewer_trials() -> None:
    """What comes as far as on a quiet machine takes longer there: there are fewer of it."""
    limited = [point(n, 4) for n in range(1, 30)]
    for one in limited:
        one.training["max_time_s"] = 10.0
    found = budget(100.0, refit=0.4, trial=0.1)
    (first,) = found.take(limited[:1])
    found.tell([trial(first, 1.0).model_copy(update={"seconds": 24.0, "cpu_s": 8.0})])
    assert found.slowed == pytest.approx(3.0, rel=0.05)  # what was seen before counts a little
    assert found.limits(0.1) == {"max_time_s": 10.0}
    assert len(found.take(limited[1:])) == 2  # of 24 s, until 60 s are spent
    assert (found.has_room(20.0), found.has_room(21.0)) == (True, False)
    found.tell([trial(one, 1.0).model_copy(update={"seconds": 4000.0, "cpu_s": 8.0}) for one in limited[1:3]])
    assert found.slowed == SLOWEST
    assert budget(None, iterations=10).has_room(1e9)


def test_scores_export_and_report_are_not_limited_as_trials_are_and_take_as_long_as_the_machine_makes_them() -> None:
    found = budget(1000.0, finishing_s=20.0)
    found.take([point(1, 4)])
    found.tell([trial(point(1, 4), 1.0).model_copy(update={"seconds": 80.0, "cpu_s": 8.0})])
    assert found.slowed == SLOWEST
    assert found.ends_s == 1000.0 - (10.0 * 20.0 - 0.05 * 1000.0)


def test_scores_export_and_report_are_over_in_time_too() -> None:
    """On a busy machine they take longer: trials and the last fit end sooner."""
    clock = [0.0]
    found = budget(100.0, clock=clock, refit=0.2, finishing_s=10.0)
    assert found.ends_s == 95.0  # a little may be spilt
    (first,) = found.take([point(1, 4)])
    found.tell([trial(first, 1.0).model_copy(update={"seconds": 24.0, "cpu_s": 8.0})])
    assert found.ends_s == 75.0
    clock[0] = 61.0  # the last fit has a fifth of that
    assert found.take([LINEAR]) == []
    assert [found.is_late()] == [False]
    clock[0] = 68.0  # half of that is gone
    assert found.is_late()
    assert budget(100.0, finishing_s=1e6).ends_s == 50.0
    assert not budget(None, iterations=10, finishing_s=1e6, clock=[1e9]).is_late()


@pytest.mark.parametrize(("wall_s", "words"), [(36_000.0, "10 h 00 min left"), (100.0, "1 min 40 s left")])
def test_what_is_left_is_said_as_every_step_says_it(wall_s: float, words: str) -> None:
    """Ten hours were 600 minutes, and 100 s were 2."""
    assert budget(wall_s).left() == words
