"""The start of a short record that is taken: the one in the middle of all, on inputs that nobody measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.estimation import Loop, Training, fit_narx
from sysid.estimation.networks.middle import most_iterations
from sysid.estimation.networks.starts.halving import planned_iterations
from sysid.models import NARX
from tests.estimation.networks.test_cautious import MAPPING, SMALL, recorded
from tests.traces.made import trace_of

MEDIUM = NARX(input_delays=2, output_delays=2, neurons=5)
FOUR = Training(max_iterations=40, starts=4, workers=1)
RECORD = recorded(5, samples=300)[0]


@pytest.fixture(scope="module")
def fit():
    return fit_narx([RECORD], MAPPING, MEDIUM, FOUR)


def test_all_starts_come_to_their_end_and_each_is_fitted_cautiously_too(fit):
    assert {attempt.start for attempt in fit.attempts if attempt.cautious} == {1, 2, 3, 4}
    ends = {}
    for attempt in fit.attempts:
        if not attempt.cautious:
            ends[attempt.start] = attempt
    assert all(attempt.status == "CONVERGED" or attempt.iterations == 40 for attempt in ends.values())


def test_the_one_is_taken_that_is_nearest_to_the_middle(fit):
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    away = [attempt.away for attempt in fit.attempts if np.isfinite(attempt.away)]
    assert chosen.away == min(away)
    assert 3 <= len(away) <= 4  # who is far behind does not take part
    (told,) = (note for note in fit.notes if "among 4 starts" in note)
    assert told.startswith("Chosen by the least distance from the middle of all on the records' inputs backwards")
    (told,) = (note for note in fit.notes if "cautious" in note)
    assert (
        "So a second, cautious fit was made, which counts errors that persist as fewer samples, of each of 4 starts"
        in told
    )


def test_it_is_the_same_whatever_the_number_of_workers(fit):
    again = fit_narx([RECORD], MAPPING, MEDIUM, replace(FOUR, workers=2))
    np.testing.assert_array_equal(again.model.theta, fit.model.theta)


def test_who_runs_away_gives_way_to_the_next(fit):
    (first,) = (attempt for attempt in fit.attempts if attempt.chosen)
    other = fit_narx(
        [RECORD], MAPPING, MEDIUM, FOUR, vet=lambda model: not np.array_equal(model.theta, fit.model.theta)
    )
    (chosen,) = (attempt for attempt in other.attempts if attempt.chosen)
    later = sorted(attempt.away for attempt in other.attempts if np.isfinite(attempt.away))
    assert first.away == later[0]
    assert chosen.away == later[1]


@pytest.mark.parametrize(
    ("network", "training"),
    [
        (SMALL, replace(FOUR, max_iterations=20)),
        (MEDIUM, replace(FOUR, max_iterations=20, starts=2)),
        (MEDIUM, replace(FOUR, max_iterations=20, choose_by="evidence")),
    ],
    ids=["long", "two starts", "by the evidence"],
)
def test_elsewhere_the_evidence_chooses(network: NARX, training: Training) -> None:
    fit = fit_narx([RECORD], MAPPING, network, training)
    assert all(np.isnan(attempt.away) for attempt in fit.attempts)
    assert any("by the largest evidence" in note for note in fit.notes)


def test_without_noise_the_middle_of_those_that_miss_it_is_not_taken():
    rng = np.random.default_rng(0)
    u, y = np.repeat(rng.uniform(-1.0, 1.0, 30), 10), np.zeros(300)
    for k in range(1, 300):
        y[k] = 0.9 * y[k - 1] + 0.2 * np.tanh(2.0 * u[k - 1])
    fit = fit_narx([trace_of({"u": u, "y": y})], MAPPING, MEDIUM, replace(FOUR, starts=5))
    (chosen,) = (attempt for attempt in fit.attempts if attempt.chosen)
    assert chosen.estimation_mse <= 4.0 * min(attempt.estimation_mse for attempt in fit.attempts)


def test_what_all_of_it_takes_is_told_before():
    training = Training(max_iterations=100, starts=4)
    lagged = {"n_samples": 300, "n_parameters": 31, "unites": True, "twice": True}
    assert most_iterations(training, selects=False, **lagged) == 800.0  # four to their end, twice
    assert most_iterations(training, selects=True, **lagged) == planned_iterations(training) + 100.0  # the best again
    assert most_iterations(training, selects=False, **(lagged | {"n_samples": 3000})) == planned_iterations(training)
    united = replace(training, ensemble=3, choose_by="evidence")
    assert most_iterations(united, selects=True, **lagged) == planned_iterations(united, 3) + 300.0
    hidden = lagged | {"twice": False}
    assert most_iterations(replace(training, ensemble=3), selects=True, **hidden) == planned_iterations(training, 3)
    for other in (replace(training, regularisation=0.1), replace(training, loop=Loop.OPEN)):
        assert most_iterations(other, selects=False, **lagged) == planned_iterations(training)


def test_as_many_iterations_are_made_as_were_told(fit):
    ends = {}
    for attempt in fit.attempts:
        ends[attempt.start, attempt.cautious] = attempt.iterations
    told = most_iterations(
        FOUR, n_samples=300, n_parameters=fit.model.n_parameters, selects=False, unites=True, twice=True
    )
    assert sum(ends.values()) <= told
    assert len(ends) * FOUR.max_iterations == told
