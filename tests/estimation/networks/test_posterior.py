"""The posterior against dense formulas, against draws from it, and against data whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from sysid.estimation import Evidence, Loop, Posterior, Training, fit_narx
from sysid.estimation.least_squares.damping.marquardt import MarquardtDamping
from sysid.estimation.least_squares.evidence import Group, Prior
from sysid.estimation.least_squares.state import State
from sysid.estimation.networks.posterior import Noise, calibrate, laplace, remaining
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, History, Mapping, NARXModel, Scaling, Start
from sysid.testing import finite_difference_jacobian, simulate
from sysid.traces import Channel, Trace

MAPPING = Mapping.parse("u -> y")
NETWORK = NARX(input_delays="0:1", output_delays=2, neurons=3)
RNG = np.random.default_rng(11)
EVIDENCE = Evidence(log_evidence=0.0, beta=1.0, alphas={}, effective_parameters={"all": 5.0}, parameters={"all": 20})


def model(seed: int = 3) -> NARXModel:
    theta = 0.3 * np.random.default_rng(seed).standard_normal(3 * 6 + 5)
    return NARXModel(
        network=NETWORK, theta=theta, mapping=MAPPING, sample_time=1.0, input_units=("V",), output_unit="V",
        rest_output=0.0, scaling=Scaling(input_offset=(0.1,), input_scale=(2.0,), output_offset=-0.5, output_scale=3.0),
    )  # fmt: skip


def experiment(n: int = 60, seed: int = 5) -> Experiment:
    rng = np.random.default_rng(seed)
    history = History.at_rest(inputs=[0.2], output=0.0)
    return Experiment(inputs=rng.uniform(-2, 2, (n, 1)), output=rng.uniform(-2, 2, n), history=history)


def noisy(memory: float = 0.0) -> Experiment:
    """A record whose free run leaves errors that are white, or remember their last value."""
    e = experiment()
    noise = lfilter([1.0], [1.0, -memory], np.random.default_rng(2).standard_normal(len(e.output)))
    return replace(e, output=model().simulate(e.inputs, e.history) + noise)


def outputs(of: NARXModel, e: Experiment, loop: Loop):
    """The output as a function of the parameters, by the slow twin where it is free to run."""

    def function(theta):
        form = replace(of, theta=theta).recursion
        if loop is Loop.CLOSED:
            return simulate(form, e.inputs, e.history)
        return form.predict(e.inputs, e.output, e.history, 1)

    return function


@pytest.mark.parametrize("loop", list(Loop), ids=["one step ahead", "free run"])
def test_the_variance_of_the_output_is_the_sensitivities_times_the_covariance(loop):
    factor = 1e-2 * RNG.standard_normal((23, 23))
    J = finite_difference_jacobian(outputs(model(), experiment(), loop), model().theta)
    posterior = Posterior(factor=factor, noise=Noise(free_run=0.0, one_step=0.0))
    found = posterior.parameter_variance(model(), experiment(), loop)
    assert_allclose(found, np.diag(J @ posterior.covariance @ J.T), rtol=1e-6)


def test_draws_from_the_posterior_spread_as_it_says():
    posterior = Posterior(factor=1e-3 * np.eye(23), noise=Noise(free_run=0.0, one_step=0.0))
    e, base = experiment(), model()
    draws = base.theta + 1e-3 * np.random.default_rng(0).standard_normal((2000, 23))
    runs = [replace(base, theta=theta).simulate(e.inputs, e.history) for theta in draws]
    assert_allclose(np.std(runs, axis=0), np.sqrt(posterior.parameter_variance(base, e, Loop.CLOSED)), rtol=0.1)


def state(alpha: float, beta: float, gauss_newton: np.ndarray) -> State:
    at = RecursionProvider(template=model().recursion, experiments=(experiment(),), closed=True).linearise(
        model().theta
    )
    groups = (Group(name="all", members=np.arange(23)),)
    prior = Prior(centre=np.zeros(23), groups=groups, alphas=np.array([alpha]), beta=beta)
    at = replace(at, gauss_newton=gauss_newton)
    return State(theta=model().theta, at=at, damping=MarquardtDamping(), prior=prior, evidence=EVIDENCE)


@pytest.mark.parametrize("copies", [1, 3], ids=["each record once", "each record three times"])
def test_the_covariance_is_the_inverse_of_the_curvature_in_the_basis_of_training(copies):
    J, P = RNG.standard_normal((40, 23)), np.eye(23) + 0.1 * RNG.standard_normal((23, 23))
    found = laplace(state(0.7, 2.5, J.T @ J), model(), P, (noisy(),), copies=copies)
    expected = P @ np.linalg.inv(2.5 / copies * J.T @ J + 0.7 * np.eye(23)) @ P.T
    assert_allclose(found.covariance, expected, rtol=1e-9, atol=1e-12)


def test_where_the_data_say_nothing_the_prior_stands():
    J = np.zeros((10, 23))
    J[:, :4] = 1e9  # so that rounding outweighs everything else
    found = laplace(state(0.5, 1e6, J.T @ J), model(), np.eye(23), (experiment(),), copies=1)
    assert np.isfinite(found.factor).all()
    assert_allclose(np.diag(found.covariance)[4:], 2.0, rtol=1e-6)


def test_the_noise_is_the_residual_with_the_parameters_paid_for():
    e = noisy()
    found = laplace(state(1.0, 1.0, np.eye(23)), model(), np.eye(23), (e,), copies=1)
    free = np.mean((model().simulate(e.inputs, e.history) - e.output) ** 2)
    step = np.mean((model().predict(e.inputs, e.output, e.history) - e.output) ** 2)
    assert found.noise.free_run == pytest.approx(free * 60 / 55)
    assert found.noise.one_step == pytest.approx(step * 60 / 55)


def test_errors_that_persist_say_less_than_training_counted_them_for():
    white, slow = (laplace(state(1.0, 1.0, np.eye(23)), model(), np.eye(23), (noisy(m),), copies=1) for m in (0.0, 0.9))
    assert np.trace(slow.covariance) > 1.2 * np.trace(white.covariance)
    left = remaining(model(), (noisy(0.9),))
    assert slow.noise.free_run > 1.2 * left.free_run  # the parameters are paid for with more samples each
    assert slow.noise.one_step == pytest.approx(left.one_step * 60 / 55)  # where errors are white, with one


def test_without_evidence_there_is_no_posterior():
    before = replace(state(1.0, 1.0, np.eye(23)), evidence=None)
    assert laplace(before, model(), np.eye(23), (experiment(),), copies=1) is None


def test_the_spread_makes_the_interval_hold_what_it_should_on_the_records_it_was_found_on():
    e, base = experiment(400), model()
    narrow = Posterior(factor=1e-6 * np.eye(23), noise=Noise(free_run=1e-4, one_step=1e-4))
    wide = calibrate(narrow, base, (e,))
    error = np.abs(base.simulate(e.inputs, e.history) - e.output)
    deviation = np.sqrt(wide.parameter_variance(base, e, Loop.CLOSED) + wide.noise.free_run)
    assert np.mean(error <= 1.959964 * wide.spread.free_run * deviation) == pytest.approx(0.95, abs=0.005)


def test_the_spread_never_narrows_an_interval():
    wide = Posterior(factor=np.eye(23), noise=Noise(free_run=1e4, one_step=1e4))
    assert calibrate(wide, model(), (experiment(),)).spread.free_run == 1.0
    assert calibrate(wide, model(), ()) is wide


def test_it_comes_back_from_arrays():
    posterior = Posterior(factor=RNG.standard_normal((4, 3)), noise=Noise(free_run=1.0, one_step=2.0))
    again = Posterior.from_arrays(posterior.to_arrays())
    np.testing.assert_array_equal(again.factor, posterior.factor)
    assert (again.noise.of(Loop.CLOSED), again.noise.of(Loop.OPEN), again.spread.one_step) == (1.0, 2.0, 1.0)


# Data from a network of the class that is fitted, with white noise on the measured output.

TRUTH = NARX(input_delays="0:1", output_delays=1, neurons=2)
SIGMA, START = 0.05, Start()


def record(seed: int, n: int = 500) -> tuple[Trace, np.ndarray]:
    """A noisy record, and the output without its noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, n // 10), 10)
    y = np.zeros(n)
    for t in range(1, n):
        y[t] = 0.85 * y[t - 1] + 0.2 * np.tanh(1.5 * u[t] + 0.5 * u[t - 1]) - 0.1 * np.tanh(y[t - 1])
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    values = np.column_stack([u, y + SIGMA * rng.standard_normal(n)])
    return Trace(name=f"record {seed}", sample_time=1.0, channels=channels, values=values), y


def test_intervals_hold_what_they_promise_where_the_noise_is_white():
    noisy, clean = [], []
    for seed in range(6):
        fit = fit_narx([record(seed)[0]], MAPPING, TRUTH, Training(max_iterations=80, seed=seed), rest_output=0.0)
        trace, truth = record(100 + seed)
        e = Experiment.from_trace(trace, MAPPING, start=START, rest_output=0.0)
        output = fit.model.simulate(e.inputs, e.history)
        variance = fit.posterior.parameter_variance(fit.model, e, Loop.CLOSED)
        clean.append(np.mean(np.abs(output - truth) <= 1.96 * np.sqrt(variance)))
        noisy.append(np.mean(np.abs(output - trace["y"]) <= 1.96 * np.sqrt(variance + fit.posterior.noise.free_run)))
        assert fit.posterior.noise.free_run == pytest.approx(SIGMA**2, rel=0.2)
    assert 0.93 < np.mean(noisy) < 0.97
    # The interval of the noise-free output rests on six fits alone: each is wrong as a whole or right as a whole.
    assert 0.8 < np.mean(clean) <= 1.0
