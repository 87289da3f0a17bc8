"""State spaces by the prediction error: exact gradients, known systems, their own intervals."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import optimize

from sysid.errors import ConfigError, TraceError
from sysid.estimation import Loop, StateSpaceTraining, Status, fit_state_space
from sysid.estimation.linear.segments import Segment
from sysid.estimation.linear.state_space.coordinates import Chart
from sysid.estimation.linear.state_space.provider import PredictionErrors
from sysid.estimation.linear.state_space.search import search
from sysid.models import LinearStateSpace, Mapping, Start, VectorStateSpace, model_from_dict
from sysid.models.linear.innovations import Innovations
from sysid.traces import Channel, Trace
from tests.estimation.linear.subspace.test_subspace import TRUE, poles, segment
from tests.estimation.linear.subspace.test_subspace import C as C_TRUE
from tests.estimation.linear_systems import trace_of

ONE, FREE = Mapping.parse("u1 -> y"), Start(kind="estimated")
F, BU, CE = [1.0, -1.5, 0.8], [0.0, 1.0, 0.5], [1.0, -0.9, 0.4]


def record(seed: int, n: int = 600, noise: float = 1.0) -> Trace:
    """Two states with coloured noise on an offset; nothing is known of what came before."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    u, e = np.sign(rng.normal(size=n + 100)), noise * rng.normal(size=n + 100)
    y = 3.0 + lfilter(BU, F, u) + lfilter(CE, F, e)
    return trace_of(u[100:, np.newaxis], y[100:])


@pytest.mark.parametrize("rest", [None, (np.array([0.3, -0.2]), np.array([0.5, 0.1]))], ids=["free", "stood"])
@pytest.mark.parametrize("weights", [1.0, 0.3])
def test_the_gradient_is_that_of_the_loss(rest: tuple | None, weights: float) -> None:
    one = segment(60, 3, noise=0.5)
    record = Segment(inputs=one.inputs, outputs=one.outputs, root_weights=np.full(60, weights), rest=rest)
    base = Innovations(A=TRUE.A * 0.95, B=TRUE.B, C=TRUE.C, D=0.1 * np.ones((2, 2)), K=TRUE.K, constant=TRUE.constant)
    chart = Chart.around(base, feedthrough=True, noise=True, intercept=True)
    assert chart.n_parameters == 3 * (2 + 2) + 3 * 2 + 4 + 2
    errors = PredictionErrors(
        chart=chart, segments=(record,), whitening=np.array([[1.0, 0.0], [0.4, 0.7]]), stable=False
    )
    theta = 0.01 * np.random.default_rng(0).normal(size=chart.n_parameters)
    at = errors.linearise(theta)
    assert at.loss == pytest.approx(errors.loss(theta), rel=1e-9)
    numeric = optimize.approx_fprime(theta, errors.loss, 1e-6)
    np.testing.assert_allclose(at.gradient, numeric, rtol=1e-3, atol=1e-3 * np.abs(numeric).max())


def test_a_system_of_two_outputs_is_found_with_its_noise() -> None:
    found = search(
        [segment(1500, seed, noise=0.3) for seed in range(2)], LinearStateSpace(states=3), StateSpaceTraining()
    )
    assert found.status is Status.CONVERGED
    np.testing.assert_allclose(poles(found.system), poles(TRUE), atol=0.01)
    np.testing.assert_allclose(found.covariance, 0.09 * np.eye(2), atol=0.01)
    np.testing.assert_allclose(found.system.constant, TRUE.constant, atol=0.2)


def test_true_polynomials_lie_within_their_intervals() -> None:
    """Four standard deviations; how often two hold the truth is counted by ``tests.benchmarks linear``."""
    fit = fit_state_space([record(0)], ONE, LinearStateSpace(states=2), start=FREE)
    assert fit.uncertainty.names == ("B(u1, 1)", "B(u1, 2)", "F(1)", "F(2)", "C(1)", "C(2)", "constant")
    off = np.abs(fit.uncertainty.values - [*BU[1:], *F[1:], *CE[1:], 3.0]) / fit.uncertainty.standard_deviations
    assert 0.2 < off.max() < 4.0


def test_one_step_ahead_errors_are_white_and_smaller_than_those_of_the_free_run() -> None:
    trace = record(1)
    fit = fit_state_space([trace], ONE, LinearStateSpace(states=2), start=FREE)
    u, y = trace.columns(["u1"]), trace["y"]
    e = (y - fit.model.predict(u, y))[50:]
    assert fit.loop is Loop.OPEN
    assert np.var(e) == pytest.approx(1.0, rel=0.15)
    assert abs(np.corrcoef(e[1:], e[:-1])[0, 1]) < 0.1
    assert np.var(y - fit.model.simulate(u)) > 1.3 * np.var(e)


@pytest.mark.parametrize("noise", [True, False])
def test_a_record_without_noise_is_fitted_exactly(noise: bool) -> None:
    trace = record(2, 200, noise=0.0)
    fit = fit_state_space([trace], ONE, LinearStateSpace(states=2, noise=noise), start=FREE)
    np.testing.assert_allclose(fit.model.ratio(0).F, F, atol=1e-6)
    np.testing.assert_allclose(fit.model.ratio(0).B, BU[1:], atol=1e-5)


def test_masked_samples_say_nothing() -> None:
    clean = record(3, 400)
    values = clean.values.copy()
    values[100:110, 1] = 1e6
    usable = np.ones(400, dtype=bool)
    usable[100:110] = False
    spoiled = Trace(name="t", sample_time=1.0, channels=clean.channels, values=values, usable=usable)
    blank = Trace(name="t", sample_time=1.0, channels=clean.channels, values=clean.values, usable=usable)
    one, other = (fit_state_space([t], ONE, LinearStateSpace(states=2), start=FREE) for t in (spoiled, blank))
    np.testing.assert_allclose(one.model.ratio(0).F, other.model.ratio(0).F, rtol=1e-6)


