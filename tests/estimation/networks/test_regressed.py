"""Starts whose linear parameters are those of least squares one step ahead."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.estimation import FitProgress, Training, fit_narx
from sysid.estimation.networks.basis import RegressorBasis
from sysid.estimation.networks.initialise import Layout
from sysid.estimation.networks.pretraining import StepSamples, WhileUsed
from sysid.estimation.networks.provider import RecursionProvider
from sysid.estimation.networks.regressed import regressed
from sysid.estimation.records.experiment import Experiment
from sysid.models import NARX, History, Mapping, NARXModel, Scaling
from sysid.traces import Trace
from tests.traces.made import trace_of

NETWORK = NARX(input_delays=2, output_delays=2, neurons=6)


def levels(n: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-1.0, 1.0, n // 20 + 1), 20)[:n]


def tank(u: np.ndarray, noise: float = 0.0, seed: int = 1) -> np.ndarray:
    """A tank that gravity empties: its outflow is a curve of its level."""
    y, level = np.empty(len(u)), 0.5
    for k, now in enumerate(u):
        y[k] = level
        level += 0.1 * (1.0 + now - np.sign(level) * abs(level) ** 0.5 - 0.5 * level**3)
    return y + noise * np.random.default_rng(seed).standard_normal(len(u))


def parts(network: NARX, u: np.ndarray, y: np.ndarray) -> tuple[StepSamples, RecursionProvider, np.ndarray]:
    """One-step residuals, those of the free run, and a drawn start."""
    layout = Layout.of(network, 1)
    model = NARXModel(
        network=network,
        theta=layout.centre(),
        scaling=Scaling(input_offset=(0.0,), input_scale=(1.0,), output_offset=0.0, output_scale=1.0),
        mapping=Mapping.parse("u -> y"),
        sample_time=1.0,
        input_units=("1",),
        output_unit="1",
        rest_output=float(y[0]),
    )
    records = [Experiment(inputs=u[:, None], output=y, history=History.at_rest(inputs=u[:1], output=float(y[0])))]
    basis = RegressorBasis.identity(layout.lags)
    samples = StepSamples.of(model, records, layout, basis, samples=10**6, seed=0)
    run = RecursionProvider(template=model.recursion, experiments=tuple(records), closed=True)
    return samples, run, layout.draw(np.random.default_rng(0), layout.centre())


def curve(trace: Trace, network: NARX, iterations: int, seed: int = 0) -> np.ndarray:
    """Mean squared errors of the free run, iteration by iteration."""
    errors: list[float] = []

    def watch(progress: FitProgress) -> None:
        errors.append(progress.mse)

    training = Training(max_iterations=iterations, seed=seed, workers=1)
    fit_narx([trace], Mapping.parse("u -> y"), network, training, on_progress=watch)
    return np.array(errors)


@pytest.mark.parametrize(
    "network",
    [NETWORK, replace(NETWORK, gated=True), replace(NETWORK, feedthrough=False), replace(NETWORK, activation="cubic")],
    ids=["plain", "gates", "no linear part", "cubic"],
)
def test_it_follows_the_record_where_a_drawn_start_holds_its_output(network: NARX):
    u = levels(600)
    y = tank(u)
    samples, run, drawn = parts(network, u, y)
    assert run.loss(regressed(drawn, samples, run)) < 0.2 * run.loss(drawn)


def test_the_hidden_layer_stays_as_it_was_drawn():
    u = levels(600)
    samples, run, drawn = parts(NETWORK, u, tank(u))
    hidden = Layout.of(NETWORK, 1).hidden
    assert_array_equal(regressed(drawn, samples, run)[hidden], drawn[hidden])


def test_a_linear_plant_without_noise_is_found_at_once():
    u = levels(400)
    y = np.zeros(400)
    for k in range(2, 400):
        y[k] = 1.5 * y[k - 1] - 0.6 * y[k - 2] + 0.1 * u[k - 1]
    network = replace(NETWORK, neurons=1)
    samples, run, drawn = parts(network, u, y)
    found = regressed(drawn, samples, run)
    assert run.loss(found) < 1e-3 * run.loss(drawn)
    assert_allclose(found[Layout.of(network, 1).affine][-2:], [1.5, -0.6], atol=1e-2)


@pytest.mark.parametrize("worse", [1.0, 1.5, 3.9])
def test_it_is_never_taken_where_its_run_is_worse(worse: float):
    """However little: all ridges are alike in a factor of four, and the drawn start is none of them."""
    u = levels(200)
    samples, _, drawn = parts(NETWORK, u, tank(u))

    class Stub:
        def loss(self, theta: np.ndarray) -> float:
            return 1.0 if np.array_equal(theta, drawn) else worse

    assert_array_equal(regressed(drawn, samples, Stub()), drawn)


def test_no_number_leaves_it_as_it_was_drawn():
    u = levels(200)
    samples, run, drawn = parts(NETWORK, u, tank(u))
    broken = replace(samples, target=np.full_like(samples.target, np.nan))
    assert_array_equal(regressed(drawn, broken, run), drawn)


def test_a_fit_is_close_within_few_iterations():
    u = levels(1000)
    y = tank(u, noise=0.01)
    errors = curve(trace_of({"u": u, "y": y}), replace(NETWORK, neurons=8), 10)
    assert errors[0] < 0.02 * np.var(y)
    assert errors[-1] < 2e-3 * np.var(y)


def test_samples_are_made_for_random_starts_alone_and_let_go_when_no_start_has_them(monkeypatch: pytest.MonkeyPatch):
    """They were held in memory for the whole fit, with all lags of all records, also where nobody asked for them."""
    made: list[weakref.ref[StepSamples]] = []
    whole = StepSamples.of

    def watched(*arguments: Any, **options: Any) -> StepSamples:
        found = whole(*arguments, **options)
        made.append(weakref.ref(found))
        return found

    monkeypatch.setattr(StepSamples, "of", watched)
    held: list[int] = []

    def watch(_: FitProgress) -> None:
        held.append(sum(one() is not None for one in made))

    u = levels(400)
    record, training = trace_of({"u": u, "y": tank(u)}), Training(max_iterations=4, starts=2, workers=1)
    first = fit_narx([record], Mapping.parse("u -> y"), NETWORK, training, on_progress=watch)
    assert made
    assert held
    assert not any(held)
    made.clear()
    fit_narx([record], Mapping.parse("u -> y"), NETWORK, replace(training, starts=1), initial=first)
    assert not made


def test_starts_that_begin_side_by_side_share_their_samples():
    u = levels(200)
    samples, _, _ = parts(NETWORK, u, tank(u))
    count: list[int] = []

    def make() -> StepSamples:
        count.append(1)
        return replace(samples)

    kept = WhileUsed(make)
    one, two = kept.made(), kept.made()
    assert one is two
    assert len(count) == 1
    del one, two
    gc.collect()
    assert kept.made() is not None
    assert len(count) == 2
    assert WhileUsed(lambda: None).made() is None
