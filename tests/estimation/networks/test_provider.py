"""A run that a loss has made is not made again for the rows of the step, and changes none of them."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sysid.estimation.experiment import Experiment
from sysid.estimation.networks import provider as of
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.provider import RecursionProvider
from sysid.models import History, Lags, Recursion, Scaling

LAGS = Lags(inputs=((0, 1),), output=(1, 2))
LAYOUT = Layout(lags=LAGS, neurons=3, linear=True)


def provider() -> RecursionProvider:
    rng = np.random.default_rng(0)
    template = Recursion(lags=LAGS, neurons=3, theta=LAYOUT.centre(), scaling=Scaling.identity(1))
    records = [
        Experiment(
            inputs=rng.uniform(-1.0, 1.0, (n, 1)),
            output=rng.uniform(-1.0, 1.0, n),
            history=History.at_rest(inputs=[0.0], output=0.0),
        )
        for n in (60, 40)
    ]
    return RecursionProvider(template=template, experiments=tuple(records), closed=True)


def parameters(seed: int) -> np.ndarray:
    return 0.3 * np.random.default_rng(seed).standard_normal(LAYOUT.n_parameters)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Records that were run."""
    made, run = [], RecursionProvider._pass

    def counted(self, record, theta, **keep):
        made.append(len(record.target))
        return run(self, record, theta, **keep)

    monkeypatch.setattr(RecursionProvider, "_pass", counted)
    return made


def test_rows_are_those_of_the_run_of_the_loss(runs: list[int]) -> None:
    one, theta = provider(), parameters(1)
    loss = one.loss(theta)
    after = one.linearise(theta)
    assert runs == [60, 40]
    fresh = provider().linearise(theta)
    assert loss == after.loss == fresh.loss
    assert_array_equal(after.gauss_newton, fresh.gauss_newton)
    assert_array_equal(after.gradient, fresh.gradient)
    assert after.correlation_time == fresh.correlation_time


def test_other_parameters_and_other_threads_have_runs_of_their_own(runs: list[int]) -> None:
    one = provider()
    one.loss(parameters(1))
    with ThreadPoolExecutor(1) as pool:
        there = pool.submit(one.linearise, parameters(1)).result()
    here = one.linearise(parameters(2))
    assert len(runs) == 6
    assert_array_equal(there.gradient, provider().linearise(parameters(1)).gradient)
    assert_array_equal(here.gradient, provider().linearise(parameters(2)).gradient)


def test_runs_of_long_records_are_not_held(runs: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(of, "AGAIN", 3 * 100 - 1)
    one = replace(provider())
    one.loss(parameters(1))
    one.linearise(parameters(1))
    assert len(runs) == 4
