"""Ensembles: one network that is the mean of several, selected where a pick helps."""

from collections import Counter
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import ConfigError
from sysid.estimation import Loop, Status, Training, fit_narx
from sysid.estimation.networks.ensemble import ELIGIBLE, WORTH, elect, united
from sysid.models import NARX, Mapping, NARXModel, Scaling
from sysid.models.lagged.recursion import parameter_count
from sysid.validation import predict_interval
from tests.estimation.tank import TANK
from tests.estimation.tank import tank as record

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


def linear(level: float) -> NARXModel:
    """A network that says the same whatever it is asked."""
    network = NETWORKS["plain"]
    theta = np.zeros(parameter_count(network.lags(2), network.neurons, linear=True))
    theta[network.neurons * (network.lags(2).n_regressors + 2)] = level
    return replace(member(network, 0), theta=theta)


def distance(target: float):
    return lambda model: abs(float(model.recursion.constant) - target) + 1e-6


def test_picks_go_to_whoever_helps_most_and_more_than_once_if_need_be():
    models = [linear(0.0), linear(4.0), linear(9.0)]
    score = distance(4.0 / 3.0)  # (0 + 0 + 4) / 3
    ensemble = elect(models, [score(m) for m in models], score, unite=united, picks=4)
    assert Counter(ensemble.picks) == Counter({0: 2, 1: 1})
    assert ensemble.score == pytest.approx(score(ensemble.model))
    assert ensemble.score < min(score(m) for m in models)


def test_no_pick_is_cast_that_brings_too_little():
    models = [linear(0.0), linear(0.01)]
    score = distance(0.5)
    ensemble = elect(models, [score(m) for m in models], score, unite=united, picks=6)
    assert ensemble.score > (1.0 - WORTH) * score(models[1])
    assert ensemble.picks == {1: 1}


def test_no_more_picks_are_cast_than_there_are():
    models = [linear(0.0), linear(1.0)]
    score = distance(np.pi / 6.0)
    seen = []
    ensemble = elect(models, [score(m) for m in models], score, unite=united, picks=3, on_pick=seen.append)
    assert sum(ensemble.picks.values()) <= 3
    assert seen == list(range(1, 1 + len(seen)))


def test_whoever_makes_it_unstable_is_passed_over_with_all_of_his_start():
    models = [linear(0.0), linear(4.0), linear(4.2), linear(3.0)]
    score = distance(2.0)
    seen = []

    def accept(model):
        seen.append(float(model.recursion.constant))
        return seen[-1] not in {2.0, 2.1}  # with either of the second start

    ensemble = elect(models, [1.0, 2.0, 2.0, 3.0], score, unite=united, picks=2, origins=[0, 1, 1, 2], accept=accept)
    assert ensemble.picks == {0: 1, 3: 1}
    assert 2.1 not in seen  # one refusal is enough
    assert elect(models, [1.0, 2.0, 2.0, 3.0], score, unite=united, picks=2, accept=lambda _: False) is None


def test_a_ensemble_that_passes_is_checked_once():
    models, asked = [linear(0.0), linear(4.0), linear(9.0)], []
    score = distance(4.0 / 3.0)

    def accept(model):
        asked.append(model)
        return True

    ensemble = elect(models, [score(m) for m in models], score, unite=united, picks=3, accept=accept)
    assert sum(ensemble.picks.values()) == 3
    assert asked == [ensemble.model]


def test_the_network_that_was_accepted_is_the_one_that_comes_back():
    models, accepted = [linear(0.0), linear(4.0)], []
    score = distance(2.0)
    ensemble = elect(
        models, [1.0, 2.0], score, unite=united, picks=2, accept=lambda model: accepted.append(model) is None
    )
    assert ensemble.picks == {0: 1, 1: 1}
    assert ensemble.model is accepted[-1]


def test_whoever_diverged_or_is_far_behind_is_not_eligible():
    models = [linear(100.0), *(linear(-float(k)) for k in range(1, ELIGIBLE + 2))]
    scores = [np.nan, *(float(k) for k in range(1, ELIGIBLE + 2))]
    asked = []

    def score(model):
        asked.append(model.recursion.constant)
        return 1.0

    elect(models, scores, score, unite=united, picks=2, workers=2)
    assert len(asked) == ELIGIBLE
    assert min(asked) > -(ELIGIBLE + 1)
    assert max(asked) < 0.0


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


@pytest.mark.parametrize("fields", [{}, {"choose_by": "evidence"}], ids=["nothing to choose by", "by the evidence"])
def test_a_ensemble_needs_traces_that_elect_it(fields):
    selection = [tank(2)] if fields else []
    with pytest.raises(ConfigError, match="nothing can choose the members of an ensemble"):
        fit_narx([tank(1)], TANK, SMALL, Training(ensemble=2, **fields), selection=selection)


def test_one_step_ahead_a_ensemble_is_scored_one_step_ahead():
    training = Training(loop=Loop.OPEN, max_iterations=15, starts=4, ensemble=3)
    fit = fit_narx([tank(1)], TANK, SMALL, training, selection=[tank(2)])
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    error = fit.model.predict(tank(2).columns(["pump"]), tank(2)["level"]) - tank(2)["level"]
    assert chosen.selection_mse == pytest.approx(float(np.mean(error**2)))
