"""Who sits in an ensemble that selection traces elect: forward selection, where a pick helps."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from sysid.estimation.networks.ensemble import united
from sysid.estimation.networks.starts.election import ELIGIBLE, WORTH, elect
from sysid.models import NARXModel
from sysid.models.lagged.recursion import parameter_count
from tests.estimation.networks.test_ensemble import NETWORKS, member


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
