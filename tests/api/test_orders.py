"""Which orders the data ask for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from threadpoolctl import threadpool_info, threadpool_limits

import sysid
from sysid.api import orders
from sysid.api.order_search import OrderSearch
from sysid.api.orders import LARGEST, _grid
from sysid.errors import ConfigError, TraceError
from sysid.estimation.linear.order_search import Criterion


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
    assert frame["fit"][1:].is_monotonic_decreasing
    # The best free run is no better than that of a smaller structure by more than chance.
    assert frame["fit"][0] > frame["fit"][1] - 0.5
    assert frame["parameters"][0] <= frame["parameters"][1]
    assert f"{frame['structure'][0]} is put first: the smallest of" in str(found)
    assert found.best() == found.fit.model.structure
    assert found.fit.simulate(np.zeros(5), initial=0.0).shape == (5,)
    assert "selection" in found.chosen_by


def test_an_unstable_pole_stands_apart_from_the_free_run(found: OrderSearch, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sysid.api.finalist_table.pole", lambda _: "1.0005, unstable")
    assert "  1.0005, unstable" in str(found)


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


def test_several_outputs_are_searched_one_by_one() -> None:
    u, y = record(200)
    traces = sysid.data((u, np.column_stack([y, np.r_[0.0, y[:-1]]])), sample_time=1.0)
    found = sysid.search_orders(traces, "u -> y1+y2", max_na=1, max_nb=1, max_nk=4)
    alone = sysid.search_orders(traces, "u -> y2", max_na=1, max_nb=1, max_nk=4)
    assert found["y2"].best().label == alone.best().label != found["y1"].best().label
    assert set(found.to_frame()["output"]) == {"y1", "y2"}
    assert str(alone) in str(found)


@pytest.mark.parametrize("inputs", [1, 2, 3, 5])
@pytest.mark.parametrize("samples", [20, 100, 10_000])
def test_what_is_not_asked_for_is_bounded_by_record_and_patience(samples: int, inputs: int) -> None:
    grid = _grid((samples, samples), inputs, (None, None, None), 0)
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


@pytest.fixture(scope="module")
def several() -> OrderSearch:
    """A quick plant under output noise, so that structures without noise in the equation are right."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 80), 5)
    y = lfilter([0.0, 0.0, 0.3], [1.0, -0.7], u) + 0.05 * rng.standard_normal(400)
    traces = sysid.data((u, y), sample_time=1.0)
    return sysid.search_orders(
        traces, "u -> y", max_na=3, max_nb=3, max_nk=3, structures=["SS", "oe", "ARMAX", "BJ", "TF"], most=2
    )


def test_other_structures_stand_in_one_table_with_the_arx_models(several: OrderSearch) -> None:
    frame = several.to_frame()
    assert {label.split()[0] for label in frame["structure"]} == {"ARX", "SS", "OE", "ARMAX", "BJ", "TF"}
    assert frame["BIC"].is_monotonic_increasing
    assert frame["structure"].iloc[0] in {"TF [1; 0; 2]", "OE [1; 1; 2]"}
    assert several.fit.model.structure.label == frame["structure"].iloc[0]
    assert "SS 2" in str(several)


def test_an_arx_model_has_the_same_figures_in_either_table(several: OrderSearch) -> None:
    best = several.losses.best()
    (row,) = (one for one in several.contenders if one.fit.model.structure == best)
    assert several.score(row, Criterion.BIC) == pytest.approx(several.losses.score(Criterion.BIC).min())


def test_state_spaces_bring_the_correlations_that_show_their_states(several: OrderSearch) -> None:
    assert several.states is not None
    # One pole, and one more state for the dead time of two samples.
    _, second, third = several.states.correlations[:3]
    assert second > 2.0 * third


def test_a_structure_that_the_record_is_too_short_for_is_told() -> None:
    traces = sysid.data(record(20), sample_time=1.0)
    found = sysid.search_orders(traces, "u -> y", max_na=1, max_nb=1, max_nk=1, structures=["BJ"], most=4)
    assert any(note.startswith("BJ ") and "fewer samples" in note for note in found.notes)


