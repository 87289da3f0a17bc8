"""Runs that are chosen among many see more than as many that come as they do."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from sysid.references.coverage import BINS, cells, most_seen
from sysid.references.design import Counts, Design, designed, drawn
from tests.references.test_design import CONFIG

RANGES = np.array([port.range for port in CONFIG.inputs.values()])


def seen(cases: list, lags: tuple[int, int]) -> int:
    """Cells in which the inputs of some experiments are at some time."""
    parts = zip(*(cells(case.inputs, RANGES, lags) for case in cases), strict=True)
    return sum(len(np.unique(np.concatenate(some))) for some in parts)


def test_a_cell_is_where_an_input_is_and_where_it_has_been() -> None:
    u = np.r_[np.zeros(50), np.ones(50)][:, np.newaxis] * np.array([10.0, 4.0]) + np.array([0.0, 1.0]) * [[0.0]]
    u[:, 1] = np.clip(u[:, 1], 1.0, 4.0)
    valve, gear, both = cells(u, RANGES, (2.0, 200.0))
    low, high = 0, BINS - 1
    assert (valve[:50] == low).all()
    # Up at once, lately up soon, and for long hardly.
    assert valve[50] == (high * BINS + 3) * BINS + low
    assert valve[-1] == (high * BINS + high) * BINS + 1
    assert (gear[:50] == low).all()
    assert both[-1] == high * BINS + high


def test_each_is_what_adds_most_to_those_before_it() -> None:
    rng = np.random.default_rng(0)
    groups = [[[rng.integers(0, 6, size=4)] for _ in range(5)] for _ in range(3)]
    chosen = most_seen(groups)

    def worth(places: tuple[int, ...]) -> float:
        counts = sum(np.bincount(groups[k][place][0], minlength=6) for k, place in enumerate(places))
        return float(np.sqrt(counts).sum())

    for k in range(3):
        gains = [worth((*chosen[:k], place)) for place in range(5)]
        assert gains[chosen[k]] == pytest.approx(max(gains))
    best = max(worth(places) for places in product(range(5), repeat=3))
    assert worth(tuple(chosen)) >= (1.0 - 1.0 / np.e) * best


def test_what_is_fitted_sees_more_and_what_judges_is_as_it_was() -> None:
    runs = Counts(estimation=6, selection=3, test=3)
    usual, chosen = (Design(duration=40.0, runs=runs, among=among) for among in (1, 12))
    before, after = designed(CONFIG, usual), designed(CONFIG, chosen)
    lags = usual.holds(CONFIG.sample_time)
    assert seen(after["estimation"], lags) > 1.05 * seen(before["estimation"], lags)
    for role in ("selection", "test"):
        for one, other in zip(before[role], after[role], strict=True):
            np.testing.assert_array_equal(one.inputs, other.inputs)
    # Kinds are dealt in turn as before, parameters spread as before, and a seed repeats it.
    pairs = list(zip(before["estimation"], after["estimation"], strict=True))
    assert [one.told.partition(",")[0] for one, _ in pairs] == [other.told.partition(",")[0] for _, other in pairs]
    assert all(one.parameters == other.parameters for one, other in pairs)
    again = designed(CONFIG, chosen)["estimation"]
    assert all((one.inputs == other.inputs).all() for one, other in zip(after["estimation"], again, strict=True))


@pytest.mark.parametrize("fitted", [True, False])
def test_without_inputs_there_is_nothing_to_choose_among(fitted: bool) -> None:
    still = CONFIG.model_copy(update={"inputs": {}})
    design = Design(duration=5.0, among=9)
    (one, other) = (
        drawn(still, how, 4, seed=(0, 0), prefix="N", fitted=fitted) for how in (design, Design(duration=5.0))
    )
    assert [case.parameters for case in one] == [case.parameters for case in other]
