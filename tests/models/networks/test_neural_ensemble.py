"""Neural state spaces side by side: what they compute is the mean of their members, from any start."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sysid.errors import ConfigError, TraceError
from sysid.models import (
    History,
    NeuralEnsemble,
    NeuralStateSpace,
    Scaling,
    VectorNeuralStateSpaceModel,
    VectorScaling,
    model_from_dict,
)
from tests.models.networks.test_neural_state_space import a_model, signals

SHARES = (2, 1, 1)
WITH_ALL = NeuralStateSpace(states=3, neurons=4, output_neurons=2)


def ensemble(network: NeuralStateSpace = WITH_ALL):
    members = [a_model(network, seed) for seed in range(len(SHARES))]
    return replace(members[0], theta=np.concatenate([one.theta for one in members]), shares=SHARES), members


def of_two_outputs(network: NeuralStateSpace):
    whole = network.for_outputs(2)
    like = a_model(network)
    scaling = VectorScaling(
        input_offset=like.scaling.input_offset, input_scale=like.scaling.input_scale,
        output_offset=(30.0, 0.0), output_scale=(31.0, 2.0),
    )  # fmt: skip
    rng = np.random.default_rng(5)
    return VectorNeuralStateSpaceModel(
        network=whole, theta=0.3 * rng.standard_normal(2 * whole.sizes(2, 2).count), scaling=scaling,
        mapping=type(like.mapping)(inputs=("p", "q"), outputs=("y", "z")), sample_time=0.1,
        input_units=like.input_units, output_units=("psi", "psi"), rest_outputs=(0.0, 1.0), shares=(1, 3),
    )  # fmt: skip


def test_its_free_run_is_the_mean_of_its_members_by_their_shares():
    whole, members = ensemble()
    expected = np.average([one.simulate(signals()) for one in members], axis=0, weights=SHARES)
    np.testing.assert_allclose(whole.simulate(signals()), expected, atol=1e-12)


@pytest.mark.parametrize("output", ["plain", "absolute"])
def test_as_one_state_space_it_runs_alike(output):
    for whole in (ensemble(replace(WITH_ALL, output=output))[0], of_two_outputs(replace(WITH_ALL, output=output))):
        form = whole.recursion
        first = np.zeros((1, form.sizes.outputs))
        history = History(inputs=signals()[:1], output=first if form.sizes.outputs > 1 else first[:, 0])
        np.testing.assert_allclose(
            form.joined.simulate(signals(), history), form.simulate(signals(), history), atol=1e-11
        )
        x, y = form.state(history), form.joined.state(history)
        np.testing.assert_allclose(y, x, atol=1e-12)
        scaled = form.scaled(signals())
        np.testing.assert_allclose(form.path(scaled, x), form.joined.path(scaled, y), atol=1e-12)
        np.testing.assert_allclose(x, y, atol=1e-12)


def test_of_an_absolute_value_the_mean_is_taken_before_it():
    """Two members of opposite sign cancel, as no mean of absolute values does."""
    network = NeuralStateSpace(states=3, neurons=2, output="absolute")
    one = a_model(network)
    sizes = network.sizes(2)
    other = one.theta.copy()
    for part in (sizes.output_linear, sizes.output_readout):
        other[part] *= -1.0
    scaling = replace(one.scaling, output_offset=0.0)
    whole = replace(one, theta=np.concatenate([one.theta, other]), shares=(1, 1), scaling=scaling)
    np.testing.assert_allclose(whole.simulate(signals()), 0.0, atol=1e-12)


def test_a_stored_ensemble_is_the_same_model():
    for whole in (ensemble()[0], of_two_outputs(WITH_ALL)):
        again = model_from_dict(json.loads(json.dumps(whole.to_dict())))
        assert again.shares == whole.shares
        assert again.to_dict() == whole.to_dict()
        np.testing.assert_array_equal(again.simulate(signals()), whole.simulate(signals()))
        assert again.label == f"{whole.network.label}, mean of {len(whole.shares)}"
        assert again.n_parameters == len(whole.shares) * again.n_together
    assert a_model(WITH_ALL).label == WITH_ALL.label
    assert "shares" not in a_model(WITH_ALL).to_dict()


@pytest.mark.parametrize("output", ["plain", "absolute"])
def test_each_member_finds_its_state_in_a_history(output):
    whole, _ = ensemble(NeuralStateSpace(states=2, neurons=3, output=output))
    u = signals()
    y = whole.simulate(u)
    rest = whole.simulate(u[80:], History(inputs=u[72:80], output=y[72:80]))
    at_rest = whole.simulate(u[80:])
    assert np.abs(rest - y[80:]).max() < 0.02 * np.abs(at_rest - y[80:]).max()


def test_members_agree_on_a_sign_that_an_output_hides():
    """With no input either sign explains the samples; each member alone takes the one that it expects."""
    network = NeuralStateSpace(states=1, neurons=0, output="absolute")
    #                 A    B    c    C    D    d   E (u, y, 1)
    member = np.array([0.9, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5])
    other = np.array([0.9, 0.1, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -0.5])
    form = NeuralEnsemble(
        sizes=network.sizes(1), theta=np.concatenate([member, other]), scaling=Scaling.identity(1), rectified=True,
        shares=(1, 1),
    )  # fmt: skip
    y = 0.6 * 0.9 ** np.arange(12)
    history = History(inputs=np.zeros((5, 1)), output=y[:5])
    alone = [one.state(history)[0] for one in form.members]
    assert alone[0] * alone[1] < 0.0
    np.testing.assert_allclose(form.simulate(np.zeros((7, 1)), history), y[5:], atol=2e-2)


@pytest.mark.parametrize("shares", [(), (1, 0), (1, 0.5)], ids=str)
def test_shares_that_are_none_are_refused(shares):
    with pytest.raises(ConfigError, match="shares"):
        replace(a_model(WITH_ALL), shares=shares)


def test_parameters_of_too_few_members_are_refused():
    with pytest.raises(TraceError, match="parameter vector"):
        _ = replace(a_model(WITH_ALL), shares=(1, 1)).recursion