def test_a_subspace_estimate_is_exact_and_says_so() -> None:
    fit = fit_state_space(
        [record(4)], ONE, LinearStateSpace(states=2), StateSpaceTraining(method="subspace"), start=FREE
    )
    assert fit.status is Status.EXACT
    assert fit.uncertainty is None
    np.testing.assert_allclose(fit.model.ratio(0).F, F, atol=0.1)


def test_poles_stay_inside_where_that_is_asked() -> None:
    t = np.arange(60)
    trace = trace_of(np.sin(0.4 * t)[:, np.newaxis], 1.05**t + 0.01 * np.random.default_rng(0).normal(size=60))
    free = fit_state_space([trace], ONE, LinearStateSpace(states=2), start=FREE)
    held = fit_state_space([trace], ONE, LinearStateSpace(states=2), StateSpaceTraining(stable=True), start=FREE)
    assert held.model.pole_radius < 1.0 < free.model.pole_radius


@pytest.mark.parametrize("wrong", [{"method": "magic"}, {"weighting": "none"}, {"horizon": 1}, {"max_iterations": -1}])
def test_options_that_cannot_be_are_refused(wrong: dict) -> None:
    with pytest.raises(ConfigError) as caught:
        StateSpaceTraining(**wrong)
    assert caught.value.remedy


@pytest.mark.parametrize("states", [0, 101, 2.5, True, None])
def test_numbers_of_states_that_cannot_be_are_refused(states: object) -> None:
    with pytest.raises(ConfigError, match="not a number of states"):
        LinearStateSpace(states=states)  # type: ignore[arg-type]


def test_a_record_too_short_for_its_states_is_refused() -> None:
    with pytest.raises(TraceError):
        fit_state_space([record(0, 12)], ONE, LinearStateSpace(states=5), start=FREE)


def two_outputs(seed: int, n: int = 500) -> Trace:
    one = segment(n, seed, noise=0.3)
    values = np.column_stack([one.inputs, 10.0 * one.outputs[:, 0], one.outputs[:, 1] + 5.0])
    channels = tuple(Channel(name=name, unit=unit) for name, unit in zip("abyz", ("V", "V", "bar", "K"), strict=True))
    return Trace(name="t", sample_time=0.5, channels=channels, values=values)


def test_several_outputs_are_one_model_that_stores_and_predicts_itself() -> None:
    traces, mapping = [two_outputs(0), two_outputs(1)], Mapping.parse("a+b -> y+z")
    fit = fit_state_space(traces, mapping, VectorStateSpace(states=3), start=FREE)
    np.testing.assert_allclose(poles(fit.model.system), poles(TRUE), atol=0.03)
    gain = C_TRUE @ np.linalg.solve(np.eye(3) - TRUE.A, TRUE.B) * np.array([[10.0], [1.0]])
    A, B, C, D = fit.model.matrices
    np.testing.assert_allclose(C @ np.linalg.solve(np.eye(3) - A, B) + D, gain, rtol=0.1, atol=0.5)
    u, y = two_outputs(2).columns("ab"), two_outputs(2).columns("yz")
    again = model_from_dict(json.loads(json.dumps(fit.model.to_dict())))
    np.testing.assert_array_equal(again.predict(u, y, steps=2), fit.model.predict(u, y, steps=2))
    moved, x, K = np.zeros_like(y), np.zeros(3), fit.model.kalman_gain
    moved[60:] = np.random.default_rng(0).normal(size=y[60:].shape)
    for ahead, more in zip(fit.model.predict(u, y + moved) - fit.model.predict(u, y), moved, strict=True):
        np.testing.assert_allclose(ahead, C @ x, atol=1e-8)  # the gain in units moves the state by what is new
        x = A @ x + K @ (more - C @ x)
    e = (y - again.predict(u, y))[50:]
    np.testing.assert_allclose(np.std(e, axis=0), [3.0, 0.3], rtol=0.15)
    known = dict(zip(fit.uncertainty.names, fit.uncertainty.standard_deviations, strict=True))
    assert {"B(y, a, 1)", "B(z, b, 3)", "F(3)", "C(z, y, 1)", "constant(z)"} <= set(known)
    assert all(0.0 < value < np.inf for value in known.values())
    ratios = {at: ratio.of_numerator for at, ratio in fit.model.ratios.items()}
    assert ratios == {(0, 0): "B(y, a, ", (0, 1): "B(y, b, ", (1, 0): "B(z, a, ", (1, 1): "B(z, b, "}
    control = fit.model.to_control()
    np.testing.assert_allclose(control.dcgain(), gain, rtol=0.1, atol=0.5)


def test_one_output_of_a_vector_model_is_the_single_model() -> None:
    trace = record(5)
    single = fit_state_space([trace], ONE, LinearStateSpace(states=2), start=FREE).model
    vector = fit_state_space([trace], ONE, VectorStateSpace(states=2), start=FREE).model
    u = trace.columns(["u1"])
    np.testing.assert_allclose(vector.simulate(u)[:, 0], single.simulate(u), rtol=1e-9, atol=1e-9)


def test_without_an_intercept_zero_stays_zero() -> None:
    trace = record(6)
    model = fit_state_space([trace], ONE, LinearStateSpace(states=2, noise=False, intercept=False), start=FREE).model
    assert np.abs(model.simulate(np.zeros((5, 1)))).max() < 1e-12
