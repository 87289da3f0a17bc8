"""How the last fit of a search is trained, and how much time is kept for it."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from sysid.models import NeuralStateSpace
from sysid.reporting.sweep_record import Trial
from sysid.workbench.auto.beyond import LOTTERY, Beyond
from sysid.workbench.auto.budget import REFIT, price
from sysid.workbench.auto.last_fit import LEAST_LAST, SCATTER, SURE, LastFit
from sysid.workbench.auto.parts import ENSEMBLE, UNITED
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import trial

NETWORK = NeuralStateSpace(states=2, neurons=3)
POINT = Point(number=7, structure=NETWORK, training={"max_iterations": 100, "choose_by": "evidence"}, values={})


def seen(*, iteration_s: float, **budget: float) -> tuple[LastFit, Any, Trial]:
    """The last fit of a search of ten minutes that has tried one network; its plan, and the trial."""
    known: Any = SimpleNamespace(estimation=[range(1000)])
    parts: Any = SimpleNamespace(trained_on=False, folds=[SimpleNamespace(fitted=known.estimation)])
    config: Any = SimpleNamespace(wall_s=600.0, tolerance=None, mapping=SimpleNamespace(outputs=["y"]))
    one = trial(POINT, 1.0).model_copy(update={"iteration_s": iteration_s})
    plan: Any = SimpleNamespace(points={7: POINT}, trials=[one], budget=SimpleNamespace(slowed=1.0, **budget))
    return LastFit(config=config, data=known, parts=parts), plan, one


@pytest.mark.parametrize(("left_s", "way"), [(1e9, UNITED), (50.0, ENSEMBLE), (5.0, {})])
def test_as_many_starts_are_united_as_there_is_time_for(left_s: float, way: dict[str, int]) -> None:
    """Starts that are halfway trained say nothing."""
    last, plan, one = seen(iteration_s=0.03, ends_s=100.0 + left_s)
    plan.scattered = {7: 2.0 * SCATTER}
    assert last.united(plan, one, 100.0, Beyond()) == way
    plan.scattered[7] = 0.5 * SCATTER
    assert last.united(plan, one, 100.0, Beyond()) == {}


def test_what_is_apart_on_other_commands_is_united_too() -> None:
    """Starts that meet the parts of a record alike may still differ where it shows nothing."""
    last, plan, one = seen(iteration_s=0.03, ends_s=1e9)
    plan.scattered = {7: 0.0}
    assert last.united(plan, one, 100.0, Beyond(models=8, spread=0.9 * LOTTERY**2)) == {}
    assert last.united(plan, one, 100.0, Beyond(models=8, spread=1.1 * LOTTERY**2)) == UNITED


@pytest.mark.parametrize(
    ("iteration_s", "share"), [(1e-4, LEAST_LAST), (0.02, SURE * 0.02 * 1632 / 600.0), (1.0, REFIT), (math.nan, REFIT)]
)
def test_no_more_is_kept_for_the_last_fit_than_it_takes(iteration_s: float, share: float) -> None:
    """On a short record a fifth of the time had been kept for what takes seconds: 12 trials in place of 17."""
    last, plan, _ = seen(iteration_s=iteration_s)
    assert price(replace(POINT, training={**POINT.training, **UNITED})) == 1632
    assert last.kept(plan) == pytest.approx(share)
    plan.trials = []
    assert last.kept(plan) == REFIT
