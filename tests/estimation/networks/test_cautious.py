"""A second fit of a short record: where it is made, when it is taken, and what it saves."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sysid.estimation import Training, fit_narx
from sysid.estimation.least_squares.checkpoint import Checkpoint
from sysid.estimation.networks.starts import multistart
from sysid.estimation.networks.starts.cautious import placed
from sysid.estimation.networks.starts.multistart import Place
from sysid.estimation.results.result import FitResult, Loop, Status
from sysid.models import NARX, History, Mapping
from sysid.traces import Trace
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
LARGE = NARX(input_delays=4, output_delays=4, neurons=10)
SMALL = NARX(input_delays=1, output_delays=1, neurons=2)
BRIEF = Training(max_iterations=25)


@dataclass(frozen=True)
class Stub:
    """What is asked of a candidate."""

    solution: Any
    loss: float
    log_evidence: float
    score: float
    outside: int
    place: Place


def recorded(seed: int, noise: float = 0.1, samples: int = 500) -> tuple[Trace, Trace]:
    """A plant of two poles with noise that persists over some five samples, and what follows without any."""
    rng = np.random.default_rng(seed)
    u = np.where(rng.random(2 * samples) < 0.5, -1.0, 1.0)
    y = np.zeros(2 * samples)
    for k in range(2, len(y)):
        y[k] = 1.4 * y[k - 1] - 0.5 * y[k - 2] + 0.1 * u[k - 1]
    colour = np.convolve(rng.standard_normal(2 * samples), 0.8 ** np.arange(20.0))[: 2 * samples]
    measured = y + noise * np.std(y) / np.std(colour) * colour
    return trace_of({"u": u[:samples], "y": measured[:samples]}), trace_of({"u": u[samples:], "y": y[samples:]})


def off(fit: FitResult, after: Trace) -> float:
    """Error of the free run on what follows, over the output's spread."""
    y, begun = after["y"], History(inputs=after.columns(["u"])[:8], output=after["y"][:8])
    return float(np.sqrt(np.mean((fit.model.simulate(after.columns(["u"])[8:], begun) - y[8:]) ** 2)) / np.std(y))


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_short_noisy_record_is_not_learnt_by_heart(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    record, after = recorded(seed)
    training = Training(max_iterations=200)
    fit = fit_narx([record], MAPPING, LARGE, training)
    (chosen,) = (one for one in fit.attempts if one.chosen)
    assert chosen.cautious
    (told,) = (note for note in fit.notes if "The record is short: 500 samples for 109 parameters." in note)
    assert "it was taken, since the smaller error of the other does not pay for the parameters" in told
    assert told.endswith("of three or more (starts: 5) the one in the middle of all is taken.")
    assert off(fit, after) < 0.12
    monkeypatch.setattr(multistart, "SHORT", 0.0)
    once = fit_narx([record], MAPPING, LARGE, training)
    assert not any(one.cautious for one in once.attempts)
    assert off(once, after) > 3.0 * off(fit, after)


def test_a_record_without_noise_is_followed_whichever_of_both_is_taken():
    rng = np.random.default_rng(0)
    u, y = np.repeat(rng.uniform(-1.0, 1.0, 30), 10), np.zeros(300)
    for k in range(1, 300):
        y[k] = 0.9 * y[k - 1] + 0.2 * np.tanh(2.0 * u[k - 1])
    fit = fit_narx([trace_of({"u": u, "y": y})], MAPPING, LARGE, Training(max_iterations=60))
    (chosen,) = (one for one in fit.attempts if one.chosen)
    assert {one.cautious for one in fit.attempts} == {False, True}
    assert chosen.estimation_mse <= 4.0 * min(one.estimation_mse for one in fit.attempts)
    assert chosen.estimation_mse < 1e-4 * np.var(y)


@pytest.mark.parametrize(
    ("loss", "gamma", "tau", "place"),
    [
        (1.0, 20.0, 5.0, Place.FIRST),  # as close with fewer parameters
        (4.0, 20.0, 5.0, Place.LAST),  # 100 ln 4 = 139 against 20 ln 100 = 92
        (2.0, 20.0, 5.0, Place.FIRST),  # 100 ln 2 = 69 against 92
        (2.0, 20.0, 1.0, Place.LAST),  # 500 ln 2 = 347 against 20 ln 500 = 124
        (np.inf, 20.0, 5.0, Place.LAST),
        (0.0, 60.0, 5.0, Place.FIRST),
    ],
)
def test_a_closer_fit_pays_for_the_parameters_that_it_has_more(
    loss: float, gamma: float, tau: float, place: Place
) -> None:
    def candidate(loss: float, gamma: float, tau: float) -> Stub:
        evidence = SimpleNamespace(total_effective_parameters=gamma, correlation_time=tau)
        solution = SimpleNamespace(evidence=evidence, status=Status.CONVERGED)
        known = {"loss": loss, "log_evidence": 0.0, "score": np.nan, "outside": 0, "place": Place.BY_EVIDENCE}
        return Stub(solution=solution, **known)

    assert placed(candidate(loss, gamma, tau), [candidate(1.0, 40.0, 1.1)], 500).place is place


def test_selection_traces_choose_between_both():
    (record, after), (other, _) = recorded(3), recorded(7)
    fit = fit_narx([record], MAPPING, LARGE, Training(max_iterations=100), selection=[other, after])
    (chosen,) = (one for one in fit.attempts if one.chosen)
    assert len({one.cautious for one in fit.attempts}) == 2
    assert chosen.selection_mse == min(one.selection_mse for one in fit.attempts)
    (told,) = (note for note in fit.notes if "cautious" in note)
    assert ("it was taken, by its error on the selection traces" in told) == chosen.cautious


def test_starts_that_a_cautious_fit_outdid_are_ranked_by_the_evidence_and_it_is_not():
    fit = fit_narx([recorded(6)[0]], MAPPING, LARGE, Training(max_iterations=100, starts=2))
    (chosen,) = (one for one in fit.attempts if one.chosen)
    assert chosen.cautious
    assert chosen.log_evidence < max(one.log_evidence for one in fit.attempts)
    looks = len(fit.attempts) - 1
    assert f"Ranked by the largest evidence among 2 starts looked at {looks} times." in fit.notes


@pytest.mark.parametrize(
    ("network", "training"),
    [
        (SMALL, BRIEF),
        (LARGE, Training(max_iterations=25, regularisation=0.01)),
        (LARGE, Training(max_iterations=25, loop=Loop.OPEN)),
    ],
    ids=["long", "weighed from outside", "one step ahead"],
)
def test_it_is_made_of_short_records_in_free_run_alone(network: NARX, training: Training) -> None:
    fit = fit_narx([recorded(3)[0]], MAPPING, network, training)
    assert not any(one.cautious for one in fit.attempts)
    assert not any("short" in note for note in fit.notes)


def test_a_fit_that_goes_on_ends_where_one_in_a_single_run_does():
    record, kept = recorded(3)[0], list[Checkpoint]()
    whole = fit_narx([record], MAPPING, LARGE, Training(max_iterations=40))
    fit_narx([record], MAPPING, LARGE, Training(max_iterations=25), on_checkpoint=kept.append)
    further = fit_narx([record], MAPPING, LARGE, Training(max_iterations=40), resume=kept[-1])
    np.testing.assert_array_equal(further.model.theta, whole.model.theta)


def test_a_fit_that_goes_on_from_a_given_one_is_made_once():
    record = recorded(3)[0]
    first = fit_narx([record], MAPPING, LARGE, BRIEF)
    further = fit_narx([record], MAPPING, LARGE, BRIEF, initial=first)
    assert not any(one.cautious for one in further.attempts)
