"""Ensembles of neural state spaces: who sits in them, what they compute, and how well they say they know."""

from dataclasses import replace

import numpy as np
import pytest

from sysid.errors import ConfigError
from sysid.estimation import Training, fit_neural_state_space
from sysid.estimation.networks.starts.halving import planned_iterations
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import Loop
from sysid.models import History, Mapping, NeuralStateSpace, Start, VectorNeuralStateSpace, model_from_dict
from sysid.validation import predict_interval
from tests.estimation.networks.test_neural_state_space import MAPPING, a_trace, hidden_saturation
from tests.estimation.tank import TANK, tank

SMALL = NeuralStateSpace(states=1, neurons=3)
BY_EVIDENCE = Training(max_iterations=40, starts=5, ensemble=4, workers=1)


def noisy(seed: int, n: int = 300):
    trace = tank(seed, n)
    values = trace.values + [0.0, 0.02] * np.random.default_rng(seed).standard_normal((n, 2))
    return replace(trace, values=values)


@pytest.fixture(scope="module")
def fit():
    return fit_neural_state_space([noisy(1)], TANK, SMALL, BY_EVIDENCE)


def members_of(model):
    return [replace(model, theta=one.theta, shares=(1,)) for one in model.recursion.members]


def test_its_run_is_the_mean_of_those_of_the_starts_that_it_unites(fit):
    u = tank(7).columns(["pump"])
    runs = [one.simulate(u) for one in members_of(fit.model)]
    assert 2 <= len(runs) == len(fit.model.shares) <= BY_EVIDENCE.ensemble
    np.testing.assert_allclose(fit.model.simulate(u), np.mean(runs, axis=0), atol=1e-12)
    assert fit.model.n_parameters == len(runs) * SMALL.sizes(1).count
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    assert len(set(chosen.members)) == len(runs)
    assert f"the mean of {len(runs)} free runs as one model" in fit.notes[-1]
    assert fit.status.usable


def test_its_error_on_the_records_is_that_of_its_free_run(fit):
    error = np.mean((fit.model.simulate(noisy(1).columns(["pump"])) - noisy(1)["level"]) ** 2)
    # a record at rest begins there in the fit as in the run
    assert fit.history["mse"][-1] == pytest.approx(error, rel=1e-6)


def test_every_start_that_it_may_unite_is_trained_to_its_end(fit):
    longest = {}
    for attempt in fit.attempts:
        longest[attempt.start] = max(longest.get(attempt.start, 0), attempt.iterations)
    alone = fit_neural_state_space([noisy(1)], TANK, SMALL, replace(BY_EVIDENCE, ensemble=1))
    ends = [a for a in fit.attempts if a.iterations == BY_EVIDENCE.max_iterations or a.status == "CONVERGED"]
    assert len({a.start for a in ends if not a.members}) >= BY_EVIDENCE.ensemble
    assert len({a.start for a in alone.attempts if a.iterations == BY_EVIDENCE.max_iterations}) == 1
    assert planned_iterations(BY_EVIDENCE, 4) > planned_iterations(BY_EVIDENCE)


def test_its_interval_has_the_members_own_and_what_lies_between_them(fit):
    trace = tank(3)
    u, at_rest = trace.columns(["pump"]), History.at_rest(inputs=trace.columns(["pump"])[0], output=0.0)
    experiment = Experiment(inputs=u, output=trace["level"], history=at_rest)
    runs = np.array([one.simulate(u, at_rest) for one in members_of(fit.model)])
    total = fit.posterior.parameter_variance(fit.model, experiment, Loop.CLOSED)
    n = len(runs)
    own = replace(fit.posterior, factor=fit.posterior.factor[:, :-n])
    between = total - own.parameter_variance(fit.model, experiment, Loop.CLOSED)
    np.testing.assert_allclose(between, runs.var(axis=0), rtol=1e-4, atol=1e-9)
    assert fit.evidence is None
    assert predict_interval(fit, tank(3), level=0.95).coverage(tank(3)["level"]).share > 0.5


def test_the_same_ensemble_comes_whatever_the_number_of_workers(fit):
    again = fit_neural_state_space([noisy(1)], TANK, SMALL, replace(BY_EVIDENCE, workers=2))
    np.testing.assert_array_equal(again.model.theta, fit.model.theta)


