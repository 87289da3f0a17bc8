"""A point trained on every part that is held out, and what it is worth over all of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest

from sysid.models import NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.search import error
from sysid.workbench.auto.trials import HOPELESS, SEEN, Trials, together
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.test_plan import trial


def points(n: int) -> list[Point]:
    networks = [NeuralStateSpace(states=1, neurons=k) for k in range(1, n + 1)]
    return [Point(number=one.neurons, structure=one, training={}, values={}) for one in networks]


@dataclass
class Fold:
    """A driver that knows the errors of its part, and keeps what it was asked for."""

    errors: dict[int, float]
    asked: list[int] = field(default_factory=list)

    def run(self, wanted: Sequence[Point]) -> list[Trial]:
        self.asked += [point.number for point in wanted]
        return [trial(point, self.errors[point.number]) for point in wanted]


def over(*folds: dict[int, float]) -> tuple[Trials, list[Fold]]:
    drivers = [Fold(errors=one) for one in folds]
    known: Any = tuple(drivers)
    return Trials(drivers=known), drivers


def test_errors_are_geometric_means_and_times_are_sums() -> None:
    found, _ = over({1: 1.0}, {1: 4.0})
    (one,) = found.run(points(1))
    assert error(one) == pytest.approx(2.0)
    assert one.seconds == pytest.approx(0.2)


def test_what_is_far_behind_the_best_on_the_same_parts_is_dropped() -> None:
    far = 1.1 * HOPELESS**2
    found, drivers = over(*({1: easy, 2: easy * far, 3: easy * 1.1} for easy in (0.01, 1.0, 1.0, 1.0)))
    (best,) = found.run(points(1))
    later = {one.number: one for one in found.run(points(3)[1:])}
    assert error(best) == pytest.approx(0.01**0.25)
    assert (later[2].dropped_at, later[3].dropped_at) == (SEEN, None)
    assert error(later[2]) == math.inf
    assert [2 in driver.asked for driver in drivers] == [True, True, False, False]


def test_a_part_that_is_hard_for_all_drops_nobody() -> None:
    found, drivers = over({1: 100.0, 2: 100.0}, {1: 100.0, 2: 100.0}, {1: 1.0, 2: 1.0})
    found.run(points(1))
    assert found.run(points(2)[1:])[0].in_full
    assert all(2 in driver.asked for driver in drivers)


def test_what_fails_on_one_part_cannot_be_chosen() -> None:
    found, _ = over({1: 1.0}, {1: math.inf})
    (one,) = found.run(points(1))
    assert (one.usable, error(one)) == (False, math.inf)


def test_a_single_part_is_the_trial_itself() -> None:
    (point,) = points(1)
    assert together([trial(point, 2.0)], of=1) == trial(point, 2.0)
