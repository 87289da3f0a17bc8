"""What is told of how a search went."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from sysid.models import LinearStateSpace, NeuralStateSpace
from sysid.workbench.auto import told
from sysid.workbench.auto.last_fit import SCATTER
from sysid.workbench.sweep.search_space import Point
from tests.workbench.auto.searches import trial

ONE = trial(Point(number=7, structure=NeuralStateSpace(states=2, neurons=3), training={}, values={}), 1.0)


def plan(*, wall_s: float | None = 60.0, slowed: float = 1.0, hurried: bool = True, **more: Any) -> Any:
    rest = {"left_out": [], "trials": [], "looked": SimpleNamespace(states=0), **more}
    return SimpleNamespace(hurried=hurried, budget=SimpleNamespace(wall_s=wall_s, slowed=slowed, refit=0.2), **rest)


def test_a_mean_of_starts_says_why() -> None:
    assert "63% apart" in told.last_fit(plan(scattered={7: 0.49}), ONE)
    assert "apart" not in told.last_fit(plan(scattered={7: 0.5 * SCATTER}), ONE)
    assert told.last_fit(plan(scattered={}), ONE).endswith("in the end is the mean of several starts.")


@pytest.mark.parametrize(("slowed", "needs"), [(1.0, 120.0), (4.0, 30.0)])
def test_how_long_a_search_takes_is_reckoned_for_a_quiet_machine(slowed: float, needs: float) -> None:
    assert told.needs_s(plan(slowed=slowed), 5.0) == pytest.approx(needs)
    assert told.needs_s(plan(hurried=False), 5.0) == 0.0
    said = told.hurried(plan(slowed=slowed), ONE, 5.0, needs)
    assert said.startswith("The time was up before structures were compared: NSS 2/3")
    assert ("on a quiet machine" in said) is (slowed >= told.BUSY)


def test_what_went_well_is_not_told() -> None:
    assert told.hurried(plan(hurried=False), ONE, 5.0, 0.0) == ""
    assert told.busy(plan()) == told.busy(plan(wall_s=None, slowed=9.0)) == told.left_out(plan()) == []
    assert "took 2.0 s" in told.busy(plan(slowed=2.0))[0]


@pytest.mark.parametrize(("needed", "at_edge"), [(20, True), (18, False)])
def test_a_linear_search_that_ends_at_its_edge_says_so(needed: int, at_edge: bool) -> None:
    sizes = (4, 18, 20)
    points = [Point(number=n, structure=LinearStateSpace(states=n, noise=False), training={}, values={}) for n in sizes]
    said = told.left_out(plan(trials=[trial(one, 1.0) for one in points], looked=SimpleNamespace(states=needed)))
    assert any("of 20 states, is the largest that was tried" in one for one in said) is at_edge
