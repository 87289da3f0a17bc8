"""Polynomial models by the prediction error: known systems are found, within their own intervals."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import optimize
from scipy.signal import lfilter

from sysid.errors import TraceError
from sysid.estimation import Status, fit_arx, fit_polynomial
from sysid.estimation.linear.polynomial.chart import PolynomialChart
from sysid.estimation.linear.polynomial.starts import inside, of_state_space
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.provider import PredictionErrors
from sysid.models import ARMAX, ARX, BJ, OE, Mapping, Start
from sysid.models.linear.polynomial_orders import AbstractPolynomial
from tests.estimation.linear_systems import trace_of

TWO, FREE = Mapping.parse("u1+u2 -> y"), Start(kind="estimated")
CASES = {
    "OE": (OE(nb=(2, 1), nf=(2, 1), nk=(1, 2)), [1.0, 0.5, 0.4, -1.5, 0.7, -0.8]),
    "BJ": (BJ(nb=(2, 1), nc=1, nd=1, nf=(2, 1), nk=(1, 2)), [1.0, 0.5, 0.4, -1.5, 0.7, -0.8, 0.5, -0.9]),
    "ARMAX": (ARMAX(na=2, nb=(2, 1), nc=2, nk=(1, 2)), [1.0, 0.5, 0.4, -1.5, 0.7, -0.6, 0.3]),
    "ARIX": (ARMAX(na=2, nb=(2, 1), nc=0, nk=(1, 2), integrated=True), [1.0, 0.5, 0.4, -1.5, 0.7]),
    "ARIMAX": (ARMAX(na=1, nb=(1, 1), nc=1, nk=(1, 1), integrated=True), [1.0, 0.5, -0.8, 0.4]),
}
KINDS = pytest.mark.parametrize(("orders", "truth"), CASES.values(), ids=list(CASES))


def record(orders: AbstractPolynomial, truth: list[float], seed: int, n: int = 700, noise: float = 0.5):
    rng = np.random.default_rng(seed)
    p = orders.polynomials(np.array([*truth, *[2.0] * orders.level]))
    u, e = np.sign(rng.normal(size=(n + 100, len(p.B)))), noise * rng.normal(size=n + 100)
    y = lfilter(p.C, np.convolve(p.A, p.D), e) + float(p.constant)
    for b, f, x in zip(p.B, p.F, u.T, strict=True):
        y = y + lfilter(b, np.convolve(p.A, f), x)
    return trace_of(u[100:], y[100:])


@KINDS
def test_true_coefficients_lie_within_their_intervals(orders: AbstractPolynomial, truth: list[float]) -> None:
    """Four standard deviations; how often two hold the truth is counted by ``tests.benchmarks linear``."""
    fit = fit_polynomial([record(orders, truth, 0)], TWO, orders, start=FREE)
    assert fit.status is Status.CONVERGED
    off = np.abs(fit.uncertainty.values[: len(truth)] - truth) / fit.uncertainty.standard_deviations[: len(truth)]
    assert 0.2 < off.max() < 4.0
    assert fit.uncertainty.noise_variance == pytest.approx(0.25, rel=0.25)


@KINDS
def test_gradients_are_those_of_the_loss(orders: AbstractPolynomial, truth: list[float]) -> None:
    trace = record(orders, truth, 1, 60)
    one = Segment(inputs=trace.columns(["u1", "u2"]), outputs=trace.columns(["y"]), root_weights=np.ones(60))
    chart = PolynomialChart(orders=orders)
    errors = PredictionErrors(chart=chart, segments=(one,), whitening=np.eye(1), stable=False)
    theta = np.array([*truth, *[1.5] * orders.level]) * 0.98
    numeric = optimize.approx_fprime(theta, errors.loss, 1e-7)
    np.testing.assert_allclose(errors.linearise(theta).gradient, numeric, rtol=1e-3, atol=1e-3 * np.abs(numeric).max())


AT_ONCE = BJ(nb=(2, 1), nc=1, nd=1, nf=(2, 1), nk=(0, 1))


@pytest.mark.parametrize("orders", [*(orders for orders, _ in CASES.values()), AT_ONCE], ids=[*CASES, "at once"])
def test_directions_are_those_of_small_steps_wherever_they_are_asked(orders: AbstractPolynomial) -> None:
    """They are worked out once where no input acts at once; where one does, they depend on where."""
    chart, rng = PolynomialChart(orders=orders), np.random.default_rng(2)
    for theta in rng.normal(size=(2, chart.n_parameters)):
        found = chart.directions(theta)
        for i, step in enumerate(1e-4 * np.eye(chart.n_parameters)):
            ahead, behind = chart.system(theta + step), chart.system(theta - step)
            for name in ("A", "B", "C", "D", "K", "constant"):
                slope = (getattr(ahead, name) - getattr(behind, name)) / 2e-4
                np.testing.assert_allclose(getattr(found, name)[..., i], slope, atol=1e-9)


def test_arma_needs_no_input() -> None:
    e = np.random.default_rng(0).normal(size=3000)
    series = trace_of(np.zeros((3000, 0)), 5.0 + lfilter([1.0, 0.6], [1.0, -0.8], e))
    fit = fit_polynomial([series], Mapping.parse("-> y"), ARMAX(na=1, nb=(), nc=1, nk=()), start=FREE)
    assert fit.uncertainty.names == ("A(1)", "C(1)", "constant")
    np.testing.assert_allclose(fit.uncertainty.values[:2], [-0.8, 0.6], atol=0.05)
    assert fit.model.structure.label == "ARMA [1; 1]"


def test_without_c_it_is_the_arx_model_of_least_squares() -> None:
    trace = record(*CASES["ARMAX"], 3)
    mine = fit_polynomial([trace], TWO, ARMAX(na=2, nb=(2, 1), nc=0, nk=(1, 2)), start=FREE)
    other = fit_arx([trace], TWO, ARX(na=2, nb=(2, 1), nk=(1, 2)), start=FREE)
    np.testing.assert_allclose(-mine.uncertainty.values[3:5], other.model.a, atol=5e-3)


def test_several_records_are_not_one() -> None:
    orders, truth = CASES["BJ"]
    records = [record(orders, truth, seed, 250) for seed in range(3)]
    fit = fit_polynomial(records, TWO, orders, start=FREE)
    np.testing.assert_allclose(fit.uncertainty.values[: len(truth)], truth, atol=0.25)


def test_roots_are_mirrored_into_the_unit_circle() -> None:
    np.testing.assert_allclose(inside(np.array([-2.5, 1.0])), np.poly([0.5, 0.5])[1:], atol=1e-9)
    assert inside(np.array([np.nan])).tolist() == [0.0]


def test_a_record_too_short_for_its_orders_is_refused() -> None:
    orders, truth = CASES["BJ"]
    with pytest.raises(TraceError, match="fewer samples"):
        fit_polynomial([record(orders, truth, 0, 12)], TWO, orders, start=FREE)


def test_the_fit_is_that_of_scipys_least_squares() -> None:
    """The same minimum from another program: errors with lfilter, minimised with least_squares."""
    orders, truth = CASES["BJ"]
    rng = np.random.default_rng(5)
    p = orders.polynomials(np.array([*truth, 0.0]))
    u, e = np.sign(rng.normal(size=(400, 2))), 0.3 * rng.normal(size=400)
    u[:3] = 0.0  # at rest before the record
    y = lfilter(p.C, p.D, e) + sum(lfilter(b, f, x) for b, f, x in zip(p.B, p.F, u.T, strict=True))
    still = BJ(nb=(2, 1), nc=1, nd=1, nf=(2, 1), nk=(1, 2), intercept=False)

    def errors(theta: np.ndarray) -> np.ndarray:
        q = still.polynomials(theta)
        driven = sum(lfilter(b, f, x) for b, f, x in zip(q.B, q.F, u.T, strict=True))
        return np.asarray(lfilter(q.D, q.C, y - driven))

    other = optimize.least_squares(errors, truth, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    mine = fit_polynomial([trace_of(u, y)], TWO, still, rest_output=0.0)
    assert float(mine.history["mse"][-1]) == pytest.approx(2.0 * other.cost / 400, rel=1e-6)
    np.testing.assert_allclose(mine.uncertainty.values, other.x, atol=2e-4)


@pytest.mark.parametrize("name", ["first", "nearly integrates", "no input"])
def test_of_nested_armax_models_none_fits_worse_than_one_that_it_contains(name: str) -> None:
    rng = np.random.default_rng(0)
    u, e = np.repeat(rng.choice([-1.0, 1.0], 40), 10), rng.normal(size=400)
    if name == "first":
        y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 0.05 * e
    elif name == "nearly integrates":
        y = lfilter([0.0, 1e3, 1e3], np.poly([0.999, 0.95]), u) + 1e4 * e
    else:
        y = lfilter([1.0, 0.5], np.poly([0.9, 0.4]), e)
    losses = []
    for n in range(1, 5):
        empty = name == "no input"
        orders = ARMAX(na=n, nb=() if empty else (n,), nc=n, nk=() if empty else (1,))
        record = trace_of(u[:, np.newaxis][:, :0] if empty else u[:, np.newaxis], y)
        fitted = fit_polynomial([record], Mapping.parse("-> y" if empty else "u1 -> y"), orders, start=FREE)
        losses.append(float(fitted.history["mse"][-1]))
    assert all(more <= less * (1.0 + 1e-6) for less, more in pairwise(losses)), losses


@pytest.mark.parametrize("orders", [OE(nb=2, nf=2, nk=1), BJ(nb=2, nc=1, nd=1, nf=2, nk=1)], ids=["OE", "BJ"])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
def test_a_plant_that_integrates_is_found_to_the_noise(orders: AbstractPolynomial, noise: float) -> None:
    """Its pole is put inside the unit circle by every start but that of a state space itself."""
    rng = np.random.default_rng(7)
    u = np.repeat(rng.choice([-1.0, 1.0], 45), 9)
    y = lfilter([0.0, 0.02, 0.01], np.poly([1.0, 0.8]), u) - 7.0
    record = trace_of(u[:, np.newaxis], y + noise * rng.normal(size=len(u)))
    fitted = fit_polynomial([record], Mapping.parse("u1 -> y"), orders, start=FREE)
    assert fitted.model.pole_radius == pytest.approx(1.0, abs=2e-4)
    assert float(fitted.history["mse"][-1]) < 1.05 * noise**2 + 1e-5 * np.var(y)


def test_armax_of_close_resonances_under_white_noise_of_a_sensor_ends_at_the_noise() -> None:
    """From regressions on long ARX models alone it ended, CONVERGED, at 1.3 times the power of the noise."""
    b = [0.0, -0.0075957337, 0.0364344048, -0.1207498403, 0.1625623018, -0.0720047037]
    a = [1.0, -3.8177267807, 6.3870542304, -6.171380279, 3.4817448128, -0.8793092731]
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1.0, 1.0, 100), rng.integers(2, 60, 100))[:2000]
    u[:10] = 0.0
    y = lfilter(b, a, u)
    e = 0.03 * y.std() * rng.normal(size=len(u))
    fit = fit_polynomial(
        [trace_of(u, y + e)], Mapping.parse("u1 -> y"), ARMAX(na=5, nb=(5,), nc=5, nk=(1,)), start=FREE
    )
    assert fit.status is Status.CONVERGED
    assert fit.history["mse"][-1] < 1.02 * np.mean(e**2)


def test_an_armax_start_from_a_state_space_is_that_state_space() -> None:
    """Noise through the plant's own poles and two dead times: its polynomials are those of the record."""
    orders, truth = CASES["ARMAX"]
    trace = record(orders, truth, seed=3, n=4000, noise=0.1)
    u, y = trace.columns(TWO.inputs), trace.columns(TWO.outputs)
    (start,) = of_state_space([Segment(inputs=u, outputs=y, root_weights=np.ones(len(y)))], orders)
    assert np.abs(start[:-1] - truth).max() < 0.05
