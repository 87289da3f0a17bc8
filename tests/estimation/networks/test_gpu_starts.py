"""Scouts: batched fits that are those of the engine, and the starts that a race begins with."""

import numpy as np
import pytest
import torch

from sysid.errors import ConfigError
from sysid.estimation import Loop, Training, fit_narx
from sysid.estimation.least_squares.levenberg_marquardt import LevenbergMarquardt
from sysid.estimation.least_squares.termination import Termination
from sysid.estimation.networks.gpu_starts import Patrol
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.provider import Experiment, RecursionProvider
from sysid.models import NARX, History, Mapping, Recursion, Scaling
from sysid.traces import Channel, Trace

NETWORK = NARX(input_delays=1, output_delays=1, neurons=3)


def a_record(n: int = 150) -> tuple[np.ndarray, np.ndarray]:
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, n // 10), 10)
    y = np.zeros(n)
    for t in range(1, n):
        y[t] = 0.8 * y[t - 1] + 0.3 * np.tanh(2.0 * u[t - 1])
    return u[:, None], y


def a_patrol() -> Patrol:
    u, y = a_record()
    layout = Layout(lags=NETWORK.lags(1), neurons=NETWORK.neurons, linear=True)
    template = Recursion(
        lags=layout.lags,
        neurons=layout.neurons,
        theta=layout.centre(),
        scaling=Scaling.identity(1),
        low=-3.0,
        high=3.0,
    )
    record = Experiment(inputs=u, output=y, history=History.at_rest(inputs=u[0], output=0.0))
    provider = RecursionProvider(template=template, experiments=(record,), closed=True)
    return Patrol(
        provider=provider, to_plain=np.eye(len(layout.centre())), layout=layout, centre=layout.centre(),
        regularisation=1e-3, device="cpu",
    )  # fmt: skip


def test_a_first_step_is_the_engines():
    """A scout whose first trial fails stays for an iteration; the engine tries again in the same one."""
    patrol = a_patrol()
    prior = patrol.layout.prior(patrol.centre, alpha=1e-3, beta=1.0)
    engine = LevenbergMarquardt(termination=Termination(max_iterations=1), evidence_after=None)
    moved = 0
    for scout in patrol.scouts(range(4), iterations=1):
        theta = patrol.layout.draw(np.random.default_rng(scout.seed), patrol.centre)
        if not np.array_equal(scout.theta, theta):
            moved += 1
            expected = engine.minimise(patrol.provider, theta, prior).theta
            np.testing.assert_allclose(scout.theta, expected, rtol=1e-5, atol=1e-7)
    assert moved


def test_scouts_come_back_in_order_and_better_than_they_went():
    patrol = a_patrol()
    found = patrol.scouts(range(6), iterations=6)
    losses = [scout.loss for scout in found]
    assert losses == sorted(losses)
    assert sorted(scout.seed for scout in found) == list(range(6))
    for scout in found:
        begun = patrol.layout.draw(np.random.default_rng(scout.seed), patrol.centre)
        assert scout.loss == pytest.approx(patrol.provider.loss(scout.theta))
        assert scout.loss < patrol.provider.loss(begun)


@pytest.fixture
def trace() -> Trace:
    u, y = a_record()
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="V"))
    return Trace(name="record", sample_time=1.0, channels=channels, values=np.column_stack([u, y]))


def fitted(trace: Trace, **options) -> tuple[int | None, np.ndarray]:
    training = Training(starts=1, max_iterations=10, **options)
    fit = fit_narx([trace], Mapping.parse("u -> y"), NETWORK, training, rest_output=0.0)
    return fit.seed, fit.model.theta


def test_a_fit_begins_with_the_best_scout(trace):
    seed, _ = fitted(trace, scouts=5, device="cpu")
    assert seed in range(5)
    assert seed == fitted(trace, scouts=5, device="cpu")[0]


def test_without_a_device_no_scout_goes_out_by_itself(trace, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    np.testing.assert_array_equal(fitted(trace, scouts=5)[1], fitted(trace)[1])


@pytest.mark.parametrize(
    "options",
    [{"starts": 9}, {"loop": Loop.OPEN}, {"prelude": 100}, {"stride": 2}],
    ids=["more starts than scouts", "open loop", "prelude", "stride"],
)
def test_options_that_do_not_go_together_are_refused(options):
    with pytest.raises(ConfigError, match="scouts"):
        Training(scouts=8, **options)