def test_an_unknown_structure_is_refused_by_name() -> None:
    with pytest.raises(ConfigError, match="no structure of this kind"):
        sysid.search_orders(sysid.data(record(60), sample_time=1.0), "u -> y", structures=["NARMAX"])


def test_many_short_records_are_searched_as_far_as_each_is_long() -> None:
    records = [record(14, seed=k) for k in range(30)]
    found = sysid.search_orders(sysid.data(records, sample_time=1.0), "u -> y")
    assert found.grid.max_na > 1 and found.grid.max_nb + found.grid.max_nk <= 7


def test_dead_times_beyond_the_usual_ones_are_searched_where_they_explain_more() -> None:
    """The best of a search up to 10 had a fit of 3 %, and its fit said nothing of that."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 40), 20)
    y = lfilter([*np.zeros(41), 0.1], [1.0, -0.9], u) + 0.005 * rng.standard_normal(800)
    traces = sysid.data((u, y), sample_time=0.1, split=(0.5, 0.2, 0.3))
    found = sysid.search_orders(traces, "u -> y", max_na=2, max_nb=2)
    assert found.best().nk[0] in {40, 41}
    assert found.finalists[0].mean_fit > 95.0
    early = sysid.search_orders(traces, "u -> y", max_na=2, max_nb=2, max_nk=10)
    assert early.grid.max_nk == 10
    assert [note for note in early.fit.warnings if "dead time is too short" in note]


def test_structures_are_named_in_a_text_too_and_an_order_is_a_number_above_0() -> None:
    """A text had been taken letter by letter, and no order had left the structures out without a word."""
    traces, small = sysid.data(record(200), sample_time=1.0), {"max_na": 1, "max_nb": 1, "max_nk": 1}
    found = sysid.search_orders(traces, "u -> y", structures="ARX, OE", most=1, **small)
    assert "OE [1; 1; " in str(found)
    for most in (0, True, 1.5):
        with pytest.raises(ConfigError, match="not a largest order"):
            sysid.search_orders(traces, "u -> y", structures="OE", most=most, **small)


@pytest.mark.parametrize("seed", range(2))
def test_of_structures_that_are_exact_the_smallest_is_first(seed: int) -> None:
    """Without noise larger ones are as exact, and rounding had chosen among them."""
    u, y = np.random.default_rng(seed).standard_normal(400), np.zeros(400)
    u[:10] = 0.0  # it begins at rest
    for k in range(5, 400):
        y[k] = 1.5 * y[k - 1] - 0.7 * y[k - 2] + 1e6 * u[k - 5]
    found = sysid.search_orders(sysid.data((u, y + 1e5), sample_time=1.0), "u -> y", structures="ARX, OE")
    for criterion in ("BIC", "AIC", "AICc"):
        assert found.best(criterion).label == "ARX [2; 1; 5]"
    first = found.contenders[0].fit.model
    assert (first.structure.label, first.n_parameters) == ("ARX [2; 1; 5]", 4)


def test_a_late_correlation_that_is_no_dead_time_costs_no_grid_of_all_lags() -> None:
    """An integrator under feedback answers a periodic reference a quarter of a period late, and at once."""
    rng, n = np.random.default_rng(0), 3000
    reference, y, u = np.sin(np.arange(n) / 60.0), np.zeros(n), np.zeros(n)
    for k in range(1, n):
        y[k] = y[k - 1] + 0.05 * u[k - 1]
        u[k] = 2.0 * (reference[k] - y[k]) + 1e-3 * rng.standard_normal()
    found = sysid.search_orders(sysid.data((u, y), sample_time=1.0), "u -> y")
    assert found.best().nk[0] <= 1
    assert found.grid.max_nk == 10
    # One that is late is found among all lags, also where the correlation is largest later still.
    delayed = np.concatenate([np.zeros(400), y[:-400]])
    late = sysid.search_orders(sysid.data((u, delayed), sample_time=1.0), "u -> y")
    assert late.best().nk[0] in {400, 401}


def test_linear_algebra_has_one_thread_while_orders_are_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many small problems: a second thread is waited for longer than it helps."""
    seen, run = list[int](), orders.run_finalists

    def watched(*args: Any, **options: Any) -> Any:
        seen.extend(row["num_threads"] for row in threadpool_info() if row["user_api"] == "blas")
        return run(*args, **options)

    monkeypatch.setattr(orders, "run_finalists", watched)
    u = np.random.default_rng(0).standard_normal(200)
    y = lfilter([0.0, 0.5], [1.0, -0.8], u)
    with threadpool_limits(limits=2, user_api="blas"):
        sysid.search_orders(sysid.data((u, y), sample_time=1.0, split=0.6), "u -> y", max_na=2, max_nb=2, max_nk=2)
    assert set(seen) == {1}


