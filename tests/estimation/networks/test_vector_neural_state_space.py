"""Neural state spaces of several outputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.estimation import Training, fit_neural_state_space
from sysid.models import (
    History,
    Mapping,
    VectorNeuralStateSpace,
    beginning,
    model_from_dict,
)
from sysid.traces import Channel, Role, Trace, TraceSet
from sysid.validation.evaluation import evaluate_outputs
from tests.estimation.networks.test_neural_state_space import FREE, steps

BOTH = Mapping.parse("u+w -> y+z")


def coupled(seed: int, n: int = 300, noise: tuple[float, float] = (0.0, 0.0)) -> Trace:
    """Two states that drive each other through a saturation, each measured beside the other, in units far apart."""
    rng = np.random.default_rng(seed)
    u, x, y = np.column_stack([steps(n, rng), steps(n, rng)]), np.zeros(2), np.empty((n, 2))
    for t in range(n):
        y[t] = [100.0 * (x[0] + 0.3 * x[1]), 1e-3 * (x[1] - 0.2 * x[0])]
        x = np.array([0.8 * x[0] + 0.3 * np.tanh(2.0 * x[1]), 0.9 * x[1] - 0.1 * x[0]]) + u[t] * [0.1, 0.2]
    y += rng.standard_normal(y.shape) * np.array(noise) * y.std(axis=0)
    channels = tuple(Channel(name=name, unit=unit) for name, unit in zip("uwyz", ("V", "V", "m", "A"), strict=True))
    return Trace(name=f"coupled {seed}", sample_time=1.0, channels=channels, values=np.column_stack([u, y]))


def test_several_outputs_are_one_model_that_shares_its_states():
    records = [coupled(0), coupled(1)]
    fit = fit_neural_state_space(
        records, BOTH, VectorNeuralStateSpace(states=2, neurons=4), Training(max_iterations=120, starts=2), start=FREE
    )
    unseen = coupled(2)
    for found in evaluate_outputs(
        fit.model, TraceSet(name="unseen", traces=(unseen,), roles={unseen.name: Role.VALIDATION}, source=""), FREE
    ).values():
        assert found.cases[unseen.name].free_run.nrmse_fit > 99.0
    again = model_from_dict(fit.model.to_dict())
    u = unseen.columns(["u", "w"])
    np.testing.assert_array_equal(again.simulate(u), fit.model.simulate(u))
    assert fit.model.simulate(u).shape == (len(u), 2)


def test_a_linear_system_of_several_outputs_is_found_exactly():
    n, rng = 300, np.random.default_rng(0)
    A, B, C = (rng.normal(size=size) for size in ((4, 4), (4, 2), (2, 4)))
    A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
    u, x, y = rng.normal(size=(n, 2)), rng.normal(size=4), np.empty((n, 2))
    for t in range(n):
        y[t], x = C @ x, A @ x + B @ u[t]
    trace = replace(coupled(0), values=np.column_stack([u, y]))
    fit = fit_neural_state_space(
        [trace], BOTH, VectorNeuralStateSpace(states=4, neurons=0), Training(max_iterations=20, starts=1), start=FREE
    )
    assert fit.history["mse"][-1] < 1e-18
    begun = beginning(fit.model, u, y, FREE)
    np.testing.assert_allclose(fit.model.simulate(u[begun.first :], begun.history), y[begun.first :], atol=1e-6)


def test_a_noisy_output_does_not_blur_what_a_clean_one_shows(monkeypatch):
    """Both see the same states: fitted alike, the noise of one is followed at the expense of the other."""
    noisy, truth = coupled(0, noise=(0.3, 0.003)), coupled(0)
    network, training = VectorNeuralStateSpace(states=2, neurons=2), Training(max_iterations=60, starts=1)

    def error_of_the_clean_one(rounds: int) -> float:
        monkeypatch.setattr("sysid.estimation.networks.starts.output_weights.ROUNDS", rounds)
        model = fit_neural_state_space([noisy], BOTH, network, training, start=FREE).model
        begun = beginning(model, noisy.columns(["u", "w"]), noisy.columns(["y", "z"]), FREE)
        run = model.simulate(noisy.columns(["u", "w"])[begun.first :], begun.history)
        return float(np.std(run[:, 1] - truth["z"][begun.first :]))

    assert error_of_the_clean_one(3) < 0.1 * error_of_the_clean_one(0)


def test_the_selection_traces_weigh_each_output_by_its_range():
    fit = fit_neural_state_space(
        [coupled(0)],
        BOTH,
        VectorNeuralStateSpace(states=1, neurons=1),
        Training(max_iterations=6, starts=2),
        start=FREE,
        selection=[coupled(1)],
    )
    score = next(one.selection_mse for one in fit.attempts if one.chosen)
    trace = coupled(1)
    begun = beginning(fit.model, trace.columns(["u", "w"]), trace.columns(["y", "z"]), FREE)
    errors = fit.model.simulate(trace.columns(["u", "w"])[begun.first :], begun.history)
    errors -= trace.columns(["y", "z"])[begun.first :]
    each = np.mean((errors / np.array(fit.model.scaling.output_scale)) ** 2, axis=0)
    assert score == pytest.approx(np.exp(np.mean(np.log(each))))


@pytest.mark.parametrize("still", [(3, 4), (3,)], ids=["both", "one"])
def test_outputs_that_never_move_have_a_fit(still):
    trace = coupled(0, n=60)
    values = trace.values.copy()
    values[:, [column - 1 for column in still]] = 2.0
    network, training = VectorNeuralStateSpace(states=2, neurons=2), Training(max_iterations=25, starts=2)
    fit = fit_neural_state_space([replace(trace, values=values)], BOTH, network, training, start=FREE)
    run = fit.model.simulate(trace.columns(["u", "w"]), History.at_rest(inputs=[0.0, 0.0], output=values[0, 2:]))
    for column in still:
        np.testing.assert_allclose(run[:, column - 3], 2.0, atol=1e-3)
