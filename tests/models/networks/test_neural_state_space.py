"""What a neural state space accepts, how it is stored, and how it finds its state in a history."""

import json

import numpy as np
import pytest

from sysid.errors import ConfigError, TraceError
from sysid.kernels.neurons import NEURONS
from sysid.models import (
    History,
    Mapping,
    NeuralForm,
    NeuralStateSpace,
    NeuralStateSpaceModel,
    Scaling,
    model_from_dict,
    structure_from_dict,
)


def a_model(network: NeuralStateSpace, seed: int = 0) -> NeuralStateSpaceModel:
    rng = np.random.default_rng(seed)
    return NeuralStateSpaceModel(
        network=network,
        theta=0.3 * rng.standard_normal(network.sizes(2).count),
        scaling=Scaling(input_offset=(50.0, 80.0), input_scale=(20.0, 10.0), output_offset=30.0, output_scale=31.0),
        mapping=Mapping.parse("p+q -> y"),
        sample_time=0.1,
        input_units=("psi", "psi"),
        output_unit="psi",
        rest_output=0.0,
    )


def signals(n: int = 200) -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.cumsum(rng.standard_normal((n, 2)), axis=0) + np.array([60.0, 80.0])


STRUCTURES = [
    *(
        pytest.param(NeuralStateSpace(states=2, neurons=3, output_neurons=2, activation=kind), id=kind)
        for kind in NEURONS
    ),
    pytest.param(NeuralStateSpace(states=3, neurons=2, output="absolute"), id="absolute"),
]


@pytest.mark.parametrize("network", STRUCTURES)
def test_a_stored_model_is_the_same_model(network):
    model = a_model(network)
    again = model_from_dict(json.loads(json.dumps(model.to_dict())))
    np.testing.assert_array_equal(again.simulate(signals()), model.simulate(signals()))
    assert again.to_dict() == model.to_dict()
    assert structure_from_dict(network.to_dict()) == network


def test_other_weights_are_as_many_as_there_are():
    model, other = (a_model(NeuralStateSpace(states=2, neurons=3), seed) for seed in (0, 1))
    np.testing.assert_array_equal(model.with_theta(other.theta).simulate(signals()), other.simulate(signals()))
    with pytest.raises(ConfigError, match="parameters"):
        model.with_theta(other.theta[:-1])


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"states": 0, "neurons": 3}, "states"),
        ({"states": 2, "neurons": -1}, "neurons"),
        ({"states": 2, "neurons": 2, "output_neurons": 1.5}, "output neurons"),
        ({"states": 2, "neurons": 2, "activation": "relu"}, "activation"),
        ({"states": 2, "neurons": 2, "output": "squared"}, "output"),
    ],
    ids=["no state", "fewer than no neurons", "half a neuron", "unknown activation", "unknown output"],
)
def test_what_cannot_be_used_is_refused(fields, match):
    with pytest.raises(ConfigError, match=match):
        NeuralStateSpace(**fields)


def test_the_state_is_found_again_in_a_history():
    """A run in two pieces continues where the first ended, though the state is handed on as samples only."""
    model = a_model(NeuralStateSpace(states=2, neurons=5))
    u = signals()
    whole = model.simulate(u)
    rest = model.simulate(u[80:], History(inputs=u[:80], output=whole[:80]))
    np.testing.assert_allclose(rest, whole[80:], atol=0.05)
    at_rest = model.simulate(u[80:])
    assert np.abs(rest - whole[80:])[0] < 0.02 * np.abs(at_rest - whole[80:])[0]


def test_a_history_shows_the_sign_that_a_rectified_output_hides():
    """A discharging state that drives change: only the negative one fits the samples after the first."""
    network = NeuralStateSpace(states=1, neurons=0, output="absolute")
    #       A    B    c    C    D    d   E
    theta = [0.9, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5]
    form = NeuralForm(sizes=network.sizes(1), theta=np.array(theta), scaling=Scaling.identity(1), rectified=True)
    u = np.ones((12, 1))
    y = form.run(u, np.array([-0.8]))[:, 0]
    assert form.state(History(inputs=u[:5], output=y[:5]))[0] == pytest.approx(1.0 - 1.8 * 0.9**5, abs=1e-3)


def test_there_is_no_prediction_that_is_not_the_free_run():
    model, u = a_model(NeuralStateSpace(states=2, neurons=4)), signals(50)
    assert not model.recursion.predicts
    with pytest.raises(ConfigError, match="no prediction"):
        model.predict(u, np.ones(len(u)), steps=3)


def test_inputs_that_do_not_fit_are_refused():
    with pytest.raises(TraceError, match="inputs"):
        a_model(NeuralStateSpace(states=2, neurons=4)).simulate(
            np.zeros((5, 3)), History.at_rest(inputs=[0, 0], output=0)
        )
