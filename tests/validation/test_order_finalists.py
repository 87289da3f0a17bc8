"""Finalists of an order search: free runs on every case, best mean fit first."""

from __future__ import annotations

import numpy as np

from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import search_orders
from sysid.models import ARX, Mapping, Start
from sysid.traces import Role
from sysid.validation import evaluate_case
from sysid.validation.order_finalists import alike_with, run_finalists, smallest_first
from tests.estimation.linear_systems import arx_response, steps, trace_of

MAPPING = Mapping.parse("u1 -> y")


def record(seed: int, noise: float):
    rng = np.random.default_rng(seed)
    u = steps(800, 1, rng)
    return trace_of(u, arx_response([1.5, -0.7], [[0.0, 1.0, 0.5]], u, noise * rng.normal(size=800)), name=f"t{seed}")


def test_the_best_free_run_is_kept() -> None:
    estimation, cases = record(0, 0.1), [record(seed, 0.0) for seed in (1, 2, 3)]
    losses = search_orders([estimation], MAPPING, OrderGrid(max_na=4, max_nb=4, max_nk=2))
    seen = []
    finalists = run_finalists(
        losses, [estimation], MAPPING, cases, count=30, rest_output=0.0, on_progress=lambda *at: seen.append(at)
    )
    means = [entry.mean_fit for entry in finalists.ranked]
    assert len(means) == 30
    assert means == sorted(means, reverse=True)
    assert finalists.best.mean_fit > 97.0
    assert seen[-1] == (30, 30)
    best = finalists.best
    again = [evaluate_case(best.fit.model, case, Role.VALIDATION, Start(), 1).free_run for case in cases]
    assert list(best.cases.values()) == again
    assert best.std_fit == np.std([case.nrmse_fit for case in again])


def test_a_free_run_that_runs_away_is_last_and_counted() -> None:
    estimation = record(0, 0.5)
    grown = trace_of(estimation.columns(["u1"]), np.exp(0.8 * np.arange(800.0) - 300.0))
    losses = search_orders([grown], MAPPING, OrderGrid(max_na=1, min_na=0, max_nb=1, max_nk=0))
    # In deviations of so small an output the last finite samples overflow, of which NumPy is not heard.
    long = trace_of(np.zeros((5000, 1)), 1e-3 * np.random.default_rng(0).normal(size=5000), name="long")
    finalists = run_finalists(losses, [grown], MAPPING, [long], count=2, rest_output=1.0)
    assert finalists.unstable == 1
    assert finalists.ranked[-1].fit.model.structure == ARX(na=1, nb=(1,), nk=(0,))


def test_the_smallest_of_those_that_cannot_be_told_from_the_best_comes_first() -> None:
    """The plant is ARX [2; 2; 1]: ten parameters are better by chance alone."""
    estimation, cases = record(14, 0.3), [record(104, 0.3)]
    losses = search_orders([estimation], MAPPING, OrderGrid(max_na=5, max_nb=5, max_nk=2))
    ranked = run_finalists(losses, [estimation], MAPPING, cases, count=30, rest_output=0.0).ranked
    first = smallest_first(ranked)
    assert ranked[0].fit.model.n_parameters == 11
    assert first[0].fit.model.n_parameters == 5
    assert ranked[0].mean_fit - first[0].mean_fit < 0.1
    assert [one for one in ranked if one is not first[0]] == list(first[1:])
    assert first[0] in alike_with(ranked[0], ranked)
    assert smallest_first(()) == ()
