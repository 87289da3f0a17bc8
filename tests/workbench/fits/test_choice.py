"""Which fit is exported: the best on the traces that choose, and never an unstable one where that is asked for."""

from __future__ import annotations

from types import SimpleNamespace as Fake

import pytest

from sysid.estimation.results.result import Status
from sysid.workbench.fits.choice import choose


def fitted(status: Status, mse: float):
    model = Fake(ends=Fake(output_units=("V",)))
    return [(Fake(status=status, model=model), Fake(selection_mse=mse, selection_errors=()))]


FOUND = {
    "good": fitted(Status.CONVERGED, 2.0),
    "best": fitted(Status.UNSTABLE, 1.0),
    "poor": fitted(Status.CONVERGED, 3.0),
}


def test_an_unstable_fit_may_be_the_best_unless_it_is_said() -> None:
    assert choose(FOUND, "best").name == "best"
    chosen = choose(FOUND, "best", unstable=False)
    assert (chosen.name, chosen.withheld) == ("good", False)
    assert "best is not" in chosen.chosen_by


@pytest.mark.parametrize("asked", ["best", "lost"])
def test_nothing_leaves_where_all_are_unstable_or_an_unstable_one_is_named(asked: str) -> None:
    fits = {"lost": FOUND["best"]} if asked == "best" else {"lost": FOUND["best"], **FOUND}
    chosen = choose(fits, asked, unstable=False)
    assert (chosen.name, chosen.withheld) == ("lost", True)
    assert "not exported: its free run is unstable" in chosen.chosen_by


@pytest.mark.parametrize("other", [7, 9])
def test_a_choice_favours_those_of_most_parameters_only_where_counts_differ(other: int) -> None:
    def one(mse: float, count: int):
        model = Fake(ends=Fake(output_units=("V",)), n_parameters=count)
        scores = Fake(
            selection_mse=float("nan"), estimation_errors=(), evaluation=Fake(mean_mse=lambda _: mse), intervals=None
        )
        return [(Fake(status=Status.CONVERGED, model=model), scores)]

    chosen = choose({"a": one(1.0, 7), "b": one(2.0, other)}, "best")
    assert chosen.name == "a"
    assert ("favours the model with the most parameters" in chosen.chosen_by) == (other != 7)
