"""The compiled neural state space against its formula in NumPy and finite differences."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.networks.program_provider import BLOCK
from sysid.estimation.records.experiment import Experiment
from sysid.kernels.neurons import NEURONS
from sysid.models import History, NeuralForm, NeuralStateSpace, Scaling, VectorNeuralStateSpace, VectorScaling
from sysid.testing import finite_difference_jacobian, run_neural

STRUCTURES = [
    *(pytest.param(NeuralStateSpace(states=2, neurons=5, activation=kind), id=kind) for kind in NEURONS),
    pytest.param(NeuralStateSpace(states=3, neurons=4, output_neurons=2), id="neurons in the output"),
    pytest.param(NeuralStateSpace(states=2, neurons=3, output_neurons=2, output="absolute"), id="absolute output"),
    pytest.param(NeuralStateSpace(states=1, neurons=0), id="linear"),
    pytest.param(VectorNeuralStateSpace(states=3, neurons=4), id="three outputs"),
    pytest.param(
        VectorNeuralStateSpace(states=2, neurons=3, output_neurons=4, output="absolute"),
        id="three absolute outputs with neurons",
    ),
]


def a_form(network: NeuralStateSpace, *, seed: int = 0, size: float = 0.3, **bounds: float) -> NeuralForm:
    n_outputs = 3 if network.several_outputs else 1
    sizes = network.sizes(2, n_outputs)
    return NeuralForm(
        sizes=sizes,
        theta=size * np.random.default_rng(seed).standard_normal(sizes.count),
        scaling=VectorScaling.of([Scaling.identity(2)] * n_outputs) if n_outputs > 1 else Scaling.identity(2),
        activation=network.activation,
        rectified=network.output == "absolute",
        **bounds,
    )


def a_provider(form: NeuralForm, *, n: int = 40, weights=None, of_outputs=None) -> NeuralProvider:
    rng = np.random.default_rng(1)

    def output(length: int) -> np.ndarray:
        return rng.uniform(-1.0, 1.0, (length, form.sizes.outputs) if form.sizes.outputs > 1 else length)

    return NeuralProvider(
        template=form,
        experiments=[
            Experiment(
                inputs=rng.uniform(-1.0, 1.0, (length, 2)),
                output=output(length),
                history=History(inputs=rng.uniform(-1, 1, (past, 2)), output=output(past)),
                weights=None if weights is None else rng.choice(weights, length),
                past=np.ones(past, dtype=np.bool_),
            )
            for length, past in ((n, 9), (n // 2, 1), (n // 2, 4))
        ],
        output_weights=of_outputs,
    )


def all_weights(experiment: Experiment) -> np.ndarray:
    """One for each sample of a history that a run passes through, then the record's own."""
    n_past, n = len(experiment.history.output), len(experiment.output)
    return np.concatenate(
        [np.ones(n_past if n_past > 1 else 0), np.ones(n) if experiment.weights is None else experiment.weights]
    )


def parameters(provider: NeuralProvider, size: float = 0.3) -> np.ndarray:
    return size * np.random.default_rng(2).standard_normal(provider.n_parameters)


@pytest.mark.parametrize("network", STRUCTURES)
def test_free_run_equals_the_formula(network):
    form = a_form(network)
    rng = np.random.default_rng(3)
    u, x = rng.uniform(-1, 1, (60, 2)), rng.uniform(-1, 1, network.states)
    assert_allclose(form.run(u, x.copy()), run_neural(form, u, x), rtol=1e-11, atol=1e-12)


def test_bounds_of_state_and_output_hold():
    form = a_form(NeuralStateSpace(states=2, neurons=4), size=3.0, bound=0.7, low=-0.9, high=1.1)
    rng = np.random.default_rng(3)
    u, x = rng.uniform(-1, 1, (60, 2)), rng.uniform(-0.5, 0.5, 2)
    run = form.run(u, x.copy())
    assert (run.min(), run.max()) == (-0.9, 1.1)
    assert_allclose(run, run_neural(form, u, x), rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("network", STRUCTURES)
def test_sensitivities_equal_finite_differences(network):
    provider = a_provider(a_form(network))
    theta = parameters(provider)
    expected = finite_difference_jacobian(lambda p: provider.outputs(p).ravel(), theta)
    assert np.abs(expected).max() > 0.1
    assert_allclose(provider.jacobian(theta), expected, atol=1e-7)


def test_sensitivities_hold_where_state_and_output_are_clipped():
    provider = a_provider(a_form(NeuralStateSpace(states=2, neurons=4), bound=0.4, low=-0.5, high=0.5))
    theta = parameters(provider, 0.8)
    inside = np.abs(provider.outputs(theta)) < 0.5
    assert 0.1 < inside.mean() < 0.9
    expected = finite_difference_jacobian(lambda p: provider.outputs(p).ravel(), theta)
    assert_allclose(provider.jacobian(theta), expected, atol=1e-6)


@pytest.mark.parametrize("weights", [None, (0.0, 1.0, 2.5)], ids=["plain", "weighted and masked"])
@pytest.mark.parametrize(
    ("network", "of_outputs"),
    [
        (NeuralStateSpace(states=2, neurons=3), None),
        (VectorNeuralStateSpace(states=2, neurons=3), None),
        (VectorNeuralStateSpace(states=2, neurons=3), (4.0, 1.0, 0.25)),
    ],
    ids=["one output", "three outputs", "three outputs of unlike noise"],
)
def test_normal_equations_equal_the_dense_ones(network, of_outputs, weights):
    provider = a_provider(a_form(network), weights=weights, of_outputs=of_outputs)
    theta = parameters(provider)
    J, at = provider.jacobian(theta), provider.linearise(theta)
    e = (provider.outputs(theta) - np.concatenate([y for _, y in provider.signals])).ravel()
    w = np.concatenate([all_weights(experiment) for experiment in provider.experiments])
    w = np.outer(w, np.ones(provider.template.sizes.outputs) if of_outputs is None else of_outputs).ravel()
    assert_allclose(at.loss, 0.5 * np.sum(w * e**2))
    assert_allclose(provider.loss(theta), at.loss)
    assert_allclose(at.gradient, J.T @ (w * e), atol=1e-10)
    assert_allclose(at.gauss_newton, J.T @ (w[:, None] * J), atol=1e-10)
    assert provider.n_samples == np.count_nonzero(w)


def test_blocks_join_without_a_seam():
    form = a_form(NeuralStateSpace(states=2, neurons=3))
    provider = a_provider(form, n=BLOCK + 60)
    theta = parameters(provider)
    seam = slice(BLOCK - 3, BLOCK + 3)
    few = finite_difference_jacobian(lambda p: provider.outputs(p)[seam].ravel(), theta)
    assert_allclose(provider.jacobian(theta)[seam], few, atol=1e-7)


def test_a_diverging_run_has_an_infinite_loss():
    provider = a_provider(a_form(NeuralStateSpace(states=1, neurons=0), bound=np.inf), n=2000)
    theta = np.full(provider.n_parameters, 3.0)
    with np.errstate(over="ignore", invalid="ignore"):
        assert provider.loss(theta) == np.inf
