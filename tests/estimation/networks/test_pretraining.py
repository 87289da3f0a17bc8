"""The pretraining: one step ahead on samples that fill the space, before the free run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import sysid
from sysid.estimation import Training, fit_narx
from sysid.estimation.networks.basis import RegressorBasis
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.pretraining import SHARPEST, SMOOTHEST, StepSamples, space_filling
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.records.experiment import Experiment
from sysid.kernels.neurons import NEURONS
from sysid.models import NARX, History, Mapping, NARXModel, Scaling
from sysid.testing import finite_difference_jacobian
from tests.traces.made import trace_of

NETWORK = NARX(input_delays=[0, 2], output_delays=[1, 2], neurons=4)
GATED = replace(NETWORK, gated=True)
LAYOUT = Layout.of(NETWORK, 1)


def model(network: NARX = NETWORK) -> NARXModel:
    return NARXModel(
        network=network,
        theta=0.3 * np.random.default_rng(1).standard_normal(Layout.of(network, 1).n_parameters),
        scaling=Scaling(input_offset=(1.0,), input_scale=(2.0,), output_offset=0.5, output_scale=3.0),
        mapping=Mapping.parse("u -> y"),
        sample_time=1.0,
        input_units=("V",),
        output_unit="V",
        rest_output=0.0,
    )


def experiment(n: int = 80, seed: int = 0, weights: np.ndarray | None = None) -> Experiment:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 3.0, (n // 8 + 1, 1)), 8, axis=0)[:n]
    return Experiment(
        inputs=u, output=rng.standard_normal(n), history=History.at_rest(inputs=u[0], output=0.0), weights=weights
    )


def all_samples(basis: RegressorBasis, *records: Experiment, network: NARX = NETWORK) -> StepSamples:
    return StepSamples.of(model(network), records, Layout.of(network, 1), basis, samples=10_000, seed=0)


@pytest.mark.parametrize("kind", NEURONS)
@pytest.mark.parametrize("gated", [False, True], ids=["plain", "gates"])
def test_on_all_samples_it_is_the_open_loop(gated: bool, kind: str):
    network = replace(NETWORK, gated=gated, activation=kind)
    layout = Layout.of(network, 1)
    records = (experiment(), experiment(50, 1))
    basis = RegressorBasis.incremental(LAYOUT.lags, np.random.default_rng(0).standard_normal((50, 4)))
    theta = 0.3 * np.random.default_rng(2).standard_normal(layout.n_parameters)
    one = all_samples(basis, *records, network=network)
    # Without bounds, as the pretraining has none: what is far off has to be seen to be mended.
    template = replace(model(network).recursion, low=-np.inf, high=np.inf)
    other = RecursionProvider(template=template, experiments=records, closed=False)
    P = basis.to_plain(layout)
    found, expected = one.linearise(theta), other.linearise(P @ theta)
    assert one.n_samples == other.n_samples == 130
    assert_allclose(found.loss, expected.loss, rtol=1e-10)
    assert_allclose(one.loss(theta), expected.loss, rtol=1e-10)
    assert_allclose(found.gradient, P.T @ expected.gradient, rtol=1e-8, atol=1e-10)
    assert_allclose(found.gauss_newton, P.T @ expected.gauss_newton @ P, rtol=1e-8, atol=1e-10)


def test_its_gradient_is_that_of_its_loss():
    one = all_samples(RegressorBasis.identity(LAYOUT.lags), experiment())
    theta = 0.5 * np.random.default_rng(3).standard_normal(LAYOUT.n_parameters)
    expected = finite_difference_jacobian(lambda at: np.array([one.loss(at)]), theta)[0]
    assert_allclose(one.linearise(theta).gradient, expected, rtol=1e-5, atol=1e-5)


def test_samples_that_do_not_count_are_never_chosen():
    weights = np.ones(80)
    weights[20:60] = 0.0
    one = all_samples(RegressorBasis.identity(LAYOUT.lags), experiment(weights=weights))
    assert one.n_samples == 40


def test_rare_samples_are_chosen_more_often_than_common_ones():
    x = np.zeros((10_000, 2))
    x[:200] = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 2))
    chosen = space_filling(x, 400, np.random.default_rng(1))
    assert len(np.unique(chosen)) == 400
    assert np.count_nonzero(chosen < 200) > 100, "2 % of the samples, and more than a quarter of the choice"


def test_small_rates_of_either_sign_are_told_apart():
    x = np.zeros((10_000, 1))
    x[:, 0] = 5e-3
    x[:50, 0], x[50:100, 0] = -5e-3, 0.3
    chosen = space_filling(x, 200, np.random.default_rng(1))
    # Each rare cell of 50 weighs the root of 50 beside the root of 9900: 12 of 200 expected, one if they were not told
    # apart from the rest.
    assert np.count_nonzero(chosen < 50) >= 6


def test_few_samples_are_all_taken():
    assert_array_equal(space_filling(np.zeros((5, 1)), 9, np.random.default_rng(0)), np.arange(5))


def test_a_start_has_neurons_of_every_sharpness_that_switch_where_samples_are():
    network = NARX(input_delays=[0, 2], output_delays=[1, 2], neurons=200)
    layout = Layout.of(network, 1)
    x = np.random.default_rng(0).uniform(-1, 1, (50, 4))
    one = StepSamples(layout=layout, regressors=x, target=np.zeros(50), neuron=NEURONS["tanh"])
    theta = one.draw(np.random.default_rng(1), layout.centre())
    weights, biases = theta[:800].reshape(200, 4), theta[800:1000]
    lengths = np.linalg.norm(weights, axis=1)
    assert SMOOTHEST <= lengths.min() < 1.0
    assert SHARPEST / 2 < lengths.max() <= SHARPEST
    nearest = np.abs(one.regressors @ weights.T + biases).min(axis=0)
    assert_allclose(nearest, 0.0, atol=1e-9)


def test_a_valve_that_switches_is_learnt_with_it_in_iterations_in_which_it_is_not_without():
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 120), 25)
    y = np.zeros(len(u))
    for t in range(1, len(u)):  # fills fast through an open valve, empties slowly through a choke
        flow = 0.2 * (u[t] - y[t - 1])
        y[t] = y[t - 1] + (flow if flow > 0.0 else 0.1 * flow)
    trace = trace_of({"u": u, "y": y}, name="valve", units="bar")
    network = NARX(input_delays="0:1", output_delays=1, neurons=8)
    common = {"max_iterations": 15, "starts": 1, "seed": 3}
    mse = {}
    for name, options in {"with": {"pretraining": 800, "pretraining_iterations": 60}, "without": {}}.items():
        fit = fit_narx([trace], Mapping.parse("u -> y"), network, Training(**common, **options), rest_output=0.0)
        mse[name] = np.mean((fit.model.simulate(u[:, None]) - y) ** 2)
    assert mse["with"] < 3e-5
    assert mse["with"] < 0.3 * mse["without"]


@pytest.mark.parametrize("stride", [2, 7])
def test_with_a_stride_the_loss_is_that_of_every_so_manieth_sample(stride):
    weights = np.random.default_rng(4).uniform(0.5, 2.0, 2500)
    weights[::3] = 0.0
    records = (experiment(2500, weights=weights), experiment(1300, 1))
    whole = RecursionProvider(template=model().recursion, experiments=records, closed=True)
    some = replace(whole, stride=stride)
    theta = model().theta
    J = whole.jacobian(theta)
    rows = np.concatenate([np.arange(0, 2500, stride), 2500 + np.arange(0, 1300, stride)])
    w = np.concatenate([weights, np.ones(1300)])[rows]
    runs = [(model().simulate(one.inputs, one.history), one.output) for one in records]
    residual = np.concatenate([np.subtract(*map(model().scaling.scale_output, both)) for both in runs])[rows]
    found = some.linearise(theta)
    assert some.n_samples == np.count_nonzero(w)
    assert_allclose(found.loss, 0.5 * np.sum(w * residual**2), rtol=1e-10)
    assert_allclose(some.loss(theta), found.loss, rtol=1e-10)
    assert_allclose(found.gradient, J[rows].T @ (w * residual), rtol=1e-7, atol=1e-9)
    assert_allclose(found.gauss_newton, (J[rows] * w[:, None]).T @ J[rows], rtol=1e-7, atol=1e-9)


def test_a_record_that_stands_at_its_limits_throughout_is_fitted_without_it():
    """A truth value: no sample says what a step does, and a start was drawn among none."""
    u = np.repeat([0.0, *np.random.default_rng(0).integers(0, 2, 15)], 5)
    trace = sysid.data({"u": u, "y": u}, inputs="u", outputs="y", sample_time=1.0).traces[0]
    network = NARX(input_delays="0:1", output_delays=1, neurons=2, limits=[0.0, 1.0])
    how = Training(max_iterations=10, starts=2, pretraining=50, pretraining_iterations=5)
    fit = fit_narx([trace], Mapping.parse("u -> y"), network, how, rest_output=0.0)
    assert_allclose(fit.model.simulate(u[:, np.newaxis], History.at_rest(inputs=u[:1], output=0.0)), u, atol=0.01)
