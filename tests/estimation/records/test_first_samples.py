"""Records of what integrates are fitted from the state that they are scored from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sysid
from sysid.estimation import FitResult, fit_neural_state_space
from sysid.estimation.grey_box.fit import fit_grey_box
from sysid.estimation.grey_box.preparing import provider_for
from sysid.estimation.grey_box.record import Record
from sysid.estimation.networks.neural.provider import NeuralProvider
from sysid.estimation.records.experiment import Experiment, experiments_of
from sysid.estimation.records.first_samples import is_another, moves_of_shown, other_note, shown_note
from sysid.models import GreyBox, GreyBoxModel, Mapping, NeuralStateSpace, NeuralStateSpaceModel, Start, StartKind
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
ESTIMATED = Start(kind=StartKind.ESTIMATED)
MEASURED = Start(kind=StartKind.MEASURED, n_measured=20)
EQUATIONS = GreyBox(equations="dq/dt = v; dv/dt = g*u - f*v; y = q", parameters={"g": 1, "f": {"start": 1, "low": 0}})


def carriage(n: int = 600) -> Trace:
    """Position of what is pushed to and fro and begins fast; its friction grows with the square of its speed, too."""
    u, y = np.random.default_rng(0).choice([-1.0, 1.0], n // 20).repeat(20), np.empty(n)
    q, v = 0.0, 3.0
    for t in range(n):
        y[t] = q
        for _ in range(10):
            q, v = q + 0.005 * v, v + 0.005 * (u[t] - 0.5 * v - 0.3 * v * abs(v))
    return trace_of({"u": u, "y": y}, name="carriage", sample_time=0.05, units={"u": "V", "y": "m"})


def by_equations(record: Trace, start: Start, iterations: int = 50) -> FitResult:
    training = sysid.Training(starts=1, max_iterations=iterations)
    return fit_grey_box([record], MAPPING, EQUATIONS, training, start=start)


def by_states(record: Trace, start: Start, iterations: int = 50) -> FitResult:
    network, training = NeuralStateSpace(states=2, neurons=0), sysid.Training(starts=1, max_iterations=iterations)
    return fit_neural_state_space([record], MAPPING, network, training, start=start)


@pytest.mark.parametrize("start", [ESTIMATED, MEASURED], ids=["estimated", "measured"])
@pytest.mark.parametrize("fitted", [by_equations, by_states])
def test_a_run_is_scored_as_it_was_trained(fitted: Any, start: Start) -> None:
    """A state of its own would make up for friction that the model lacks, against what the first samples show."""
    record = carriage()
    fit = fitted(record, start)
    scored = Experiment.for_model(record, fit.model, start)
    left = fit.model.simulate(scored.inputs, scored.history) - scored.output
    assert np.mean(left**2) == pytest.approx(fit.history["mse"][-1], rel=0.02)
    assert np.sqrt(np.mean(left**2)) < 0.18
    assert any("first samples show" in note for note in fit.notes)


def of_equations() -> Any:
    model = by_equations(carriage(), ESTIMATED, 1).model
    assert isinstance(model, GreyBoxModel)
    experiments = experiments_of([carriage()], MAPPING, ESTIMATED, 0.0)
    records = tuple(Record.of(one, model.recursion).from_shown() for one in experiments)
    return provider_for(model, model.recursion, records), model.theta


def of_states() -> Any:
    model = by_states(carriage(), ESTIMATED, 1).model
    assert isinstance(model, NeuralStateSpaceModel)
    experiments = experiments_of([carriage()], MAPPING, ESTIMATED, 0.0)
    found = NeuralProvider(template=model.recursion, experiments=experiments, from_shown=frozenset({0}))
    return found, model.theta


@pytest.mark.parametrize("made", [of_equations, of_states])
def test_the_shown_state_moves_with_the_parameters(made: Any) -> None:
    """The derivative leaves a little of the gradient out; nothing heeds a state of the record's own."""
    provider, parameters = made()
    theta, h = np.zeros(provider.n_parameters), 1e-6
    theta[: len(parameters)] = parameters
    found = provider.linearise(theta).gradient
    sides = np.array([[provider.loss(theta + s * h * one) for s in (1.0, -1.0)] for one in np.eye(len(theta))])
    slope = (sides[:, 0] - sides[:, 1]) / (2.0 * h)
    assert found == pytest.approx(slope, rel=0.03, abs=1e-3 * np.abs(slope).max())


def test_a_run_that_is_about_as_good_is_no_other_one() -> None:
    errors = np.ones(100)
    assert not is_another(errors, 0.9 * errors)
    assert is_another(errors, 0.5 * errors)
    assert not is_another(np.full(100, np.inf), errors)


def test_what_the_first_samples_do_not_show_does_not_move() -> None:
    seen = np.column_stack([np.linspace(1.0, 2.0, 9), np.zeros(9)])
    found = moves_of_shown(seen, seen[:, :1] * 3.0)
    assert found == pytest.approx(np.array([[-3.0], [0.0]]))


def test_a_few_records_are_told_by_name() -> None:
    assert shown_note([]) == []
    assert "a, b, c and 2 more" in shown_note(list("abcde"))[0]
    assert "over a, b from" in other_note(["a", "b"])[0]
