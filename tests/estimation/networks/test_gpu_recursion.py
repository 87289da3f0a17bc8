"""The batched twin in torch against the compiled kernels, candidate by candidate."""

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from sysid.errors import ConfigError
from sysid.estimation.networks.gpu_recursion import ROWS, BatchedRecursion, device_named
from sysid.estimation.networks.provider import Experiment, RecursionProvider
from sysid.models import NARX, History, Recursion, Scaling, parameter_count

STRUCTURES = [
    pytest.param(NARX(input_delays=3, output_delays=2, neurons=4), id="3/2/4"),
    pytest.param(NARX(input_delays="0:1", output_delays=1, neurons=3), id="direct input"),
    pytest.param(NARX(input_delays=[1, 7], output_delays=[2, 5], neurons=3), id="sparse lags"),
    pytest.param(NARX(input_delays=2, output_delays=2, neurons=3, feedthrough=False), id="without feed-through"),
    pytest.param(NARX(input_delays=2, output_delays=3, neurons=0), id="linear"),
    pytest.param(NARX(input_delays="0:1", output_delays=[1, 3], neurons=3, gated=True), id="gates"),
]
RECORDS = (ROWS + 30, 40)


def a_provider(network: NARX, *, closed: bool = True, bound: float = 3.0, weights=None) -> RecursionProvider:
    rng = np.random.default_rng(0)
    lags = network.lags(2)
    template = Recursion(
        lags=lags,
        neurons=network.neurons,
        theta=np.zeros(parameter_count(lags, network.neurons, linear=network.feedthrough, gated=network.gated)),
        scaling=Scaling.identity(2),
        low=-bound,
        high=bound,
    )
    experiments = [
        Experiment(
            inputs=rng.uniform(-1.0, 1.0, (n, 2)),
            output=rng.uniform(-1.0, 1.0, n),
            history=History(inputs=rng.uniform(-1, 1, (9, 2)), output=rng.uniform(-1, 1, 9)),
            weights=None if weights is None else rng.choice(weights, n),
        )
        for n in RECORDS
    ]
    return RecursionProvider(template=template, experiments=experiments, closed=closed)


def candidates(provider: RecursionProvider, n: int = 5) -> np.ndarray:
    return 0.25 * np.random.default_rng(1).standard_normal((n, len(provider.template.theta)))


TOLERANCES = [pytest.param("float64", 1e-10, id="double"), pytest.param("float32", 2e-4, id="single")]


@pytest.mark.parametrize(("precision", "tolerance"), TOLERANCES)
@pytest.mark.parametrize("network", STRUCTURES)
def test_every_candidate_is_linearised_as_by_the_kernels(network, precision, tolerance):
    provider = a_provider(network)
    thetas = candidates(provider)
    found = BatchedRecursion(provider, device="cpu", precision=precision).linearise(thetas)
    for theta, loss, gradient, matrix in zip(thetas, found.loss, found.gradient, found.gauss_newton, strict=True):
        at = provider.linearise(theta)
        assert_allclose(loss, at.loss, rtol=tolerance)
        assert_allclose(gradient, at.gradient, atol=tolerance * np.abs(at.gradient).max())
        assert_allclose(matrix, at.gauss_newton, atol=tolerance * np.abs(at.gauss_newton).max())


@pytest.mark.parametrize(("precision", "tolerance"), TOLERANCES)
def test_free_runs_and_losses_are_the_kernels(precision, tolerance):
    provider = a_provider(NARX(input_delays=3, output_delays=2, neurons=4))
    thetas = candidates(provider)
    batched = BatchedRecursion(provider, device="cpu", precision=precision)
    runs, losses = batched.simulate(thetas), batched.loss(thetas)
    assert [run.shape for run in runs] == [(len(thetas), n) for n in RECORDS]
    for i, theta in enumerate(thetas):
        form = provider.at(theta)
        for run, experiment in zip(runs, provider.experiments, strict=True):
            assert_allclose(run[i], form.simulate(experiment.inputs, experiment.history), atol=tolerance)
        assert_allclose(losses[i], provider.loss(theta), rtol=tolerance)


def test_clipped_outputs_and_weights_are_the_kernels():
    provider = a_provider(NARX(input_delays=3, output_delays=2, neurons=4), bound=0.3, weights=(0.0, 1.0, 2.5))
    thetas = candidates(provider)
    batched = BatchedRecursion(provider, device="cpu")
    clipped = np.abs(batched.simulate(thetas)[0]) == 0.3
    assert 0.02 < clipped.mean() < 0.9
    found = batched.linearise(thetas)
    for i, theta in enumerate(thetas):
        at = provider.linearise(theta)
        assert_allclose(found.loss[i], at.loss)
        assert_allclose(found.gradient[i], at.gradient, atol=1e-9)
        assert_allclose(found.gauss_newton[i], at.gauss_newton, atol=1e-9)


def test_a_candidate_that_is_lost_does_not_touch_the_others():
    provider = a_provider(NARX(input_delays=1, output_delays=1, neurons=2), bound=np.inf)
    thetas = candidates(provider, 3)
    thetas[1] *= 1e150
    losses = BatchedRecursion(provider, device="cpu").loss(thetas)
    assert losses[1] == np.inf
    assert_allclose(losses[[0, 2]], [provider.loss(theta) for theta in thetas[[0, 2]]])


def test_a_device_is_used_only_where_there_is_one(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert device_named("auto") == "cpu"
    with pytest.raises(ConfigError, match="no graphics processor"):
        device_named("cuda")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert [device_named(name) for name in ("auto", "cpu", "cuda")] == ["cuda", "cpu", "cuda"]


@pytest.mark.parametrize(
    ("settings", "match"),
    [({"device": "tpu"}, "unknown device"), ({"precision": "float16"}, "unknown precision")],
    ids=["device", "precision"],
)
def test_what_cannot_be_had_is_refused(settings, match):
    with pytest.raises(ConfigError, match=match):
        BatchedRecursion(a_provider(NARX(input_delays=1, output_delays=1, neurons=1)), **settings)


def test_an_open_loop_is_refused():
    with pytest.raises(ConfigError, match="free run"):
        BatchedRecursion(a_provider(NARX(input_delays=1, output_delays=1, neurons=1), closed=False))


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no graphics processor on this machine")
def test_the_graphics_processor_computes_the_same():
    provider = a_provider(NARX(input_delays=3, output_delays=2, neurons=4))
    thetas = candidates(provider)
    found = BatchedRecursion(provider, device="cuda").linearise(thetas)
    expected = BatchedRecursion(provider, device="cpu").linearise(thetas)
    assert_allclose(found.gauss_newton, expected.gauss_newton, rtol=1e-8, atol=1e-8)
