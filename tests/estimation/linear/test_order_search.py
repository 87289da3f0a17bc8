"""Order search: every loss is that of the fit itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sysid.errors import ConfigError, TraceError
from sysid.estimation import fit_arx
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import Criterion, OrderLosses, search_orders
from sysid.models import ARX, Mapping, Start, StartKind
from sysid.traces import Trace
from tests.estimation.linear_systems import arx_response, steps, trace_of

TWO = Mapping.parse("u1+u2 -> y")
A, B = [1.5, -0.7], [[0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 0.3]]


def record(seed: int, n: int = 400, noise: float = 0.5) -> Trace:
    rng = np.random.default_rng(seed)
    u = steps(n, 2, rng)
    return trace_of(u, arx_response(A, B, u, noise * rng.normal(size=n)), name=f"t{seed}")


def losses_by_fitting(losses: OrderLosses, traces: list[Trace], start: Start) -> np.ndarray:
    """The slow twin: one least-squares fit for each candidate."""
    return np.array([fit_arx(traces, TWO, losses.orders(i), start=start).history["mse"][0] for i in range(len(losses))])


@pytest.mark.parametrize("intercept", [True, False], ids=["intercept", "no intercept"])
@pytest.mark.parametrize("start", [Start(), Start(kind=StartKind.MEASURED, n_measured=4)], ids=["rest", "measured"])
def test_every_loss_is_that_of_the_fit(intercept: bool, start: Start) -> None:
    grid = OrderGrid(max_na=3, max_nb=3, max_nk=2, min_na=0, min_nb=0, intercept=intercept)
    traces = [record(0), record(1)]
    losses = search_orders(traces, TWO, grid, start=start)
    assert len(losses) == grid.size(2) == 4 * (4 * 3) ** 2
    np.testing.assert_allclose(losses.mse, losses_by_fitting(losses, traces, start), rtol=1e-11)


@settings(max_examples=15)
@given(
    na=st.integers(0, 3), nb=st.integers(1, 3), nk=st.integers(0, 2), wide=st.integers(0, 2), seed=st.integers(0, 99)
)
def test_any_grid(na: int, nb: int, nk: int, wide: int, seed: int) -> None:
    grid = OrderGrid(min_na=na, max_na=na + wide, min_nb=nb, max_nb=nb + 1, min_nk=nk, max_nk=nk + 1)
    losses = search_orders([record(seed, 120)], TWO, grid, workers=1)
    assert len({(losses.orders(i)) for i in range(len(losses))}) == grid.size(2)
    np.testing.assert_allclose(losses.mse, losses_by_fitting(losses, [record(seed, 120)], Start()), rtol=1e-10)


def test_nearly_equal_columns_lose_no_digits() -> None:
    """A signal sampled so finely that its lags differ by a millionth: the normal matrix has no digit left."""
    n = 3000
    time = np.arange(n) * 1e-3
    u = np.column_stack([np.sin(time), np.cos(0.7 * time)])
    y = arx_response([1.9, -0.901], [[0.0, 1e-3], [0.0, 2e-3]], u, 1e-7 * np.random.default_rng(0).normal(size=n))
    losses = search_orders([trace_of(u, y)], TWO, OrderGrid(max_na=2, max_nb=2, max_nk=1))
    np.testing.assert_allclose(losses.mse, losses_by_fitting(losses, [trace_of(u, y)], Start()), rtol=1e-6)


def test_dependent_columns_change_nothing() -> None:
    trace = record(0)
    same = trace_of(np.column_stack([trace["u1"], trace["u1"]]), trace["y"])
    losses = search_orders([same], TWO, OrderGrid(max_na=1, max_nb=1, max_nk=1, min_nk=1, min_nb=0))
    one, both = losses.mse[(losses.nb == [1, 0]).all(axis=1)], losses.mse[(losses.nb == [1, 1]).all(axis=1)]
    np.testing.assert_allclose(both, one, rtol=1e-12)


@pytest.mark.parametrize("criterion", [Criterion.AICC, Criterion.BIC], ids=lambda c: c.value)
def test_the_true_orders_are_found(criterion: Criterion) -> None:
    grid = OrderGrid(max_na=4, max_nb=4, max_nk=3)
    assert search_orders([record(3, 4000)], TWO, grid).best(Criterion.BIC) == ARX(na=2, nb=(2, 1), nk=(1, 3))
    assert search_orders([record(3, 4000)], TWO, grid).best(criterion).na >= 2


def test_criteria_are_what_their_authors_wrote() -> None:
    losses = search_orders([record(0)], TWO, OrderGrid(max_na=1, max_nb=1, max_nk=0))
    n, p, v = 400, 4, losses.mse[0]
    assert losses.score(Criterion.AIC)[0] == pytest.approx(n * np.log(v) + 2 * p)
    assert losses.score(Criterion.AICC)[0] == pytest.approx(n * np.log(v) + 2 * p + 2 * p * (p + 1) / (n - p - 1))
    assert losses.score(Criterion.BIC)[0] == pytest.approx(n * np.log(v) + p * np.log(n))


def test_candidates_of_many_inputs_are_counted_without_being_made() -> None:
    """What says that a search is too large made all combinations for it: of eight inputs half a million."""
    grid = OrderGrid(max_na=4, max_nb=6, max_nk=1)
    assert len(grid.counts(3)) == 6**3
    assert grid.size(3) == 4 * 6**3 * 2**3
    assert grid.size(20) == 4 * 6**20 * 2**20
    assert replace(grid, read=2).size(20) == 4 * 6**18 * 5**2 * 2**18


def test_shortlist_has_the_best_of_every_size() -> None:
    losses = search_orders([record(0)], TWO, OrderGrid(max_na=4, max_nb=4, max_nk=1))
    p = losses.n_parameters
    chosen = losses.shortlist(30)
    assert len(set(chosen.tolist())) == 30
    for size in np.unique(p):
        assert losses.mse[p == size].min() in losses.mse[chosen]


def test_losses_survive_being_stored(tmp_path) -> None:
    losses = search_orders([record(0)], TWO, OrderGrid(max_na=2, max_nb=2, max_nk=1))
    losses.write(tmp_path / "losses.npz")
    again = OrderLosses.read(tmp_path / "losses.npz")
    np.testing.assert_array_equal(again.mse, losses.mse)
    assert (again.best(), again.n_samples, again.intercept) == (losses.best(), losses.n_samples, losses.intercept)


def test_progress_ends_with_all_candidates() -> None:
    grid, seen = OrderGrid(max_na=1, max_nb=1, max_nk=1), []
    search_orders([record(0)], TWO, grid, on_progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (grid.size(2), grid.size(2))
    assert len(seen) == 4


def test_a_record_too_short_is_refused() -> None:
    with pytest.raises(TraceError, match="fewer samples"):
        search_orders([record(0, 20)], TWO, OrderGrid(max_na=10, max_nb=10, max_nk=0))


def test_an_empty_range_is_refused() -> None:
    with pytest.raises(ConfigError, match="range of nb"):
        OrderGrid(max_na=1, min_nb=3, max_nb=2, max_nk=0)


def test_a_time_series_has_orders_too() -> None:
    rng = np.random.default_rng(0)
    y = arx_response(A, [], np.empty((600, 0)), rng.normal(size=600))
    losses = search_orders(
        [trace_of(np.empty((600, 0)), y)], Mapping.parse("-> y"), OrderGrid(max_na=5, max_nb=3, max_nk=2)
    )
    assert len(losses) == 5
    assert losses.best().na == 2