def test_selection_traces_elect_it():
    selection = [noisy(2), noisy(5)]
    fit = fit_neural_state_space([noisy(1)], TANK, SMALL, BY_EVIDENCE, selection=selection)
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    single = [attempt.selection_mse for attempt in fit.attempts if not attempt.members]
    assert chosen.members
    assert sum(fit.model.shares) == len(chosen.members) <= BY_EVIDENCE.ensemble
    assert chosen.selection_mse < min(single)
    errors = [fit.model.simulate(one.columns(["pump"])) - one["level"] for one in selection]
    assert chosen.selection_mse == pytest.approx(np.exp(np.mean([np.log(np.mean(e**2)) for e in errors])))


def test_an_ensemble_that_is_not_stable_gives_way_to_the_best_single_start():
    training = replace(BY_EVIDENCE, max_iterations=15)
    fit = fit_neural_state_space([noisy(1)], TANK, SMALL, training, vet=lambda model: len(model.shares) == 1)
    assert fit.model.shares == (1,)
    assert "was not taken: its free run is not stable" in fit.notes[-1]


def test_a_start_that_runs_away_by_itself_is_no_member(fit):
    lost = members_of(fit.model)[0].theta
    again = fit_neural_state_space(
        [noisy(1)], TANK, SMALL, BY_EVIDENCE,
        vet=lambda model: len(model.shares) > 1 or not np.array_equal(model.theta, lost),
    )  # fmt: skip
    assert all(not np.array_equal(one.theta, lost) for one in members_of(again.model))
    assert "Left out, as their own free run is not stable: start" in again.notes[-1]


def test_a_fit_may_begin_with_an_ensemble(fit):
    again = fit_neural_state_space(
        [noisy(1)], TANK, SMALL, Training(max_iterations=1, starts=1), initial=model_only(fit)
    )
    assert again.history["mse"][0] == pytest.approx(
        np.mean((members_of(fit.model)[0].simulate(noisy(1).columns(["pump"])) - noisy(1)["level"]) ** 2), rel=1e-4
    )


def model_only(fit):
    return replace(fit, model=model_from_dict(fit.model.to_dict()))


def test_members_of_an_absolute_value_are_turned_to_one_sign():
    def rectified(seed):
        trace = hidden_saturation(seed, 300)
        return a_trace(trace.name, trace.columns(["u"])[:, 0], np.abs(trace["y"]))

    network = NeuralStateSpace(states=2, neurons=3, output="absolute")
    training = Training(max_iterations=60, starts=6, ensemble=4, workers=1)
    fit = fit_neural_state_space([rectified(1)], MAPPING, network, training)
    u = rectified(1).columns(["u"])
    form = fit.model.recursion
    signed = [
        replace(one, rectified=False).run(form.scaled(u), one.state(History.at_rest(inputs=u[0], output=0.0)))
        for one in form.members
    ]
    assert len(signed) > 1
    assert all(np.sum(one * signed[0]) > 0.0 for one in signed)
    errors = [np.mean((one.simulate(u) - rectified(1)["y"]) ** 2) for one in (fit.model, *members_of(fit.model))]
    assert errors[0] < np.mean(errors[1:])


def test_of_several_outputs_there_is_one_too():
    def two(seed):
        one = noisy(seed)
        values = np.column_stack([one.values, 0.5 * one["level"] ** 2])
        return replace(one, channels=(*one.channels, replace(one.channels[1], name="flow")), values=values)

    mapping = Mapping(inputs=("pump",), outputs=("level", "flow"))
    network = VectorNeuralStateSpace(states=1, neurons=3)
    training = Training(max_iterations=12, starts=3, ensemble=3, workers=1)
    fit = fit_neural_state_space([two(1)], mapping, network, training)
    u = two(2).columns(["pump"])
    runs = [one.simulate(u) for one in members_of(fit.model)]
    assert len(runs) > 1
    np.testing.assert_allclose(fit.model.simulate(u), np.mean(runs, axis=0), atol=1e-12)
    assert fit.posterior is None or fit.posterior.factor.shape[0] == fit.model.n_parameters


def test_more_members_than_starts_are_refused():
    with pytest.raises(ConfigError, match="more members than there are starts"):
        fit_neural_state_space([tank(1)], TANK, SMALL, Training(starts=2, ensemble=3), start=Start())
