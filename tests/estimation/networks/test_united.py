"""Who belongs to several starts that are one model: their ends, and who stands alone or is far behind."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.estimation.networks.starts.multistart import Place
from sysid.estimation.networks.starts.united import (
    ALONE,
    BEHIND,
    FEWEST,
    distances,
    ends_of,
    keep_up,
    stable_of,
    stand_together,
    told,
)
from sysid.estimation.networks.training import Training
from sysid.estimation.results.result import Status


def start(number: int, iteration: int = 10, evidence: float = 0.0, loss: float = 1.0, **more: Any) -> SimpleNamespace:
    known = SimpleNamespace(total_effective_parameters=more.pop("gamma", 10.0), correlation_time=1.0)
    solution = SimpleNamespace(
        status=more.pop("status", Status.CONVERGED), evidence=known, state=SimpleNamespace(iteration=iteration)
    )
    fields = {
        "place": Place.BY_EVIDENCE,
        "cautious": False,
        "score": np.nan,
        "away": np.nan,
        "outside": 0,
        "model": number,
    }
    return SimpleNamespace(number=number, solution=solution, log_evidence=evidence, loss=loss, **(fields | more))


def test_of_each_start_the_last_look_counts_and_the_best_come_first():
    looks = [start(0, 5, 9.0), start(0, 20, 1.0), start(1, 20, 3.0), start(2, 20, 5.0, status=Status.NOT_IMPROVED)]
    assert ends_of(looks, "selection") == [looks[2], looks[1]]


def test_of_a_start_that_was_fitted_twice_the_fit_that_was_taken_counts():
    plain, taken = start(0, 40), start(0, 20, cautious=True, place=Place.FIRST)
    other, left = start(1, 40), start(1, 60, cautious=True, place=Place.LAST)
    assert ends_of([taken, left, plain, other], "selection") == [taken, other]


def test_unstable_starts_are_passed_over_until_there_are_enough():
    some = [start(number) for number in range(5)]
    kept, left = stable_of(some, lambda model: model != 1, 3)
    assert [one.number for one in kept] == [0, 2, 3]
    assert left == (1,)
    assert stable_of(some, None, 2) == (some[:2], ())


def test_who_stands_alone_or_is_far_behind_is_left_out():
    runs = [np.array([level]) for level in (0.0, 1.0, -1.0, -1.1 * ALONE, 0.0, 0.9 * ALONE)]
    near = [True, True, True, True, False, True]
    assert stand_together(near, runs) == [True, True, True, False, False, True]


def test_of_two_nobody_stands_alone():
    assert FEWEST > 2
    assert stand_together([True, True], [np.zeros(1), np.full(1, 100.0)]) == [True, True]


def test_who_is_far_behind_keeps_up_where_the_closer_one_has_too_many_parameters_for_that():
    """100 samples: 100 ln(1.01 BEHIND^2) = 140 against 10 ln 100 = 46 and 40 ln 100 = 184."""
    least = start(0, loss=1.0, gamma=50.0)
    others = [
        start(1, loss=0.99 * BEHIND**2),
        start(2, loss=1.01 * BEHIND**2, gamma=40.0),
        start(3, loss=1.01 * BEHIND**2),
    ]
    assert keep_up([least, *others], 100) == [True, True, False, True]
    assert keep_up([], 100) == []


@pytest.mark.parametrize("members", [1, 4])
def test_an_ensemble_that_was_asked_for_and_not_made_is_told(members: int) -> None:
    said = told(Training(starts=8, ensemble=members), None, SimpleNamespace())
    assert [one.partition(":")[0] for one in said] == ["No ensemble was made"] * (members > 1)


def test_distances_are_from_the_median_of_what_is_finite():
    runs = [np.array([0.0, 0.0]), np.array([3.0, 4.0]), np.array([np.nan, 0.0]), np.array([0.0, 0.0])]
    assert_allclose(distances(runs), [0.0, np.sqrt(12.5), np.inf, 0.0])
    assert_allclose(distances(runs, among=[runs[1]]), [np.sqrt(12.5), 0.0, np.inf, np.sqrt(12.5)])
