"""A network that its time limit ended before it had come anywhere is trained on before anything is said of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest

from sysid.models import NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.budget import Budget
from sysid.workbench.auto.ripe import LONGEST, RIPE, Ripening, is_young, young_told
from sysid.workbench.auto.worth import error, ranked_by
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import trial

RANK = ranked_by(error, None)


class Nursery:
    """Trains nothing: what a network comes to is said beforehand."""

    def __init__(self, becomes: Callable[[int], float], *, stored: bool = False) -> None:
        self.becomes, self.stored = becomes, stored
        self.asked: dict[int, dict[str, Any]] = {}
        self.last = dict.fromkeys(range(1, 10), "trial")

    def run_on(
        self, points: Sequence[Point], before: Mapping[int, Trial], options: Callable[[Point], Mapping[str, Any]]
    ) -> list[Trial]:
        self.asked |= {point.number: dict(options(point)) for point in points}
        self.last |= {point.number: "trained on" for point in points}
        return [
            trial(one, self.becomes(one.number)).model_copy(update={"iterations": before[one.number].iterations + 20})
            for one in points
        ]

    def is_stored_on(self, *_: object) -> bool:
        return self.stored


def point(number: int) -> Point:
    training = {"max_iterations": 200, "max_time_s": 10.0}
    return Point(number=number, structure=NeuralStateSpace(states=1, neurons=number), training=training, values={})


def tried(number: int, iterations: int, mse: float = 1.0, status: str = "TIME_LIMIT") -> Trial:
    more = {"iterations": iterations, "status": status, "iteration_s": 0.5, "seconds": 30.0, "cpu_s": 10.0}
    return trial(point(number), mse).model_copy(update=more)


def ripened(nursery: Nursery, trials: Sequence[Trial], *, at: float = 0.0) -> list[Trial]:
    budget = Budget(
        wall_s=100.0, iterations=None, clock=lambda: at, is_stored=lambda _: False, refit=0.4, trial=0.1, kept=0.0,
        side_by_side=2,
    )  # fmt: skip
    every: Any = nursery
    points = [point(one.number) for one in trials]
    return Ripening(driver=every, budget=budget, rank=RANK, n_outputs=1)(points, trials)


def test_a_single_iteration_is_no_trial() -> None:
    nursery = Nursery(lambda number: 0.1 * number)
    found = ripened(nursery, [tried(1, RIPE), tried(2, 1), tried(3, 1, status="CONVERGED")])
    assert list(nursery.asked) == [2]
    assert nursery.asked[2]["max_iterations"] == RIPE
    assert 19 * 0.5 < nursery.asked[2]["max_time_s"] < 30 * 0.5
    assert [one.selection_free_run_mse for one in found] == [1.0, 0.2, 1.0]
    assert [one.iterations for one in found] == [RIPE, 21, 1]
    assert not any(is_young(one, 1) for one in found)


def test_what_does_not_become_better_stays_as_it_was_and_has_come_as_far_all_the_same() -> None:
    nursery = Nursery(lambda _: math.inf)
    (found,) = ripened(nursery, [tried(2, 1)])
    assert (found.selection_free_run_mse, found.iterations) == (1.0, 21)
    assert nursery.last[2] == "trial"


def test_it_takes_no_longer_than_twice_a_trial() -> None:
    nursery = Nursery(lambda _: 0.5)
    ripened(nursery, [tried(1, 1).model_copy(update={"iteration_s": 100.0})])
    assert nursery.asked[1]["max_time_s"] == LONGEST * 10.0


@pytest.mark.parametrize(("at", "count"), [(0.0, 3), (45.0, 2), (59.0, 0)])
def test_the_best_come_first_where_there_is_not_time_for_all(at: float, count: int) -> None:
    """60 of 100 s are for trials; each takes some 12 s of two processors."""
    nursery = Nursery(lambda _: 0.01)
    ripened(nursery, [tried(3, 1, 3.0), tried(1, 1, 1.0), tried(2, 1, 2.0)], at=at)
    assert list(nursery.asked) == [1, 2, 3][:count]
    stored = Nursery(lambda _: 0.01, stored=True)
    ripened(stored, [tried(3, 1, 3.0), tried(1, 1, 1.0), tried(2, 1, 2.0)], at=1e3)
    assert len(stored.asked) == 3, "what an earlier session has done takes no time"


def test_what_says_little_is_named() -> None:
    young = [tried(number, 1, float(number)) for number in (5, 4, 3, 2)]
    said = young_told([*young, tried(1, RIPE)], RANK, 1)
    assert "NSS 1/2 (1 iteration), NSS 1/3 (1 iteration), NSS 1/4 (1 iteration) and 1 more" in said
    assert "allow more minutes" in said
    assert young_told([tried(1, RIPE)], RANK, 1) == ""
    # Twenty iterations of one of four parts are five of each.
    assert "NSS 1/1 (5 iterations)" in young_told([tried(1, RIPE)], RANK, 1, folds=4)


@pytest.mark.parametrize(
    ("iterations", "said"),
    [(0, "(no iteration)"), (1, "(less than one iteration)"), (9, "(2 iterations)"), (79, "(19 iterations)")],
)
def test_what_came_to_no_iteration_is_told_in_words(iterations: int, said: str) -> None:
    """The starts of block-oriented models alone can take the time of a trial."""
    assert f"NSS 1/1 {said} came to fewer" in young_told([tried(1, iterations)], RANK, 1, folds=4)
