"""Networks begun from smaller ones and from linear models, and fits that were put aside."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation import Training, fit_arx, fit_narx
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.networks.warm_start import grown, widened
from sysid.models import ARX, NARX, Cascade, History, Mapping, NARXModel, Recursion, Scaling, parameter_count
from sysid.traces import Channel, Trace

MAPPING = Mapping.parse("u+v -> y")


def record(seed: int = 1, n: int = 400) -> Trace:
    """A saturating first-order system with two inputs."""
    rng = np.random.default_rng(seed)
    u, v = (np.repeat(rng.uniform(-1.0, 1.0, n // 20), 20) for _ in range(2))
    y = np.zeros(n)
    for t in range(1, n):
        y[t] = 0.8 * y[t - 1] + np.tanh(u[t - 1] - 0.3 * y[t - 1]) + 0.4 * v[t - 1]
    channels = tuple(Channel(name=name, unit="V") for name in ("u", "v", "y"))
    return Trace(name="a", sample_time=0.1, channels=channels, values=np.stack([u, v, y], axis=1))


def recursion(network: NARX, scaling: Scaling, seed: int) -> Recursion:
    lags = network.lags(2)
    size = parameter_count(lags, network.neurons, linear=True, gated=network.gated)
    theta = 0.2 * np.random.default_rng(seed).standard_normal(size)
    return Recursion(lags=lags, neurons=network.neurons, theta=theta, scaling=scaling)


ONE = Scaling(input_offset=(0.1, -0.2), input_scale=(1.0, 2.0), output_offset=0.3, output_scale=2.0)
OTHER = Scaling(input_offset=(0.5, 0.0), input_scale=(3.0, 1.5), output_offset=-0.4, output_scale=5.0)

LARGER = {
    "more delays": NARX(input_delays=3, output_delays=2, neurons=3),
    "more delays of one input": NARX(input_delays=[[1], [0, 1, 4]], output_delays=1, neurons=3),
    "the same": NARX(input_delays=1, output_delays=1, neurons=3),
    "gates": NARX(input_delays=2, output_delays=1, neurons=3, gated=True),
}


@pytest.mark.parametrize("scaling", [ONE, OTHER], ids=["same scaling", "other scaling"])
@pytest.mark.parametrize("larger", LARGER.values(), ids=LARGER)
def test_a_network_grown_by_lags_computes_what_the_smaller_one_did(larger: NARX, scaling: Scaling) -> None:
    small = recursion(NARX(input_delays=1, output_delays=1, neurons=3), ONE, 3)
    template = recursion(larger, scaling, 4)
    theta = grown(small, template, template.theta)
    large = Recursion(lags=template.lags, neurons=3, theta=theta, scaling=scaling)
    inputs = np.random.default_rng(5).uniform(-1.0, 1.0, (50, 2))
    history = History.at_rest(inputs=inputs[0], output=0.2)
    np.testing.assert_allclose(large.simulate(inputs, history), small.simulate(inputs, history), rtol=1e-11)


def test_a_gated_network_is_grown_with_its_gates() -> None:
    small = recursion(NARX(input_delays=1, output_delays=1, neurons=3, gated=True), ONE, 3)
    template = recursion(NARX(input_delays=3, output_delays=2, neurons=3, gated=True), OTHER, 4)
    large = replace(template, theta=grown(small, template, template.theta))
    inputs = np.random.default_rng(5).uniform(-1.0, 1.0, (50, 2))
    history = History.at_rest(inputs=inputs[0], output=0.2)
    np.testing.assert_allclose(large.simulate(inputs, history), small.simulate(inputs, history), rtol=1e-11)
    without = recursion(NARX(input_delays=3, output_delays=2, neurons=3), ONE, 4)
    with pytest.raises(ConfigError, match="not contained"):
        grown(small, without, without.theta)


def test_added_neurons_come_from_the_fresh_start() -> None:
    small = recursion(NARX(input_delays=1, output_delays=1, neurons=2), ONE, 3)
    template = recursion(NARX(input_delays=2, output_delays=1, neurons=5), ONE, 4)
    theta = grown(small, template, template.theta)
    large = Recursion(lags=template.lags, neurons=5, theta=theta, scaling=ONE)
    np.testing.assert_array_equal(large.hidden_weights[2:], template.hidden_weights[2:])
    np.testing.assert_array_equal(large.readout[2:], template.readout[2:])
    np.testing.assert_array_equal(large.readout[:2], small.readout)


def test_a_network_begins_with_the_error_of_the_linear_model_it_is_given() -> None:
    trace = record()
    linear = fit_arx([trace], MAPPING, ARX(na=2, nb=(2, 2), nk=(1, 1)))
    network = NARX(input_delays=2, output_delays=2, neurons=4)
    training = Training(loop="open", max_iterations=1)
    fit = fit_narx([trace], MAPPING, network, training, initial=linear)
    predicted = linear.model.predict(
        trace.columns(["u", "v"]), trace["y"], History.at_rest(inputs=trace.values[0, :2], output=0.0)
    )
    mse = float(np.mean((predicted - trace["y"]) ** 2))
    # The readout of the random neurons is small, not zero.
    assert fit.history["mse"][0] == pytest.approx(mse, rel=0.2)


@pytest.mark.parametrize(
    "network",
    [
        NARX(input_delays=1, output_delays=2, neurons=4),
        NARX(input_delays=2, output_delays=2, neurons=1),
        NARX(input_delays=2, output_delays=2, neurons=4, activation="cubic"),
    ],
    ids=["fewer lags", "fewer neurons", "neurons of another kind"],
)
def test_what_does_not_contain_the_initial_fit_is_refused(network: NARX) -> None:
    trace, training = record(), Training(loop="open", max_iterations=1)
    first = fit_narx([trace], MAPPING, NARX(input_delays=2, output_delays=2, neurons=2), training)
    with pytest.raises(ConfigError, match="not contained"):
        fit_narx([trace], MAPPING, network, training, initial=first)


@pytest.mark.parametrize("loop", ["open", "closed"])
@pytest.mark.parametrize("regularisation", [None, 1e-3], ids=["evidence", "given"])
def test_a_fit_that_was_put_aside_ends_where_it_would_have_ended(loop: str, regularisation: float | None) -> None:
    trace, network = record(), NARX(input_delays=1, output_delays=1, neurons=3)
    kept: list[Checkpoint] = []

    def trained(iterations: int, resume: Checkpoint | None = None) -> np.ndarray:
        training = Training(loop=loop, max_iterations=iterations, regularisation=regularisation, patience=100)
        fit = fit_narx([trace], MAPPING, network, training, resume=resume, on_checkpoint=kept.append)
        assert len(fit.history["mse"]) == iterations + 1
        return np.asarray(fit.model.recursion.numbers)

    whole = trained(24)
    trained(22)
    stored = Checkpoint(fields=json.loads(json.dumps(kept[-1].fields)))
    np.testing.assert_array_equal(trained(24, resume=stored), whole)


def test_a_checkpoint_of_another_structure_is_refused() -> None:
    trace, kept = record(), []
    training = Training(loop="open", max_iterations=2)
    small, large = (NARX(input_delays=1, output_delays=1, neurons=k) for k in (1, 2))
    fit_narx([trace], MAPPING, small, training, on_checkpoint=kept.append)
    with pytest.raises(ConfigError, match="another structure"):
        fit_narx([trace], MAPPING, large, training, resume=kept[0])


def network(mapping: str, structure: NARX, seed: int) -> NARXModel:
    asked = Mapping.parse(mapping)
    n = len(asked.inputs)
    size = parameter_count(structure.lags(n), structure.neurons, linear=structure.feedthrough, gated=structure.gated)
    return NARXModel(
        network=structure,
        theta=0.2 * np.random.default_rng(seed).standard_normal(size),
        scaling=Scaling(
            input_offset=(0.1,) * n, input_scale=(1.5,) * n, output_offset=0.1 * seed, output_scale=1.0 + 0.1 * seed
        ),
        mapping=asked,
        sample_time=0.1,
        input_units=("V",) * n,
        output_unit="V",
        rest_output=0.0,
    )


CHAIN = {
    "plain": NARX(input_delays="0:1", output_delays="1:2", neurons=3),
    "gated": NARX(input_delays=[[0, 1]], output_delays=1, neurons=2, gated=True),
    "without feedthrough": NARX(input_delays=1, output_delays=[1, 3], neurons=3, feedthrough=False),
}


@pytest.mark.parametrize("structure", CHAIN.values(), ids=CHAIN)
def test_a_circle_that_is_closed_from_zero_runs_as_the_chain_did(structure: NARX) -> None:
    first, second = network("u -> a", structure, 1), network("a -> b", structure, 2)
    wider = widened(first, {"b": (1, 4)}, {"b": second})
    assert wider.mapping == Mapping.parse("u+b -> a")
    assert wider.network.lags(2).inputs == (*first.network.lags(1).inputs, (1, 4))
    assert (wider.scaling.input_offset[1], wider.scaling.input_scale[1]) == (0.2, 1.2)
    chain, circle = Cascade(models=(first, second)), Cascade(models=(wider, second))
    inputs = np.random.default_rng(3).uniform(-1.0, 1.0, (60, 1))
    for name in ("a", "b"):
        np.testing.assert_allclose(circle.simulate(inputs)[name], chain.simulate(inputs)[name], rtol=1e-11)


def test_what_a_network_reads_already_it_cannot_be_given_once_more() -> None:
    first, second = network("u -> a", CHAIN["plain"], 1), network("a -> b", CHAIN["plain"], 2)
    with pytest.raises(ConfigError, match="reads a already"):
        widened(second, {"a": (1,)}, {"a": first})
