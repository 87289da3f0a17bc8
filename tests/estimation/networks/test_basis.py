"""A basis changes which networks are simple, not which there are."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.networks.basis import RebasedProvider, RegressorBasis
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.records.experiment import Experiment
from sysid.models import History, Lags, Recursion, Scaling
from sysid.testing import finite_difference_jacobian

LAGS = Lags(inputs=((0, 1, 4), (0, 2)), output=(1, 2))


def records(n: int = 300, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.standard_normal((n, LAGS.n_regressors)), axis=0)


def test_every_feature_peaks_at_one():
    X = records()
    basis = RegressorBasis.incremental(LAGS, X)
    features = (X - basis.centre) @ basis.matrix.T
    inputs = features[:, : len(LAGS.input_lag)]
    assert_allclose(np.abs(inputs).max(axis=0), 1.0)


def test_rates_are_divided_differences_of_neighbouring_lags():
    basis = RegressorBasis.incremental(LAGS, records())
    row = basis.matrix[2] / basis.matrix[2, 1]
    assert_allclose(row, [0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0])


def test_levels_of_the_inputs_are_uncorrelated():
    X = records()
    basis = RegressorBasis.incremental(LAGS, X)
    features = (X - basis.centre) @ basis.matrix.T
    assert abs(np.corrcoef(features[:, 0], features[:, 3])[0, 1]) < 1e-10


def test_a_constant_regressor_is_not_blown_up():
    X = records()
    X[:, 4] = 3.0
    X[:, 3] = 3.0
    basis = RegressorBasis.incremental(LAGS, X)
    assert np.abs(basis.matrix).max() < 1e3


@pytest.mark.parametrize(("neurons", "gated"), [(0, False), (3, False), (3, True)], ids=["linear", "tanh", "gates"])
def test_a_network_in_the_basis_is_the_network_over_plain_regressors(neurons, gated):
    X = records()
    basis = RegressorBasis.incremental(LAGS, X)
    layout = Layout(inputs=LAGS.inputs, outputs=(LAGS.output,), neurons=neurons, linear=True, gated=gated)
    theta = np.random.default_rng(1).standard_normal(layout.n_parameters)
    plain = basis.to_plain(layout) @ theta

    def output(parameters: np.ndarray, x: np.ndarray) -> np.ndarray:
        form = Recursion(lags=LAGS, neurons=neurons, theta=parameters, scaling=Scaling.identity(2))
        hidden = np.tanh(x @ form.hidden_weights.T + form.hidden_bias)
        gains = form.readout if form.gates is None else form.readout + x @ form.gates.T
        return x @ form.linear + form.constant + np.sum(hidden * gains, axis=1)

    assert_allclose(output(plain, X), output(theta, (X - basis.centre) @ basis.matrix.T), atol=1e-9)


def test_the_gradient_in_the_basis_is_the_gradient():
    rng = np.random.default_rng(2)
    layout = Layout(inputs=LAGS.inputs, outputs=(LAGS.output,), neurons=2, linear=True)
    template = Recursion(lags=LAGS, neurons=2, theta=layout.centre(), scaling=Scaling.identity(2), low=-3.0, high=3.0)
    experiment = Experiment(
        inputs=rng.uniform(-1, 1, (50, 2)),
        output=rng.uniform(-1, 1, 50),
        history=History.at_rest(inputs=[0.0, 0.0], output=0.0),
    )
    inner = RecursionProvider(template=template, experiments=(experiment,), closed=True)
    provider = RebasedProvider(inner=inner, to_plain=RegressorBasis.incremental(LAGS, records()).to_plain(layout))
    theta = 0.1 * rng.standard_normal(layout.affine.stop)
    expected = finite_difference_jacobian(lambda p: np.array([provider.loss(p)]), theta)
    assert_allclose(provider.linearise(theta).gradient, expected[0], rtol=1e-4, atol=1e-6)


def test_the_centre_of_the_prior_holds_the_last_output():
    layout = Layout(inputs=LAGS.inputs, outputs=(LAGS.output,), neurons=2, linear=True)
    form = Recursion(lags=LAGS, neurons=2, theta=layout.centre(), scaling=Scaling.identity(2))
    output = form.simulate(np.random.default_rng(0).uniform(-1, 1, (20, 2)), History.at_rest(inputs=[0, 0], output=0.7))
    assert_allclose(output, 0.7)


def test_correlation_time_of_a_first_order_process():
    # An AR(1) process with coefficient a has an integrated autocorrelation time of (1 + a) / (1 - a).
    rng = np.random.default_rng(0)
    a, x = 0.9, np.zeros(50_000)
    for t in range(1, len(x)):
        x[t] = a * x[t - 1] + rng.standard_normal()
    assert correlation_time(x) == pytest.approx(19.0, rel=0.2)


@pytest.mark.parametrize("residual", [np.zeros(10), np.full(10, np.nan)], ids=["exact", "not a number"])
def test_correlation_time_of_what_has_none(residual):
    assert correlation_time(residual) == 1.0


def test_a_single_row_has_a_basis_without_directions() -> None:
    lags = Lags(inputs=((0, 1), (0, 1)), output=(1, 2))
    basis = RegressorBasis.incremental(lags, np.ones((1, lags.n_regressors)))
    assert np.isfinite(basis.matrix).all()
