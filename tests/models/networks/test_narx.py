"""What a NARX structure accepts, and what its model does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError, TraceError
from sysid.models import NARX, History, Mapping, NARXModel, Scaling, model_from_dict, parameter_count
from sysid.testing import simulate


def a_model(network: NARX, n_inputs: int = 2, seed: int = 0, clamp: float = 3.0) -> NARXModel:
    rng = np.random.default_rng(seed)
    lags = network.lags(n_inputs)
    return NARXModel(
        network=network,
        theta=0.3 * rng.standard_normal(parameter_count(lags, network.neurons, linear=network.feedthrough)),
        scaling=Scaling(
            input_offset=(50.0, 80.0)[:n_inputs],
            input_scale=(20.0, 10.0)[:n_inputs],
            output_offset=30.0,
            output_scale=31.0,
        ),
        mapping=Mapping(inputs=("p", "q")[:n_inputs], output="y"),
        sample_time=0.1,
        input_units=("psi", "psi")[:n_inputs],
        output_unit="psi",
        rest_output=0.0,
        clamp=clamp,
    )


STRUCTURES = [
    pytest.param(NARX(input_delays=4, output_delays=4, neurons=20), id="ranges"),
    pytest.param(NARX(input_delays="0:3", output_delays=1, neurons=5), id="direct input"),
    pytest.param(NARX(input_delays=[1, 2, 4, 8], output_delays=[1, 4], neurons=3), id="sparse lags"),
    pytest.param(NARX(input_delays=[[0, 1], [2]], output_delays=2, neurons=4), id="a set per input"),
    pytest.param(NARX(input_delays=2, output_delays=2, neurons=6, feedthrough=False), id="without feed-through"),
    pytest.param(NARX(input_delays=2, output_delays=2, neurons=0), id="linear"),
    pytest.param(NARX(input_delays="0:3", output_delays=[], neurons=4), id="inputs alone"),
    pytest.param(NARX(input_delays=[0], output_delays=[], neurons=4), id="no memory"),
]


def signals(n: int = 200, seed: int = 1) -> tuple[np.ndarray, np.ndarray, History]:
    rng = np.random.default_rng(seed)
    inputs = np.cumsum(rng.standard_normal((n, 2)), axis=0) + np.array([60.0, 80.0])
    history = History(inputs=rng.uniform(40.0, 90.0, (9, 2)), output=rng.uniform(0.0, 60.0, 9))
    return inputs, rng.uniform(0.0, 60.0, n), history


@pytest.mark.parametrize("network", STRUCTURES)
def test_free_run_equals_the_formula(network):
    model = a_model(network)
    inputs, _, history = signals()
    np.testing.assert_allclose(
        model.simulate(inputs, history), simulate(model.recursion, inputs, history), rtol=1e-9, atol=1e-10
    )


@pytest.mark.parametrize("network", STRUCTURES)
def test_prediction_over_the_whole_record_is_the_free_run(network):
    model = a_model(network)
    inputs, output, history = signals(60)
    predicted = model.predict(inputs, output, history, steps=60)
    np.testing.assert_allclose(predicted, model.simulate(inputs, history), atol=1e-12)


@pytest.mark.parametrize("network", STRUCTURES)
def test_one_step_ahead_of_its_own_output_is_that_output(network):
    model = a_model(network)
    inputs, _, history = signals(100)
    output = model.simulate(inputs, history)
    np.testing.assert_allclose(model.predict(inputs, output, history), output, atol=1e-9)


@pytest.mark.parametrize("network", STRUCTURES)
def test_a_free_run_in_pieces_is_one_free_run(network):
    model = a_model(network)
    inputs, _, history = signals(100)
    whole = model.simulate(inputs, history)
    later = History(
        inputs=np.concatenate([history.inputs, inputs[:40]]), output=np.concatenate([history.output, whole[:40]])
    )
    np.testing.assert_allclose(model.simulate(inputs[40:], later), whole[40:], atol=1e-9)


@pytest.mark.parametrize("network", STRUCTURES)
def test_a_stored_model_is_the_model(network):
    model = a_model(network)
    again = model_from_dict(model.to_dict())
    assert again.structure == network
    inputs, _, history = signals()
    np.testing.assert_array_equal(again.simulate(inputs, history), model.simulate(inputs, history))


def test_a_history_holds_its_oldest_sample():
    model = a_model(NARX(input_delays=[1, 5], output_delays=3, neurons=3))
    inputs, _, _ = signals()
    short = History.at_rest(inputs=[60.0, 80.0], output=5.0)
    full = History(inputs=np.tile([60.0, 80.0], (5, 1)), output=np.full(5, 5.0))
    np.testing.assert_array_equal(model.simulate(inputs, short), model.simulate(inputs, full))


def test_the_free_run_stays_within_its_bounds_whatever_the_weights():
    network = NARX(input_delays=1, output_delays=1, neurons=3)
    model = a_model(network)
    wild = NARXModel(**{**vars(model), "theta": 100.0 * np.ones(model.n_parameters)})
    inputs, _, history = signals()
    output = wild.simulate(inputs, history)
    assert output.max() <= 30.0 + 3.0 * 31.0
    assert output.min() >= 30.0 - 3.0 * 31.0


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        pytest.param({"input_delays": 0}, "not a set of lags", id="no input lag"),
        pytest.param({"output_delays": [0, 1]}, "not a set of lags", id="the output now is no regressor"),
        pytest.param({"output_delays": [2, 2]}, "not a set of lags", id="a lag twice"),
        pytest.param({"input_delays": "a:b"}, "not a set of lags", id="letters"),
        pytest.param({"input_delays": [1.5]}, "not a set of lags", id="half a sample"),
        pytest.param({"neurons": -1}, "not a number of neurons", id="negative neurons"),
        pytest.param({"neurons": 0, "feedthrough": False}, "not a number of neurons", id="nothing at all"),
    ],
)
def test_structures_that_cannot_be_are_refused(fields, expected):
    with pytest.raises(ConfigError, match=expected):
        NARX(**({"input_delays": 2, "output_delays": 2, "neurons": 2} | fields))


def test_sets_of_delays_must_match_the_inputs():
    with pytest.raises(ConfigError, match="3: one per input"):
        NARX(input_delays=[[0], [1]], output_delays=1, neurons=1).lags(3)


def test_inputs_of_the_wrong_number_are_refused():
    with pytest.raises(TraceError, match="inputs do not fit the model"):
        a_model(NARX(input_delays=1, output_delays=1, neurons=1)).simulate(np.zeros((5, 3)))


@given(st.sets(st.integers(0, 300), min_size=1, max_size=8), st.sets(st.integers(1, 300), min_size=1, max_size=8))
def test_labels_and_storage_of_any_lag_set(inputs, outputs):
    network = NARX(input_delays=sorted(inputs), output_delays=sorted(outputs), neurons=2)
    fields = network.to_dict()
    assert fields.pop("kind") == "NARX"
    assert NARX(**fields) == network
    assert network.label.startswith("NARX ")
    assert network.lags(1).depth == max(inputs | outputs)
