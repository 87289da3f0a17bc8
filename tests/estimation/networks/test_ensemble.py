"""Ensembles: one network that is the mean of several, selected where a pick helps."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError
from sysid.estimation import Loop, Status, Training, fit_narx
from sysid.estimation.networks.ensemble import united
from sysid.estimation.networks.starts.election import WORTH
from sysid.models import NARX, Mapping, NARXModel, Scaling, VectorNARX
from sysid.models.lagged.recursion import parameter_count
from sysid.validation import predict_interval
from tests.estimation.tank import TANK
from tests.estimation.tank import tank as record
from tests.traces.made import trace_of

MAPPING = Mapping(inputs=("u", "w"), output="y")
NETWORKS = {
    "plain": NARX(input_delays="0:1", output_delays="1:2", neurons=3),
    "gated": NARX(input_delays=[[0, 1], [2]], output_delays=[1, 4], neurons=2, gated=True),
    "without feedthrough": NARX(input_delays=1, output_delays=1, neurons=4, feedthrough=False),
}
tank = partial(record, n=400)
SMALL = NARX(input_delays=1, output_delays=1, neurons=3, gated=True)
PLAIN = NARX(input_delays=1, output_delays=1, neurons=4)
ELECTION = Training(max_iterations=120, starts=6, ensemble=4)


def member(network: NARX, seed: int, size: float = 0.2) -> NARXModel:
    count = parameter_count(network.lags(2), network.neurons, linear=network.feedthrough, gated=network.gated)
    ranges = [np.array([[-1.0, 0.0], [3.0, 5.0]])], [np.array([-2.0, 2.0])]
    return NARXModel(
        network=network,
        theta=size * np.random.default_rng(seed).standard_normal(count),
        scaling=Scaling.to_unit_range(*ranges),
        mapping=MAPPING,
        sample_time=0.1,
        input_units=("1", "1"),
        output_unit="1",
        rest_output=0.0,
        clamp=np.inf,
    )


@pytest.mark.parametrize("network", NETWORKS.values(), ids=NETWORKS)
@given(picks=st.lists(st.integers(1, 5), min_size=1, max_size=4), seed=st.integers(0, 1000))
def test_the_united_network_predicts_the_mean_of_its_members_by_their_picks(network, picks, seed):
    members = [member(network, seed + k) for k in range(len(picks))]
    rng = np.random.default_rng(seed)
    inputs, output = rng.uniform(-1.0, 3.0, (30, 2)), rng.uniform(-2.0, 2.0, 30)
    whole = united(members, picks)
    expected = np.average([m.predict(inputs, output) for m in members], axis=0, weights=picks)
    np.testing.assert_allclose(whole.predict(inputs, output), expected, atol=1e-12)
    assert whole.network.neurons == len(picks) * network.neurons


def test_a_network_united_with_itself_runs_as_it_does_alone():
    alone = member(NETWORKS["gated"], 3)
    inputs = np.random.default_rng(0).uniform(0.0, 2.0, (200, 2))
    np.testing.assert_allclose(united([alone, alone], [1, 2]).simulate(inputs), alone.simulate(inputs), atol=1e-12)
    assert united([alone], [7]) is alone


@pytest.fixture(scope="module")
def fit():
    return fit_narx([tank(9)], TANK, PLAIN, ELECTION, selection=[tank(2), tank(5)])


def test_a_ensemble_does_better_on_the_selection_traces_than_any_of_its_members(fit):
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    single = [attempt.selection_mse for attempt in fit.attempts if not attempt.members]
    assert chosen.members
    assert chosen.selection_mse < (1.0 - WORTH) * min(single)
    inputs = [trace.columns(["pump"]) for trace in (tank(2), tank(5))]
    errors = [fit.model.simulate(u) - t["level"] for u, t in zip(inputs, (tank(2), tank(5)), strict=True)]
    assert chosen.selection_mse == pytest.approx(np.exp(np.mean([np.log(np.mean(e**2)) for e in errors])))
    # a start may sit in it twice, as it was at two looks
    assert fit.model.network.neurons in {k * PLAIN.neurons for k in range(2, len(chosen.members) + 1)}
    assert "ensemble" in fit.notes[1]


def test_a_ensemble_has_evidence_a_posterior_and_a_learning_curve_of_its_own(fit):
    error = float(np.mean((fit.model.simulate(tank(9).columns(["pump"])) - tank(9)["level"]) ** 2))
    assert 0.0 < fit.evidence.total_effective_parameters <= fit.model.n_parameters
    assert fit.posterior.covariance.shape == (fit.model.n_parameters,) * 2
    assert predict_interval(fit, tank(3), level=0.95).coverage(tank(3)["level"]).share > 0.5
    assert fit.history["mse"][-1] == pytest.approx(error)
    assert fit.status.usable


def test_the_same_ensemble_is_selected_again_whatever_the_number_of_workers(fit):
    again = fit_narx([tank(9)], TANK, PLAIN, replace(ELECTION, workers=1), selection=[tank(2), tank(5)])
    np.testing.assert_array_equal(again.model.theta, fit.model.theta)


def test_a_ensemble_that_is_not_stable_gives_way_to_the_best_single_start():
    asked = []

    def alone(model) -> bool:
        asked.append(model.network.neurons)
        return model.network.neurons == PLAIN.neurons

    fit = fit_narx([tank(9)], TANK, PLAIN, ELECTION, selection=[tank(2), tank(5)], vet=alone)
    assert max(asked) > PLAIN.neurons
    assert fit.model.network == PLAIN
    assert not any(attempt.members for attempt in fit.attempts)


def test_an_interruption_of_the_election_leaves_the_best_single_start():
    def pick(progress) -> None:
        if progress.stage == "pick 2 of 4":
            raise KeyboardInterrupt

    fit = fit_narx([tank(9)], TANK, PLAIN, ELECTION, selection=[tank(2), tank(5)], on_progress=pick)
    assert fit.status is Status.INTERRUPTED
    assert fit.model.network == PLAIN
    assert fit.model.simulate(tank(2).columns(["pump"])) == pytest.approx(tank(2)["level"], abs=0.1)


def test_a_fixed_regularisation_leaves_a_ensemble_without_evidence():
    training = Training(max_iterations=10, starts=3, ensemble=3, regularisation=1e-6)
    fit = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)])
    assert (fit.evidence, fit.posterior) == (None, None)


@pytest.fixture(scope="module")
def unelected():
    return fit_narx([tank(9)], TANK, PLAIN, Training(max_iterations=60, ensemble=4, workers=1))


def test_without_selection_traces_the_starts_that_stand_together_are_united_alike(unelected):
    (whole,) = (attempt for attempt in unelected.attempts if attempt.members)
    assert whole.chosen
    assert len(set(whole.members)) == len(whole.members) >= 2
    assert unelected.model.network.neurons == len(whole.members) * PLAIN.neurons
    assert {attempt.start for attempt in unelected.attempts if not attempt.members} == set(range(1, 7))  # two to spare
    (told,) = (note for note in unelected.notes if "An ensemble: the mean of" in note)
    assert f"{len(whole.members)} times the neurons of one" in told
    inputs, output = tank(3).columns(["pump"]), tank(3)["level"]
    assert np.sqrt(np.mean((unelected.model.simulate(inputs) - output) ** 2)) < 0.1 * np.std(output)


def test_every_start_that_it_may_unite_is_trained_to_its_end(unelected):
    ends = {}
    for attempt in unelected.attempts:
        if not attempt.members and not attempt.cautious:
            ends[attempt.start] = (attempt.status, attempt.iterations)
    assert sum(status == "CONVERGED" or iterations == 60 for status, iterations in ends.values()) >= 4


def test_the_same_ensemble_is_united_again_whatever_the_number_of_workers(unelected):
    again = fit_narx([tank(9)], TANK, PLAIN, Training(max_iterations=60, ensemble=4, workers=2))
    np.testing.assert_array_equal(again.model.theta, unelected.model.theta)


def test_by_the_evidence_it_is_united_beside_selection_traces_too():
    training = Training(max_iterations=15, starts=3, ensemble=3, choose_by="evidence")
    fit = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)])
    (whole,) = (attempt for attempt in fit.attempts if attempt.members)
    assert whole.chosen
    assert len(set(whole.members)) == len(whole.members)


def test_a_start_that_runs_away_by_itself_is_no_member():
    refused = []

    def vet(model) -> bool:
        refused.append(model) if not refused else None
        return model is not refused[0]

    training = Training(max_iterations=15, starts=4, ensemble=3)
    fit = fit_narx([tank(1)], TANK, SMALL, training, vet=vet)
    (whole,) = (attempt for attempt in fit.attempts if attempt.members)
    (told,) = (note for note in fit.notes if "An ensemble: the mean of" in note)
    assert "as their own free run" in told
    assert len(whole.members) < 4


def test_more_members_than_starts_are_refused_where_nobody_is_elected_twice():
    with pytest.raises(ConfigError, match="more members than there are starts"):
        fit_narx([tank(1)], TANK, SMALL, Training(starts=2, ensemble=3))


def test_of_several_outputs_there_is_one_too():
    rng = np.random.default_rng(2)
    u, y, z = np.repeat(rng.uniform(-1.0, 1.0, 60), 10), np.zeros(600), np.zeros(600)
    for k in range(1, 600):
        y[k] = 0.8 * y[k - 1] + 0.2 * np.tanh(2.0 * u[k - 1]) + 0.05 * z[k - 1]
        z[k] = 0.9 * z[k - 1] + 0.1 * y[k - 1]
    trace = trace_of({"u": u, "y": y, "z": z})
    network = VectorNARX(input_delays=1, output_delays=1, neurons=3)
    fit = fit_narx([trace], Mapping.parse("u -> y+z"), network, Training(max_iterations=30, ensemble=3))
    (whole,) = (attempt for attempt in fit.attempts if attempt.members)
    assert fit.model.network.neurons == 3 * len(whole.members)
    assert np.abs(fit.model.simulate(trace.columns(["u"])) - trace.columns(["y", "z"])).max() < 0.2


def test_one_step_ahead_a_ensemble_is_scored_one_step_ahead():
    training = Training(loop=Loop.OPEN, max_iterations=15, starts=4, ensemble=3)
    fit = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)])
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    error = fit.model.predict(tank(2).columns(["pump"]), tank(2)["level"]) - tank(2)["level"]
    assert chosen.selection_mse == pytest.approx(float(np.mean(error**2)))
