"""Intervals of linear models: against draws from the covariance, and against data whose truth is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError, TraceError
from sysid.estimation import Posterior, StateSpaceTraining
from sysid.estimation.fitting import fit
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import Loop
from sysid.models import ARMAX, ARX, LinearStateSpace, Mapping, Start, TransferFunction
from sysid.models.linear.transfer_function import TransferFunctionModel
from sysid.validation import predict_interval
from tests.benchmarks.interval_coverage import BOTH, ESTIMATED, STRUCTURES, record, shares
from tests.estimation.linear_systems import trace_of

MAPPING = Mapping.parse("u1 -> y")


@pytest.mark.parametrize("name", STRUCTURES)
def test_intervals_of_every_structure_hold_what_they_promise(name: str) -> None:
    """A few records; ``python -m tests.benchmarks interval_coverage`` has many."""
    held = shares(name, 3)["free run"]
    assert len(held) >= 2
    assert 0.8 < np.mean(held) <= 1.0


@pytest.mark.parametrize("domain", ["discrete", "continuous"])
def test_polynomials_move_the_output_as_the_model_itself_does(domain: str) -> None:
    trace = record(np.random.default_rng(1), inside=False)
    structure = TransferFunction(poles=(2,), zeros=(1,), delays=(1,), domain=domain)
    model = fit([trace], MAPPING, structure, start=ESTIMATED, stability=None).model
    assert isinstance(model, TransferFunctionModel)
    run = Experiment.for_model(trace, model, Start())
    # All of the numerator: the output's part of the input.
    gain = np.r_[model.numerator(0), np.zeros(len(model.polynomials.vector) - 2)]
    moves = model.output_moves(gain[:, None], run.inputs, run.history)[:, 0]
    larger = replace(model, taps=tuple(1.01 * taps for taps in model.taps))
    expected = (larger.simulate(run.inputs, run.history) - model.simulate(run.inputs, run.history)) / 0.01
    np.testing.assert_allclose(moves, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["OE", "BJ", "ARMAX", "SS", "SS of two outputs"])
@pytest.mark.parametrize("loop", Loop)
def test_runs_of_drawn_parameters_spread_as_the_interval_says(name: str, loop: Loop) -> None:
    structure, _, inside = STRUCTURES[name]
    trace = record(np.random.default_rng(5), inside=inside)
    mapping = BOTH if structure.several_outputs else MAPPING
    found = fit([trace], mapping, structure, start=ESTIMATED, stability=None)
    model, run = found.model, Experiment.for_model(trace, found.model, ESTIMATED)
    assert found.posterior is not None
    assert model.vector is not None
    if loop is Loop.OPEN and not model.recursion.predicts:
        assert np.isnan(found.posterior.parameter_variance(model, run, loop)).all()
        return
    variance, rng, drawn = found.posterior.parameter_variance(model, run, loop), np.random.default_rng(6), []
    for _ in range(200):
        other = model.with_theta(
            model.vector + found.posterior.factor @ rng.normal(size=found.posterior.factor.shape[1])
        )
        assert other is not None
        if loop is Loop.CLOSED:
            drawn.append(other.simulate(run.inputs, run.history))
        else:
            drawn.append(other.predict(run.inputs, run.output, run.history))
    ratio = np.var(drawn, axis=0).mean() / variance.mean()
    assert 0.7 < ratio < 1.4


@pytest.mark.parametrize("name", ["ARX", "BJ", "ARMAX", "SS", "SS of two outputs"])
def test_some_steps_ahead_the_innovations_add_up(name: str) -> None:
    structure, _, inside = STRUCTURES[name]
    trace, other = (record(np.random.default_rng(seed), inside=inside) for seed in (7, 8))
    mapping = BOTH if structure.several_outputs else MAPPING
    found = fit([trace], mapping, structure, start=ESTIMATED, stability=None)
    one, many = (predict_interval(found, other, loop=Loop.OPEN, steps=k, start=ESTIMATED) for k in (1, 4))
    assert np.all(np.asarray(many.noise_deviation) > one.noise_deviation)
    measured = other.columns(mapping.outputs)[-len(many.output) :]
    errors = many.output.reshape(measured.shape) - measured
    np.testing.assert_allclose(errors.std(axis=0), many.noise_deviation, rtol=0.25)
    # An innovation that is added to a measured output moves the predictions after it by the responses.
    run, responses = Experiment.for_model(other, found.model, ESTIMATED), found.model.innovation_responses(3)
    assert responses is not None
    pushed = run.output.copy()
    pushed[100] += 1.0  # of every output
    before, after = (found.model.predict(run.inputs, y, run.history) for y in (run.output, pushed))
    np.testing.assert_allclose((after - before)[101], np.squeeze(responses[1].sum(axis=1)), atol=1e-9)


def test_steps_beyond_what_a_model_says_of_its_noise_are_refused() -> None:
    trace = record(np.random.default_rng(9), inside=False)
    found = fit([trace], MAPPING, STRUCTURES["OE"][0], start=ESTIMATED, stability=None)
    with pytest.raises(ConfigError, match="what its noise does over several steps"):
        predict_interval(found, trace, loop=Loop.OPEN, steps=3, start=ESTIMATED)
    with pytest.raises(ConfigError, match="free run"):
        predict_interval(found, trace, steps=3, start=ESTIMATED)


def test_of_a_noise_that_drifts_and_of_a_subspace_method_there_is_none_and_it_says_so() -> None:
    trace = record(np.random.default_rng(10), inside=True)
    alone = StateSpaceTraining(method="subspace")
    drifting = ARMAX(na=2, nb=(1,), nc=0, nk=(1,), integrated=True)
    for structure, training, why in ((drifting, None, "drifts"), (LinearStateSpace(states=2), alone, "subspace")):
        found = fit([trace], MAPPING, structure, training, start=ESTIMATED, stability=None)
        assert found.posterior is None
        assert any(note.startswith("No interval of the output") and why in note for note in found.notes)


def test_of_a_plant_that_grows_without_bound_there_is_none_and_it_says_so() -> None:
    u = np.repeat(np.random.default_rng(2).normal(size=20), 5)
    y = np.zeros(100)
    for k in range(1, 100):
        y[k] = 1.05 * y[k - 1] + 0.1 * u[k - 1]
    for structure in (ARX(na=1, nb=(1,), nk=(1,)), TransferFunction(poles=(1,), zeros=(0,), delays=(1,))):
        found = fit([trace_of(u[:, None], y)], MAPPING, structure, start=ESTIMATED)
        assert found.posterior is None
        assert any(note.startswith("No interval of the output") for note in found.notes)


def test_one_step_ahead_there_is_none_of_a_transfer_function() -> None:
    trace = record(np.random.default_rng(3), inside=False)
    found = fit([trace], MAPPING, TransferFunction(poles=(2,), zeros=(0,), delays=(1,)), start=ESTIMATED)
    assert isinstance(found.posterior, Posterior)
    run = Experiment.for_model(trace, found.model, ESTIMATED)
    assert np.isnan(found.posterior.parameter_variance(found.model, run, Loop.OPEN)).all()
    interval = predict_interval(found, trace, start=ESTIMATED)
    assert np.isfinite(interval.half_width).all()


def test_an_input_that_is_not_determined_takes_no_part() -> None:
    trace = record(np.random.default_rng(4), inside=False)
    both = trace_of(np.column_stack([trace["u1"], np.ones(len(trace))]), trace["y"])
    structure = TransferFunction(poles=(2, 1), zeros=(0, 0), delays=(1, 1))
    found = fit([both], Mapping.parse("u1+u2 -> y"), structure, start=ESTIMATED)
    assert np.isfinite(predict_interval(found, both, start=ESTIMATED).half_width).all()


@pytest.mark.parametrize("start", [None, {"measured": 20}, "rest"])
@pytest.mark.parametrize("name", ["ARX", "SS of two outputs"])
def test_a_coverage_is_of_the_record_as_it_stands_however_it_begins(name: str, start: Any) -> None:
    """As the page on trust says: ``interval.coverage(trace["BC"])``; the first samples are those of the start."""
    structure, _, inside = STRUCTURES[name]
    trace, other = (record(np.random.default_rng(seed), inside=inside) for seed in (7, 8))
    mapping = BOTH if structure.several_outputs else MAPPING
    found = sysid.fit([trace], mapping, structure, **({} if start is None else {"start": start}))
    interval = predict_interval(found, other)
    measured = other.columns(mapping.outputs)
    measured = measured if structure.several_outputs else measured[:, 0]
    whole, last = interval.coverage(measured), interval.coverage(measured[interval.first :])
    assert whole == last
    assert interval.first == (20 if isinstance(start, dict) else 0 if start else 50)
    usable = np.arange(len(measured)) % 2 == 0
    half = interval.coverage(measured, usable)
    assert half == interval.coverage(np.where(usable[:, None] if measured.ndim > 1 else usable, measured, 1e9), usable)
    with pytest.raises(TraceError, match="not the output of this interval"):
        interval.coverage(measured[:-1])
