"""Intervals of linear models: against draws from the covariance, and against data whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.estimation import Posterior
from sysid.estimation.estimators import fit
from sysid.estimation.experiment import Experiment
from sysid.estimation.result import Loop
from sysid.models import ARX, Mapping, Start, TransferFunction
from sysid.models.transfer_function import TransferFunctionModel
from sysid.validation import predict_interval
from tests.benchmarks.interval_coverage import ESTIMATED, STRUCTURES, record, shares
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
