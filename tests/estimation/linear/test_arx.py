"""ARX by least squares: parameters, their uncertainty, deviations, several experiments."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize

from sysid.errors import TraceError
from sysid.estimation import FitResult, OperatingPoint, fit_arx
from sysid.models import ARX, Mapping, Start, StartKind
from sysid.traces import Trace
from tests.estimation.linear_systems import CHANNELS, arx_response, noise_for, steps, trace_of

A, B = [1.5, -0.7], [[0.0, 1.0, 0.5], [0.0, 0.0, 0.0, 0.3]]
ORDERS = ARX(na=2, nb=(2, 1), nk=(1, 3))
TWO, ONE = Mapping.parse("u1+u2 -> y"), Mapping.parse("u1 -> y")
TRUE = np.array([1.0, 0.5, 0.3, 1.5, -0.7])


def record(seed: int, decibel: float, n: int = 600) -> Trace:
    rng = np.random.default_rng(seed)
    u = steps(n, 2, rng)
    clean = arx_response(A, B, u, np.zeros(n))
    innovation = noise_for(clean, decibel, rng) * 0.3  # the recursion amplifies white noise by some 3.3
    return trace_of(u, arx_response(A, B, u, innovation))


def test_a_noise_free_system_is_found_exactly() -> None:
    trace = record(0, 400.0)
    fit = fit_arx([trace], TWO, ORDERS)
    np.testing.assert_allclose(fit.model.coefficients, TRUE, rtol=1e-9)
    assert fit.model.intercept == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize("decibel", [20.0, 40.0])
def test_true_parameters_lie_within_their_95_percent_intervals(decibel: float) -> None:
    held = 0
    for seed in range(20):
        uncertainty = fit_arx([record(seed, decibel)], TWO, ORDERS).uncertainty
        low, high = uncertainty.interval(0.95).T[:, :5]
        held += int(np.sum((low <= TRUE) & (high >= TRUE)))
    assert 0.90 <= held / 100 <= 0.99


def test_standard_deviations_are_the_spread_of_the_estimates() -> None:
    fits = [fit_arx([record(seed, 20.0)], TWO, ORDERS) for seed in range(200)]
    spread = np.std([fit.model.coefficients for fit in fits], axis=0)
    told = np.mean([fit.uncertainty.standard_deviations[:5] for fit in fits], axis=0)
    np.testing.assert_allclose(told, spread, rtol=0.2)


def test_names_say_what_each_parameter_is() -> None:
    names = fit_arx([record(0, 20.0)], TWO, ORDERS).uncertainty.names
    assert names == ("b(u1, 1)", "b(u1, 2)", "b(u2, 3)", "a(1)", "a(2)", "intercept")


def test_uncertainty_survives_being_stored() -> None:
    fit = fit_arx([record(0, 20.0)], TWO, ORDERS)
    again = FitResult.from_dict(fit.to_dict()).uncertainty
    np.testing.assert_array_equal(again.covariance, fit.uncertainty.covariance)
    assert again.names == fit.uncertainty.names


def shifted(trace: Trace) -> Trace:
    return Trace(
        name="high", sample_time=1.0, channels=trace.channels, values=trace.values + np.array([90.0, 40.0, 60.0])
    )


def free_run_mse(fit: FitResult, trace: Trace) -> float:
    return float(np.mean((fit.model.simulate(trace.columns(["u1", "u2"])) - trace["y"]) ** 2))


def test_deviations_and_intercept_agree_and_neither_fails() -> None:
    trace = shifted(record(1, 40.0))
    plain = ARX(na=2, nb=(2, 1), nk=(1, 3), intercept=False)
    rest = {"rest_output": 60.0}
    intercept = fit_arx([trace], TWO, ORDERS, **rest)
    point = OperatingPoint(inputs=(90.0, 40.0), output=60.0)
    deviations = fit_arx([trace], TWO, plain, operating_point=point, **rest)
    neither = fit_arx([trace], TWO, ARX(na=2, nb=(1, 0), nk=(1, 3), intercept=False), **rest)
    np.testing.assert_allclose(deviations.model.coefficients, intercept.model.coefficients, atol=2e-3)
    assert deviations.model.n_parameters == intercept.model.n_parameters - 1
    assert free_run_mse(deviations, trace) < 0.1 * free_run_mse(neither, trace)


def test_deviations_with_an_intercept_are_refused() -> None:
    with pytest.raises(TraceError, match="nothing for an intercept"):
        fit_arx([record(0, 40.0)], TWO, ORDERS, operating_point=OperatingPoint(inputs=(0.0, 0.0), output=0.0))


def test_experiments_are_not_concatenated() -> None:
    """Two halves that were far apart: a row across the seam would be an outlier."""
    first, second = record(3, 300.0), record(4, 300.0)
    jump = Trace(name="b", sample_time=1.0, channels=CHANNELS, values=second.values)
    np.testing.assert_allclose(fit_arx([first, jump], TWO, ORDERS, rest_output=0.0).model.coefficients, TRUE, rtol=1e-8)


def test_ridge_shrinks_as_its_cost_function_says() -> None:
    trace, ridge = record(2, 20.0), 0.05
    orders = ARX(na=1, nb=(1, 1), nk=(1, 1), intercept=False)
    ours = fit_arx([trace], TWO, orders, ridge=ridge, rest_output=0.0).model.coefficients
    y, u = trace["y"], trace.columns(["u1", "u2"])
    X = np.column_stack([np.r_[u[:1, 0], u[:-1, 0]], np.r_[u[:1, 1], u[:-1, 1]], np.r_[0.0, y[:-1]]])
    weights = ridge * np.sum(X**2, axis=0)
    reference = optimize.minimize(lambda c: np.sum((y - X @ c) ** 2) + np.sum(weights * c**2), np.zeros(3), tol=1e-12)
    np.testing.assert_allclose(ours, reference.x, atol=1e-5)


def test_undetermined_parameters_have_no_standard_deviation() -> None:
    trace = record(0, 20.0)
    twice = trace_of(np.column_stack([trace["u1"], trace["u1"]]), trace["y"])
    fit = fit_arx([twice], TWO, ARX(na=1, nb=(1, 1), nk=(1, 1)))
    assert np.isnan(fit.uncertainty.standard_deviations).sum() == 1
    assert any("determine 3 of 4" in note for note in fit.notes)


DATA = os.environ.get("SYSID_DATA")


@pytest.mark.skipif(DATA is None, reason="SYSID_DATA names no folder with the public data sets")
def test_hair_dryer_has_the_coefficients_of_the_textbook() -> None:
    """Ljung 1999, section 17.3; the data are DaISy's (96-006), samples 1 to 300, means removed."""
    values = np.loadtxt(Path(str(DATA)) / "hair_dryer" / "dryer.dat")[:300]
    trace = trace_of(values[:, :1], values[:, 1], sample_time=0.08)
    fit = fit_arx(
        [trace],
        ONE,
        ARX(na=2, nb=(2,), nk=(3,), intercept=False),
        start=Start(kind=StartKind.MEASURED, n_measured=4),
        operating_point=OperatingPoint(inputs=(float(values[:, 0].mean()),), output=float(values[:, 1].mean())),
    )
    assert [f"{-a:.5f}" for a in fit.model.a] == ["-1.27374", "0.39355"]
    assert [f"{b:.5f}" for b in fit.model.b[0]] == ["0.06662", "0.04448"]
