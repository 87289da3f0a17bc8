"""Which orders the data ask for."""

from __future__ import annotations

import numpy as np
import pytest

import sysid
from sysid.api.orders import LARGEST, OrderSearch, _grid
from sysid.errors import ConfigError, TraceError


def record(n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Two poles and a dead time of three samples, with a little noise that the recursion filters."""
    rng = np.random.default_rng(seed)
    u, y = rng.standard_normal(n), np.zeros(n)
    for k in range(3, n):
        y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + u[k - 3] + 0.05 * rng.standard_normal()
    return u, y


@pytest.fixture(scope="module")
def found() -> OrderSearch:
    # AIC takes more orders than there are in some records of many: its penalty is 2, whatever the length.
    return sysid.search_orders(sysid.data(record(400, seed=2), sample_time=1.0, split=(0.5, 0.25, 0.25)), "u -> y")


@pytest.mark.parametrize("criterion", ["BIC", "bic", "AICc", "AIC"])
def test_a_criterion_finds_the_orders_and_the_dead_time(found: OrderSearch, criterion: str) -> None:
    best = found.best(criterion)
    assert best.nk == (3,)
    # Akaike's criterion chooses too many parameters with a probability that does not vanish (Shibata 1976).
    assert best.na == 2 if criterion.upper() == "BIC" else best.na in {2, 3}
    assert best.nb[0] <= 2


def test_the_selection_traces_choose_where_there_are_some(found: OrderSearch) -> None:
    frame = found.to_frame()
    assert frame["fit"].is_monotonic_decreasing
    assert found.best() == found.fit.model.structure
    assert found.fit.simulate(np.zeros(5), initial=0.0).shape == (5,)
    assert "selection" in found.chosen_by


def test_without_selection_traces_bic_sorts_the_shortlist() -> None:
    searched = sysid.search_orders(sysid.data(record(300), sample_time=1.0), "u -> y")
    assert searched.to_frame()["BIC"].is_monotonic_increasing
    assert searched.best().na == 2


def test_a_search_that_ends_at_its_edge_says_so() -> None:
    traces = sysid.data(record(300), sample_time=1.0)
    assert any("nk = 2" in note for note in sysid.search_orders(traces, "u -> y", max_nk=2).notes)
    assert not any("nk" in note for note in sysid.search_orders(traces, "u -> y", max_nk=6).notes)


def test_the_picture_and_the_table_are_there(found: OrderSearch) -> None:
    assert found.plot().axes
    assert str(found).startswith(f"{len(found.losses):,} structures")
    assert found._repr_html_().startswith("<pre>")


@pytest.mark.parametrize("inputs", [1, 2, 3, 5])
@pytest.mark.parametrize("samples", [20, 100, 10_000])
def test_what_is_not_asked_for_is_bounded_by_record_and_patience(samples: int, inputs: int) -> None:
    grid = _grid(samples, inputs, (None, None, None))
    assert grid.size(inputs) <= max(LARGEST, 2**inputs)
    assert grid.max_na <= 10
    assert grid.max_na == 1 or 4 * (grid.max_na + inputs * (grid.max_nb + grid.max_nk)) < samples


def test_what_cannot_be_searched_is_refused() -> None:
    traces = sysid.data(record(60), sample_time=1.0)
    with pytest.raises(TraceError):
        sysid.search_orders(traces, "u -> y", max_na=80)
    with pytest.raises(ConfigError, match="unknown criterion"):
        sysid.search_orders(traces, "u -> y").best("MDLX")
    many = sysid.data((np.random.default_rng(0).standard_normal((200, 4)), np.arange(200.0)), sample_time=1.0)
    with pytest.raises(ConfigError, match="too many candidates"):
        sysid.search_orders(many, "u1+u2+u3+u4 -> y", max_nb=30, max_nk=30)
    with pytest.raises(ConfigError, match="no trace is for estimation"):
        sysid.search_orders(sysid.data([record(60)], sample_time=1.0, split=["test"]), "u -> y")
