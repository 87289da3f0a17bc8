"""The compiled pass of one network against finite differences, NumPy and its own formula."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.estimation.networks.program_provider import BLOCK
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.records.experiment import Experiment
from sysid.kernels.neurons import NEURONS
from sysid.models import NARX, History, Recursion, Scaling, parameter_count
from sysid.testing import finite_difference_jacobian, simulate


def a_provider(network: NARX, *, closed: bool, n: int = 40, seed: int = 0, weights=None) -> RecursionProvider:
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
    return RecursionProvider(template=template, experiments=experiments, closed=closed)


def outputs(provider: RecursionProvider, theta: np.ndarray) -> np.ndarray:
    form = replace(provider.template, theta=theta)
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


@pytest.mark.parametrize("network", STRUCTURES)
def test_the_free_run_and_the_prediction_are_those_of_the_slow_twin(network):
    provider = a_provider(network, closed=True, n=16)
    theta = 0.3 * np.random.default_rng(1).standard_normal(len(provider.template.theta))
    form = replace(provider.template, theta=theta)
    e = provider.experiments[0]
    assert_allclose(form.simulate(e.inputs, e.history), simulate(form, e.inputs, e.history), rtol=0.0, atol=1e-13)
    u, y = np.concatenate([e.history.inputs, e.inputs]), np.concatenate([e.history.output, e.output])
    for steps in (1, 3, 40):  # the last more than there are samples
        expected = []
        for t in range(len(e.output)):
            first = max(0, t + 1 - steps)
            before = len(e.history.output) + first
            history = History(inputs=u[:before], output=y[:before])
            expected.append(simulate(form, e.inputs[first : t + 1], history)[-1])
        found = form.predict(e.inputs, e.output, e.history, steps)
        assert_allclose(found, expected, rtol=0.0, atol=1e-13)


def test_models_of_one_structure_share_a_plan_and_not_their_parameters():
    provider = a_provider(NARX(input_delays=3, output_delays=2, neurons=4), closed=True)
    e, rng = provider.experiments[0], np.random.default_rng(5)
    for theta in 0.3 * rng.standard_normal((3, len(provider.template.theta))):
        form = replace(provider.template, theta=theta)
        assert_allclose(form.simulate(e.inputs, e.history), simulate(form, e.inputs, e.history), rtol=0.0, atol=1e-13)


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
