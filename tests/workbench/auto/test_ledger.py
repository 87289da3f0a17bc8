"""What of a search may be chosen: what did well again from other starts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from sysid.estimation.estimators import ESTIMATORS
from sysid.models import NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.budget import price
from sysid.workbench.auto.parts import ENSEMBLE
from sysid.workbench.auto.plan import ENSEMBLES, FINALISTS
from sysid.workbench.auto.worth import error, scatter, with_repeats
from sysid.workbench.sweep.search_space import Point
from sysid.workbench.sweep.trial import NOT_DONE
from tests.workbench.auto.searches import by_size, linear, planned, searched, trial


def test_the_best_networks_are_trained_again_and_luck_does_not_choose() -> None:
    lucky = []

    def worth(point: Point) -> float:
        """One network has a small error once, by its start; the others are what they are."""
        if linear(point):
            return 4.0
        if not lucky:
            lucky.append(str(point.structure))
            return 0.01
        return 9.0 if str(point.structure) == lucky[0] else 1.0

    plan, rounds = searched(worth, again=2)
    *rounds, ensembles = rounds
    assert 0 < len(ensembles) <= ENSEMBLES
    assert all(point.training.items() >= ENSEMBLE.items() for point in ensembles)
    seeds = [point.training["seed"] for point in rounds[-1]]
    assert len(seeds) == 2 * FINALISTS
    assert len(set(seeds)) == 2
    assert plan.n_again == FINALISTS
    assert len(plan.trials) == sum(len(one) for one in rounds[:-1]) + len(ensembles)
    best = min(plan.candidates, key=error)
    assert str(best.structure) not in lucky
    assert error(best) == pytest.approx(1.0)


def test_what_comes_to_nothing_again_takes_no_other_away() -> None:
    """The best network failed from its second start, and with it all of them: a linear model was chosen, far behind."""
    plan, _ = searched(lambda point: math.inf if "seed" in point.training else by_size(point), again=1)
    best = min(plan.candidates, key=error)
    assert plan.n_again > 0
    assert error(best) == min(map(error, plan.trials))
    assert not ESTIMATORS[best.structure["kind"]].linear


def test_a_network_for_whose_second_start_the_time_was_up_is_worth_what_it_was() -> None:
    """One that was worse, and done again in time, had been chosen in its place."""
    plan = planned(iterations=10**9, training={"max_iterations": 50}, again=1)
    late = {"usable": False, "reason": NOT_DONE, "selection_free_run_mse": math.nan}
    while points := plan.ask():
        found = [trial(point, by_size(point)) for point in points]
        if "seed" in points[0].training and "ensemble" not in points[0].training:
            best = min(found, key=error)
            found = [one.model_copy(update=late) if one is best else one for one in found]
        plan.tell(found)
    least = min(plan.candidates, key=error)
    assert plan.n_again == FINALISTS - 1
    assert error(least) == min(map(error, plan.trials))


def test_a_network_for_whose_second_start_there_was_no_time_is_worth_what_it_was() -> None:
    """A state space of four neurons gave way to a network of eight with more error, as that alone was done again."""
    plan = planned(iterations=10**9, training={"max_iterations": 50}, again=1)
    take = plan.budget.take

    def all_but_the_first(points: Sequence[Point]) -> list[Point]:
        again = "seed" in points[0].training and "ensemble" not in points[0].training
        return take(points[1:] if again else points)

    plan.budget.take = all_but_the_first  # type: ignore[method-assign]
    while points := plan.ask():
        plan.tell([trial(point, by_size(point)) for point in points])
    assert plan.n_again == FINALISTS - 1
    assert min(map(error, plan.candidates)) == min(map(error, plan.trials))


def test_the_mean_of_several_starts_of_the_best_may_be_chosen_too() -> None:
    def worth(point: Point) -> float:
        return 0.5 * by_size(point) if "ensemble" in point.training else by_size(point)

    plan, rounds = searched(worth, again=2)
    best = min(plan.candidates, key=error)
    assert best.number in {point.number for point in rounds[-1]}
    assert [point.structure for point in rounds[-1]] == [point.structure for point in rounds[-2][::2]][:ENSEMBLES]
    assert price(rounds[-1][0]) > price(rounds[-2][0])
    assert not [one for points in searched(worth)[1] for one in points if "ensemble" in one.training]


def test_iterations_are_kept_for_that() -> None:
    plan, rounds = searched(by_size, iterations=2000, again=2)
    assert any("seed" in point.training for one in rounds[-2:] for point in one)
    assert plan.n_again > 0
    assert sum(price(point) for one in rounds for point in one) <= 2000


def test_the_median_of_its_errors_is_what_a_point_is_worth() -> None:
    point = Point(number=1, structure=NeuralStateSpace(states=2, neurons=3), training={}, values={})
    lucky, good, lost = (trial(point, mse) for mse in (0.1, 1.0, math.inf))
    assert error(with_repeats(lucky, [good, good])) == 1.0
    assert error(with_repeats(lucky, [good, lost])) == 1.0
    assert error(with_repeats(lucky, [good])) == 1.0
    assert error(with_repeats(lucky, [lost, lost])) == math.inf


def test_how_far_its_starts_are_apart_is_judged_on_the_same_parts() -> None:
    """An easy part and a hard one are no scatter; errors of one start that are twice those of another are."""
    point = Point(number=1, structure=NeuralStateSpace(states=2, neurons=3), training={}, values={})

    def start(*shares: float) -> Trial:
        return trial(point, 1.0).model_copy(update={"selection_rms_shares": list(shares)})

    assert scatter([start(0.1, 1.0), start(0.1, 1.0)]) == 0.0
    assert scatter([start(0.1, 1.0), start(0.2, 2.0)]) == pytest.approx(math.log(2.0) / math.sqrt(2.0))
    assert scatter([start(0.1, 1.0), start(0.2, 1.0)]) == pytest.approx(math.log(2.0) / 2.0)
    assert scatter([start(0.1, 1.0)]) == 0.0
    assert scatter([start(0.1, 1.0), start(0.2, 2.0), start(9.0)]) == scatter([start(0.1, 1.0), start(0.2, 2.0)])
    assert scatter([start(0.1, 1.0), trial(point, math.inf)]) == 0.0
