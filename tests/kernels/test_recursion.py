"""The compiled recursion against finite differences, NumPy and its own formula."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.estimation.experiment import Experiment
from sysid.estimation.networks.provider import BLOCK, RecursionProvider
from sysid.kernels.neurons import NEURONS
from sysid.models import NARX, History, Recursion, Scaling, parameter_count
from sysid.testing import finite_difference_jacobian, simulate


def a_provider(
    network: NARX, *, closed: bool, n: int = 40, seed: int = 0, weights=None, horizon: int | None = None
) -> RecursionProvider:
    rng = np.random.default_rng(seed)
    lags = network.lags(2)
    template = Recursion(
        lags=lags,
        neurons=network.neurons,
        theta=np.zeros(parameter_count(lags, network.neurons, linear=network.feedthrough, gated=network.gated)),
        scaling=Scaling.identity(2),
        low=-3.0,
        high=3.0,
        activation=network.activation,
    )
    experiments = [
        Experiment(
            inputs=rng.uniform(-1.0, 1.0, (length, 2)),
            output=rng.uniform(-1.0, 1.0, length),
            history=History(inputs=rng.uniform(-1, 1, (9, 2)), output=rng.uniform(-1, 1, 9)),
            weights=None if weights is None else rng.choice(weights, length),
        )
        for length in (n, n // 2)
    ]
    return RecursionProvider(template=template, experiments=experiments, closed=closed, horizon=horizon)


def outputs(provider: RecursionProvider, theta: np.ndarray) -> np.ndarray:
    form = provider.at(theta)
    runs = []
    for e in provider.experiments:
        if provider.closed:
            runs.append(form.simulate(e.inputs, e.history))
        else:
            runs.append(form.predict(e.inputs, e.output, e.history, 1))
    return np.concatenate(runs)


STRUCTURES = [
    pytest.param(NARX(input_delays=4, output_delays=4, neurons=5), id="4/4/5"),
    pytest.param(NARX(input_delays="0:1", output_delays=1, neurons=3), id="direct input"),
    pytest.param(NARX(input_delays=[1, 7], output_delays=[2, 5], neurons=4), id="sparse lags"),
    pytest.param(NARX(input_delays=2, output_delays=2, neurons=3, feedthrough=False), id="without feed-through"),
    pytest.param(NARX(input_delays=2, output_delays=3, neurons=0), id="linear"),
    *(
        pytest.param(
            NARX(input_delays="0:1", output_delays=[1, 3], neurons=3, gated=gated, activation=kind),
            id=f"{kind}{' gates' * gated}",
        )
        for kind in NEURONS
        for gated in (False, True)
    ),
]


@pytest.mark.parametrize("closed", [False, True], ids=["open loop", "closed loop"])
@pytest.mark.parametrize("network", STRUCTURES)
def test_sensitivities_equal_finite_differences(network, closed):
    provider = a_provider(network, closed=closed)
    theta = 0.3 * np.random.default_rng(1).standard_normal(len(provider.template.theta))
    expected = finite_difference_jacobian(lambda p: outputs(provider, p), theta)
    assert_allclose(provider.jacobian(theta), expected, atol=1e-6)


@pytest.mark.parametrize("weights", [None, (0.0, 1.0, 2.5)], ids=["plain", "weighted and masked"])
@pytest.mark.parametrize("closed", [False, True], ids=["open loop", "closed loop"])
def test_normal_equations_equal_the_dense_ones(closed, weights):
    provider = a_provider(NARX(input_delays=2, output_delays=2, neurons=4), closed=closed, weights=weights)
    theta = 0.3 * np.random.default_rng(2).standard_normal(len(provider.template.theta))
    at = provider.linearise(theta)
    J, W = (
        provider.jacobian(theta),
        np.concatenate([np.ones(len(e.output)) if e.weights is None else e.weights for e in provider.experiments]),
    )
    residual = outputs(provider, theta) - np.concatenate([e.output for e in provider.experiments])
    assert_allclose(at.loss, 0.5 * np.sum(W * residual**2), rtol=1e-12)
    assert_allclose(at.gradient, J.T @ (W * residual), rtol=1e-9, atol=1e-12)
    assert_allclose(at.gauss_newton, J.T @ (W[:, None] * J), rtol=1e-9, atol=1e-12)
    assert_allclose(provider.loss(theta), at.loss, rtol=1e-12)


def windows(provider: RecursionProvider, theta: np.ndarray) -> np.ndarray:
    """The slow twin of a horizon: each window is a record of its own that begins from what was measured."""
    form, k = provider.at(theta), provider.horizon
    runs = []
    for e in provider.experiments:
        past_u, past_y = np.concatenate([e.history.inputs, e.inputs]), np.concatenate([e.history.output, e.output])
        n = len(e.history.output)
        for first in range(0, len(e.output), k):
            history = History(inputs=past_u[: n + first], output=past_y[: n + first])
            runs.append(simulate(form, e.inputs[first : first + k], history))
    return np.concatenate(runs)


@pytest.mark.parametrize("horizon", [1, 5, 99])
@pytest.mark.parametrize("network", STRUCTURES)
def test_a_horizon_is_a_free_run_that_begins_anew(network, horizon):
    provider = a_provider(network, closed=True, n=16, horizon=horizon)
    theta = 0.3 * np.random.default_rng(3).standard_normal(len(provider.template.theta))
    target = np.concatenate([e.output for e in provider.experiments])
    assert provider.loss(theta) == pytest.approx(0.5 * np.sum((windows(provider, theta) - target) ** 2), rel=1e-10)
    dense = finite_difference_jacobian(lambda p: windows(provider, p), theta)
    assert_allclose(provider.jacobian(theta), dense, atol=1e-7)


def test_a_horizon_of_one_is_the_open_loop_and_a_long_one_the_closed_loop():
    network = NARX(input_delays=4, output_delays=4, neurons=5)
    theta = 0.3 * np.random.default_rng(3).standard_normal(len(a_provider(network, closed=True).template.theta))
    for horizon, closed in ((1, False), (1000, True)):
        by_horizon = a_provider(network, closed=True, horizon=horizon).linearise(theta)
        plain = a_provider(network, closed=closed).linearise(theta)
        np.testing.assert_array_equal(by_horizon.gauss_newton, plain.gauss_newton)
        assert by_horizon.loss == plain.loss


def test_windows_join_across_blocks():
    network = NARX(input_delays=2, output_delays=2, neurons=3)
    provider = a_provider(network, closed=True, n=2 * BLOCK + 100, horizon=BLOCK - 5)
    theta = 0.3 * np.random.default_rng(3).standard_normal(len(provider.template.theta))
    first = provider.experiments[0]
    late = slice(2 * (BLOCK - 5), 2 * (BLOCK - 5) + 30)  # a window that begins shortly before a block ends
    history = History(inputs=first.inputs[: late.start], output=first.output[: late.start])

    def run(p):
        return provider.at(p).simulate(first.inputs[late], history)

    assert_allclose(provider.jacobian(theta)[late], finite_difference_jacobian(run, theta), atol=1e-7)


def test_blocks_join_without_a_seam():
    network = NARX(input_delays=2, output_delays=[1, 3], neurons=3)
    long = a_provider(network, closed=True, n=2 * BLOCK + 57)
    theta = 0.2 * np.random.default_rng(3).standard_normal(len(long.template.theta))
    J = long.jacobian(theta)
    # Directional derivative over the whole record, blocks and all.
    direction = np.random.default_rng(4).standard_normal(len(theta))
    width = 1e-6
    expected = (outputs(long, theta + width * direction) - outputs(long, theta - width * direction)) / (2 * width)
    assert_allclose(J @ direction, expected, atol=1e-5)


def test_a_clipped_output_has_no_sensitivity():
    provider = a_provider(NARX(input_delays=1, output_delays=1, neurons=2), closed=True)
    theta = np.zeros(len(provider.template.theta))
    constant = provider.template.neurons * (provider.template.lags.n_regressors + 2)
    theta[constant] = 10.0
    assert np.all(outputs(provider, theta) == 3.0)
    assert not provider.jacobian(theta).any()


def test_a_loss_that_is_not_a_number_is_infinite():
    provider = a_provider(NARX(input_delays=1, output_delays=1, neurons=2), closed=True)
    assert provider.loss(np.full(len(provider.template.theta), np.nan)) == np.inf
