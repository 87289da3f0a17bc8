"""Linear models of anybody's record: off equilibrium, integrating, unstable, with inputs that say nothing."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.errors import TraceError
from sysid.estimation import FitResult, fit_arx, fit_transfer_function
from sysid.estimation.linear.transfer_function.training import TransferFunctionTraining
from sysid.models import ARX, Domain, Mapping, Start, StartKind, TransferFunction, TransferFunctionModel
from sysid.traces import Role, Trace
from sysid.validation.evaluation import evaluate_case
from tests.estimation.linear_systems import trace_of

ONE, TWO = Mapping.parse("u1 -> y"), Mapping.parse("u1+u2 -> y")
ESTIMATED = Start(kind=StartKind.ESTIMATED)
QUICK = TransferFunctionTraining(scattered_starts=0)


def steps(n: int, seed: int, held: int = 5) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    return np.repeat(rng.integers(0, 2, n // held + 1), held)[:n] * 2.0 - 1.0


def tf(trace: Trace | list[Trace], orders: TransferFunction, start: Start = ESTIMATED) -> FitResult:
    traces = trace if isinstance(trace, list) else [trace]
    mapping = ONE if len(orders.poles) == 1 else TWO
    return fit_transfer_function(traces, mapping, orders, QUICK, start=start)


def model_of(fit: FitResult) -> TransferFunctionModel:
    assert isinstance(fit.model, TransferFunctionModel)
    return fit.model


def bursts(a: float) -> list[Trace]:
    """Three short records that begin anywhere but in equilibrium."""
    traces = []
    for seed, (n, first) in enumerate(((40, 5.0), (30, -3.0), (25, 10.0))):
        u, y = steps(n, seed), np.zeros(n)
        y[0] = first
        for k in range(1, n):
            y[k] = a * y[k - 1] + (1.0 - a) * u[k - 1]
        traces.append(trace_of(u[:, None], y, name=f"burst{seed}"))
    return traces


@pytest.mark.parametrize("a", [0.9, 0.99, 0.999])
def test_bursts_off_equilibrium_are_fitted_exactly(a: float) -> None:
    traces = bursts(a)
    arx = fit_arx(traces, ONE, ARX(na=1, nb=(1,), nk=(1,)), start=ESTIMATED)
    np.testing.assert_allclose(arx.model.coefficients, [1.0 - a, a], atol=1e-6)
    found = model_of(tf(traces, TransferFunction(poles=(1,), zeros=(0,))))
    assert found.delays == (1,)
    np.testing.assert_allclose([found.denominator(0)[1], found.numerator(0)[0]], [-a, 1.0 - a], atol=1e-6)
    for fit in (arx.model, found):
        for trace in traces:
            assert evaluate_case(fit, trace, Role.ESTIMATION, ESTIMATED, 1).free_run.nrmse_fit > 99.99


@pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)
@pytest.mark.parametrize("integrators", [1, 2])
def test_a_plant_that_integrates_is_fitted_exactly(integrators: int, domain: Domain) -> None:
    u, T = steps(300, 1), 0.1
    # The sampled integrator of a held input, once or twice, with a level that is its own.
    b, f = ([0.0, T], [1.0, -1.0]) if integrators == 1 else ([0.0, T * T / 2, T * T / 2], [1.0, -2.0, 1.0])
    trace = trace_of(u[:, None], 0.5 * lfilter(b, f, u) + 2.0, sample_time=T)
    discrete = domain is Domain.DISCRETE
    zeros, delays = (integrators - 1) * discrete, None if integrators == 1 else (int(discrete),)
    orders = TransferFunction(poles=(integrators,), zeros=(zeros,), delays=delays, domain=domain)
    fit = tf(trace, orders)
    found = model_of(fit)
    poles = found.poles(0) if discrete else np.exp(found.poles(0) * T)
    assert np.abs(poles - 1.0).max() < 1e-7
    gain = found.numerator(0) / (0.5 * np.array(b[1:]) if discrete else 0.5)
    np.testing.assert_allclose(gain, 1.0, rtol=1e-6)
    assert "integrator" in fit.notes[-1]
    assert evaluate_case(found, trace, Role.ESTIMATION, ESTIMATED, 1).free_run.nrmse_fit > 99.999
    arx = fit_arx([trace], ONE, ARX(na=integrators, nb=(integrators,), nk=(1,)), start=ESTIMATED).model
    np.testing.assert_allclose(arx.b[0], 0.5 * np.array(b[1:]), atol=1e-9)


def test_a_plant_that_integrates_and_drifts_is_not_called_stable() -> None:
    u = steps(300, 1)
    y = lfilter([0.0, 0.05], [1.0, -1.0], u) - 0.01 * np.arange(len(u))
    fit = tf(trace_of(u[:, None], y), TransferFunction(poles=(1,), zeros=(0,), delays=(1,)))
    assert "integrator" in fit.notes[-1]


@pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)
@pytest.mark.parametrize("pole", [1.01, 1.2, 1.6])
def test_an_unstable_plant_in_a_loop_is_fitted_exactly(pole: float, domain: Domain) -> None:
    r, n = steps(400, 2), 400
    u, y, x = np.zeros(n), np.zeros(n), 0.3
    for k in range(n):
        y[k] = x
        u[k] = r[k] - (pole - 0.5) / 0.3 * y[k]
        x = pole * x + 0.3 * u[k]
    delays = (int(domain is Domain.DISCRETE),)
    orders = TransferFunction(poles=(1,), zeros=(0,), delays=delays, domain=domain)
    fit = tf(trace_of(u[:, None], y, sample_time=0.1), orders)
    found = model_of(fit)
    z = found.poles(0) if domain is Domain.DISCRETE else np.exp(found.poles(0) * 0.1)
    assert abs(z[0] - pole) < 1e-6
    assert not found.stable


def test_an_unstable_plant_with_noise_is_found_near_where_it_is() -> None:
    r, n, rng = steps(600, 2), 600, np.random.default_rng(0)
    u, y, x = np.zeros(n), np.zeros(n), 0.0
    for k in range(n):
        y[k] = x + 0.02 * rng.standard_normal()
        u[k] = r[k] - 2.0 * y[k]
        x = 1.2 * x + 0.3 * u[k]
    found = model_of(tf(trace_of(u[:, None], y), TransferFunction(poles=(1,), zeros=(0,), delays=(1,))))
    np.testing.assert_allclose([found.denominator(0)[1], found.numerator(0)[0]], [-1.2, 0.3], atol=0.01)


SAYS_NOTHING = {
    "constant": lambda u: np.full(len(u), 7.5),
    "zero": lambda u: np.zeros(len(u)),
    "duplicate": lambda u: u.copy(),
    "combination": lambda u: 3.0 - 2.0 * u,
}


@pytest.mark.parametrize("kind", SAYS_NOTHING)
@pytest.mark.parametrize("start", [ESTIMATED, Start()], ids=["estimated", "rest"])
def test_an_input_that_says_nothing_has_no_effect_and_the_other_is_fitted(kind: str, start: Start) -> None:
    u = np.r_[np.full(5, -1.0), steps(300, 3)]
    y = lfilter([0.0, 0.2], [1.0, -0.8], u + 1.0) + 2.0
    trace = trace_of(np.column_stack([u, SAYS_NOTHING[kind](u)]), y)
    fit = tf(trace, TransferFunction(poles=(1, 1), zeros=(0, 0), delays=(1, 1)), start)
    found = model_of(fit)
    np.testing.assert_allclose([found.denominator(0)[1], found.numerator(0)[0]], [-0.8, 0.2], atol=1e-8)
    assert found.numerator(1).tolist() == [0.0]


def test_an_output_that_never_changes_has_no_response() -> None:
    fit = tf(trace_of(steps(80, 1)[:, None], np.full(80, 0.3)), TransferFunction(poles=(2,), zeros=(1,)))
    assert model_of(fit).numerator(0).tolist() == [0.0, 0.0]
    np.testing.assert_allclose(fit.model.simulate(steps(20, 5)[:, None]), 0.3)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_too_few_samples_are_refused(n: int) -> None:
    with pytest.raises(TraceError, match="fewer samples than parameters"):
        tf(trace_of(steps(n, 1)[:, None], np.arange(float(n))), TransferFunction(poles=(1,), zeros=(0,), delays=(1,)))


def test_a_dead_time_longer_than_the_records_is_refused() -> None:
    trace = trace_of(steps(30, 1)[:, None], steps(30, 2))
    with pytest.raises(TraceError, match="dead time"):
        tf(trace, TransferFunction(poles=(1,), zeros=(0,), delays=(40,)))
    with pytest.raises(TraceError, match="too short"):
        fit_arx([trace], ONE, ARX(na=1, nb=(1,), nk=(40,)), start=ESTIMATED)


@settings(max_examples=3, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    poles=st.just(2) | st.just(3),
    noise=st.sampled_from([0.0, 0.05, 0.5]),
    domain=st.sampled_from(list(Domain)),
)
def test_no_structure_fits_its_record_worse_than_one_that_it_contains(
    seed: int, poles: int, noise: float, domain: Domain
) -> None:
    rng = np.random.default_rng(seed)
    u = steps(120, seed, held=int(rng.integers(1, 8)))
    f = np.poly(rng.uniform(0.2, 0.95, 3))
    y = lfilter(rng.normal(size=3), f, u)
    trace = trace_of(u[:, None], y + noise * y.std() * rng.standard_normal(120))
    loss = {}
    for n, m in itertools.product(range(1, poles + 1), range(poles + 1)):
        if m <= n:
            fit = tf(trace, TransferFunction(poles=(n,), zeros=(m,), delays=(1,), domain=domain))
            loss[n, m] = float(fit.history["mse"][-1])
    floor = 1e-12 * float(np.var(trace["y"]))
    for (n, m), value in loss.items():
        for (n2, m2), smaller in loss.items():
            # One pole less is contained in discrete time at z = 0; in continuous time only in the limit of a fast pole.
            if m2 <= m and (n2 == n or (n2 < n and domain is Domain.DISCRETE)):
                assert value <= smaller * (1.0 + 1e-3) + floor, f"{n, m} beside {n2, m2}"


def test_a_selection_trace_does_not_cut_the_iteration_short() -> None:
    u, rng = steps(400, 4), np.random.default_rng(1)
    clean = lfilter([0.0, 0.1, 0.08], np.poly([0.9, 0.7]), u)
    traces = [trace_of(u[:, None], clean + 0.05 * rng.standard_normal(400)) for _ in range(2)]
    orders = TransferFunction(poles=(2,), zeros=(1,), delays=(1,))
    alone = fit_transfer_function(traces[:1], ONE, orders, QUICK, start=ESTIMATED)
    chosen = fit_transfer_function(traces[:1], ONE, orders, QUICK, start=ESTIMATED, selection=traces[1:])
    assert chosen.history["mse"][-1] <= 1.1 * alone.history["mse"][-1]
    assert chosen.status.name == "CONVERGED"


@pytest.mark.parametrize("domain", list(Domain), ids=lambda d: d.value)
def test_as_many_zeros_as_poles_are_a_structure(domain: Domain) -> None:
    u = steps(200, 6)
    y = lfilter([0.5, -0.2], [1.0, -0.8], u)
    found = model_of(tf(trace_of(u[:, None], y), TransferFunction(poles=(1,), zeros=(1,), delays=(0,), domain=domain)))
    z = found.poles(0) if domain is Domain.DISCRETE else np.exp(found.poles(0))
    assert abs(z[0] - 0.8) < 1e-8
    run = found.simulate(u[1:, None])
    assert np.isfinite(run).all()


def test_a_record_that_is_shorter_than_the_lags_of_a_start_counts_beside_a_long_one() -> None:
    u = steps(200, 3)
    long, short = (trace_of(u[:n, None], lfilter([0.0, 0.2], [1.0, -0.8], u[:n]), name=f"{n}") for n in (200, 8))
    found = model_of(tf([short, long], TransferFunction(poles=(1,), zeros=(0,), delays=(1,))))
    np.testing.assert_allclose(found.numerator(0), [0.2], atol=1e-6)


def drifting(seed: int, n: int = 80) -> Trace:
    """A record that no transfer function explains: its slow drift draws the poles to the edge, and beyond."""
    rng, u = np.random.default_rng(seed), steps(n, seed)
    noise = np.cumsum(rng.standard_normal(n)) if seed % 2 else rng.standard_normal(n)
    b, f = ([0.0, 0.3], [1.0, -0.8]) if seed % 3 else ([0.0, 0.1], [1.0, -1.0])
    return trace_of(u[:, None], lfilter(b, f, u) + 0.05 * noise)


@settings(max_examples=2, deadline=None)
@given(seed=st.integers(0, 10**6), stable=st.none() | st.just(True))
@example(seed=3, stable=None)
def test_more_poles_than_the_plant_has_never_fit_worse(seed: int, stable: bool | None) -> None:
    """Also where poles may be anywhere, on records that draw them there."""
    options = TransferFunctionTraining(stable=stable, scattered_starts=0, max_iterations=40)
    trace, losses = drifting(seed), []
    for poles in (3, 5):
        orders = TransferFunction(poles=(poles,), zeros=(1,), delays=(1,))
        losses.append(fit_transfer_function([trace], ONE, orders, options, start=ESTIMATED).history["mse"][-1])
    assert all(larger <= smaller * (1.0 + 1e-6) for smaller, larger in itertools.pairwise(losses)), losses
