"""One network and a whole of it: the same residuals, normal equations and correlation, by one mechanism."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sysid.estimation.least_squares.correlation import correlation_time
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.networks.together.provider import CascadeProvider
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, Cascade, History, Mapping, NARXModel, Scaling, parameter_count
from sysid.traces import Channel, Trace

SCALING = Scaling(input_offset=(0.3, -0.2), input_scale=(2.0, 0.5), output_offset=1.5, output_scale=4.0)
NETWORKS = {
    "linear": NARX(input_delays=3, output_delays=2, neurons=0),
    "gates": NARX(input_delays=2, output_delays=2, neurons=3, gated=True),
    "neurons": NARX(input_delays="0:2", output_delays=[1, 3], neurons=4),
}


def both(network: NARX, error: float, usable: np.ndarray | None = None) -> tuple[RecursionProvider, CascadeProvider]:
    """The residuals of one network over two records in free run, both ways."""
    rng, names = np.random.default_rng(0), ("u0", "u1", "y")
    n = parameter_count(network.lags(2), network.neurons, linear=True, gated=network.gated)
    model = NARXModel(
        network=network, theta=0.1 * rng.standard_normal(n), scaling=SCALING, mapping=Mapping.parse("u0+u1 -> y"),
        sample_time=0.1, input_units=("", ""), output_unit="", rest_output=0.7,
    )  # fmt: skip
    experiments, traces = [], []
    for length in (1500, 90):
        values, own = rng.uniform(-1.0, 1.0, (length, 3)), None if usable is None else usable[:length]
        u, y = values[:, :2], values[:, 2]
        weights = None if own is None else own.astype(np.float64)
        history = History.at_rest(inputs=list(u[0]), output=0.7)
        experiments.append(Experiment(inputs=u, output=y, history=history, weights=weights))
        channels = tuple(Channel(name=name, unit="") for name in names)
        traces.append(Trace(name=f"{length}", sample_time=0.1, channels=channels, values=values, usable=own))
    return (
        RecursionProvider(template=model.recursion, experiments=tuple(experiments), closed=True),
        CascadeProvider(cascade=Cascade(models=(model,)), traces=tuple(traces), errors={"y": error}),
    )


@pytest.mark.parametrize("usable", [None, np.arange(1500) % 5 > 0], ids=["all", "some masked"])
@pytest.mark.parametrize("network", NETWORKS.values(), ids=NETWORKS)
def test_a_whole_of_one_network_is_the_network(network: NARX, usable: np.ndarray | None) -> None:
    """In the network's scaled numbers, whatever error counts as one in the whole."""
    error = 0.25
    alone, whole = both(network, error, usable)
    theta, times = whole.theta, (SCALING.output_scale / error) ** 2
    assert alone.n_samples == whole.n_samples
    assert whole.loss(theta) == pytest.approx(times * alone.loss(theta), rel=1e-13)
    one, other = alone.linearise(theta), whole.linearise(theta)
    assert other.loss == pytest.approx(times * one.loss, rel=1e-13)
    assert other.correlation_time == pytest.approx(one.correlation_time, rel=1e-12)
    for a, b in ((one.gradient, other.gradient), (one.gauss_newton, other.gauss_newton)):
        assert_allclose(b / times, a, rtol=0.0, atol=1e-13 * np.abs(a).max())


def test_of_a_network_whose_every_fourth_sample_counts_all_tell_how_long_errors_persist() -> None:
    alone, _ = both(NETWORKS["neurons"], 1.0, np.arange(1500) % 5 > 0)
    some = RecursionProvider(template=alone.template, experiments=alone.experiments, closed=True, stride=4)
    theta = 0.2 * np.random.default_rng(1).standard_normal(len(alone.template.theta))
    parts = [np.sqrt(e.weights) for e in alone.experiments]
    residuals = [one * w for one, w in zip(np.split(alone.residuals(theta), [1500]), parts, strict=True)]
    at, J = some.linearise(theta), some.jacobian(theta)
    weights = np.concatenate([w[::4] for w in parts])
    e = np.concatenate([one[::4] for one in residuals])
    assert some.n_samples == np.count_nonzero(weights)
    assert at.loss == pytest.approx(0.5 * e @ e, rel=1e-12)
    assert_allclose(at.gradient, (weights[:, np.newaxis] * J).T @ e, rtol=1e-10, atol=1e-12)
    expected = sum(len(one) * max(1.0, correlation_time(one) / 4) for one in residuals) / 1590
    assert at.correlation_time == pytest.approx(expected, rel=1e-12)
