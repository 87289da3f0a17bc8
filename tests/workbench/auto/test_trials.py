"""A point trained on every part that is held out, and what it is worth over all of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest

from sysid.models import NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.trials import HOPELESS, SEEN, Trials, together
from sysid.workbench.auto.worth import error
from sysid.workbench.sweep.search_space import Point
from sysid.workbench.sweep.trial import NOT_DONE
from tests.workbench.auto.searches import trial


def points(n: int) -> list[Point]:
    networks = [NeuralStateSpace(states=1, neurons=k) for k in range(1, n + 1)]
    return [Point(number=one.neurons, structure=one, training={}, values={}) for one in networks]


@dataclass
class Fold:
    """A driver that knows the errors of its part, and keeps what it was asked for."""

    errors: dict[int, float]
    asked: list[int] = field(default_factory=list)

    def do_ahead(self, wanted: Sequence[tuple[Fold, Sequence[Point]]]) -> None:
        """Nothing takes time here."""

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


@dataclass
class Late(Fold):
    """A driver whose time is up: what it is asked for is not done."""

    def run(self, wanted: Sequence[Point]) -> list[Trial]:
        failed = {"usable": False, "reason": NOT_DONE, "selection_free_run_mse": math.nan}
        return [one.model_copy(update=failed) for one in super().run(wanted)]


@pytest.mark.parametrize(("done", "scored"), [(1, False), (2, True), (3, True)])
def test_what_the_end_of_the_time_finds_is_set_against_the_best_on_the_same_parts(done: int, scored: bool) -> None:
    """A network that was better on three parts of four had been thrown away with the fourth."""
    errors = [{1: easy, 2: 0.25 * easy} for easy in (1.0, 2.0, 4.0, 64.0)]
    found, _ = over(*errors)
    (best,) = found.run(points(1))
    known: Any = tuple((Fold if k < done else Late)(errors=one) for k, one in enumerate(errors))
    (one,) = Trials(drivers=known, best=found.best).run(points(2)[1:])
    assert one.in_full == scored
    assert error(one) == (pytest.approx(0.25 * error(best)) if scored else math.inf)
    assert one.reason == (
        f"scored on {done} of 4 parts, against the best on the same: the time was up" if scored else NOT_DONE
    )


def test_what_fails_is_not_saved_by_the_end_of_the_time() -> None:
    found, _ = over({1: 1.0}, {1: 1.0}, {1: 1.0}, {1: 1.0})
    found.run(points(1))
    known: Any = (Fold(errors={2: 0.1}), Fold(errors={2: math.inf}), Late(errors={2: 0.1}), Late(errors={2: 0.1}))
    (one,) = Trials(drivers=known, best=found.best).run(points(2)[1:])
    assert (one.usable, error(one)) == (False, math.inf)


def test_a_single_part_is_the_trial_itself() -> None:
    (point,) = points(1)
    assert together([trial(point, 2.0)], of=1) == trial(point, 2.0)