def coupled(n: int = 1000, seed: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """The second output drives the first; each has an input of its own, that of the second later."""
    rng = np.random.default_rng(seed)
    u, y = np.repeat(rng.uniform(-1, 1, (n // 5, 2)), 5, axis=0), np.zeros((n, 2))
    for t in range(2, n):
        drive = np.array([u[t - 1, 0], u[t - 2, 1]])
        y[t] = [[0.8, 0.3], [0.0, 0.9]] @ y[t - 1] + 0.1 * drive + 0.01 * rng.normal(size=2)
    return u, y


def test_one_model_of_all_outputs_is_searched_equation_by_equation_and_run_as_a_whole() -> None:
    traces = sysid.data(coupled(), sample_time=1.0, split=(0.6, 0.2, 0.2))
    asked = {"max_na": 2, "max_nb": 1, "max_nk": 2}
    found = sysid.search_orders(traces, "u1+u2 -> y1+y2", **asked, structures="VectorARX")
    together = found.together
    best = together.best("BIC")
    assert best.na == ((1, 1), (0, 1))
    assert best.nk[0][0] == 1 and best.nk[1][1] == 2
    assert str(together).startswith(f"{len(together):,} equations of u1+u2 -> y1+y2; sorted by the free run")
    assert together.fit.model.structure == together.best()
    assert together.finalists[0].mean_fit > max(found[name].finalists[0].mean_fit for name in ("y1",))
    assert together.plot().axes and set(found.to_frame()["output"]) == {"y1", "y2", "y1+y2"}
    # Its losses are those of the fits.
    for one in together.finalists[:5]:
        orders, known = one.fit.model.structure, one.fit.uncertainty
        for i, losses in enumerate(together.losses.values()):
            row = [*orders.nb[i], *(n for j, n in enumerate(orders.na[i]) if j != i)]
            at = (losses.na == orders.na[i][i]) & (losses.nb == row).all(axis=1)
            at &= (losses.nk[:, :2] == orders.nk[i]).all(axis=1)
            left = losses.n_samples - int(losses.n_parameters[at][0])
            # The fit's rows begin at its own lags, those of the search at the longest: a few rows of 300.
            assert losses.mse[at][0] * losses.n_samples / left == pytest.approx(known.noise_covariance[i, i], rel=0.03)


def test_without_selection_traces_a_model_of_all_outputs_is_sorted_by_the_sum_of_its_equations() -> None:
    u, y = coupled(300)
    search = sysid.search_orders(
        sysid.data((u, y), sample_time=1.0), "u1+u2 -> y1+y2", max_na=1, max_nb=1, max_nk=2, structures=["VectorARX"]
    )
    assert search.together.to_frame()["BIC"].is_monotonic_increasing
    assert search.together.best().label == search.together.best("bic").label


def test_a_model_of_several_outputs_is_not_searched_for_one() -> None:
    with pytest.raises(ConfigError, match="VectorARX is a model of several outputs"):
        sysid.search_orders(sysid.data(record(100), sample_time=1.0), "u -> y", structures="VectorARX")
