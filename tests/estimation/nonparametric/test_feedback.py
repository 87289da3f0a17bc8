"""Feedback from the output to the inputs is found, and what is built on a record in closed loop heeds it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.advice import Verdict
from sysid.estimation.nonparametric import feedback
from sysid.estimation.nonparametric.evidence import Triangle, triangle
from sysid.estimation.nonparametric.feedback import EXACT, find_feedback
from sysid.estimation.nonparametric.memory import Memory
from sysid.estimation.nonparametric.segments import Segment

GAIN, POLE = 0.5, 0.8
N = 1000


def closed_loop(seed: int, *, reference: bool = True, dead: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """``x(k) = 0.8 x(k-1) + 0.5 u(k-dead)``, ``y = x + e``, and ``u = (r - y) / dead`` within the sample."""
    rng = np.random.default_rng(seed)
    e = 0.5 * rng.standard_normal(N)
    r = np.repeat(rng.choice([-1.0, 1.0], N // 10), 10) if reference else np.zeros(N)
    u, y, x = np.zeros(N), np.zeros(N), 0.0
    for k in range(N):
        x = POLE * x + (GAIN * u[k - dead] if k >= dead else 0.0)
        y[k] = x + e[k]
        u[k] = (r[k] - y[k]) / dead
    return u, y


def found(u: np.ndarray, y: np.ndarray) -> object:
    return find_feedback([Segment(inputs=u[:, None], output=y)])


@pytest.mark.parametrize("seed", range(3))
def test_a_controller_within_the_sample_is_found_and_its_plant_alone_is_not(seed: int) -> None:
    u, y = closed_loop(seed)
    assert found(u, y).at_once
    # The same input, other noise.
    free = lfilter([0.0, GAIN], [1.0, -POLE], u) + 0.5 * np.random.default_rng([1, seed]).standard_normal(N)
    assert not found(u, free).found


def test_a_loop_that_nothing_else_moves_is_no_plant_without_noise() -> None:
    assert found(*closed_loop(0, reference=False)) == EXACT
    u = np.random.default_rng(0).standard_normal(N)
    assert found(u, lfilter([0.0, GAIN], [1.0, -POLE], u)) == "the output follows from its past without a rest"


@pytest.mark.parametrize("dead", [1, 5])
def test_an_impulse_response_in_closed_loop_is_the_plants(dead: int) -> None:
    response = sysid.impulse_response(sysid.data(closed_loop(1, dead=dead), sample_time=1.0), "u -> y")
    assert response.dead_times[0].best == dead
    assert response.lags[0] == 1
    step, deviation = response.step()
    assert abs(step[0, -1] - GAIN / (1.0 - POLE)) < 3.0 * deviation[0, -1]
    assert any("closed loop" in note for note in response.notes)


def test_what_is_suggested_in_closed_loop_begins_at_lag_1() -> None:
    traces = sysid.data(closed_loop(2), sample_time=1.0)
    advice = sysid.advise(traces, "u -> y")
    assert next(one for one in advice.findings if one.code.startswith("feedback")).verdict is Verdict.LOOK
    assert all(min(getattr(one.structure, "nk", (1,))) >= 1 for one in advice.suggestions)
    orders = sysid.search_orders(traces, "u -> y", max_na=3, max_nb=3, max_nk=2)
    assert orders.best().nk[0] >= 1
    assert any("closed loop" in note for note in orders.notes)


STRUCTURES = {
    "at once": (sysid.OE(nb=2, nf=1, nk=0), "read backwards"),
    "free run": (sysid.OE(nb=1, nf=1, nk=1), "takes the noise for white"),
    "one step": (sysid.ARX(na=2, nb=2, nk=1), "as far as its model of the noise"),
}


@pytest.mark.parametrize("structure,said", STRUCTURES.values(), ids=STRUCTURES)
def test_a_fit_to_a_closed_loop_says_what_that_does_to_it(structure: object, said: str) -> None:
    u, y = closed_loop(3)
    told = sysid.fit(sysid.data((u, y), sample_time=1.0), "u -> y", structure).warnings
    assert [note for note in told if "closed loop" in note and said in note]
    assert not [note for note in told if "acts at once, which" in note or "fed back" in note]
    free = lfilter([0.0, GAIN], [1.0, -POLE], u) + 0.5 * np.random.default_rng([1, 3]).standard_normal(N)
    told = sysid.fit(sysid.data((u, free), sample_time=1.0), "u -> y", structure).warnings
    assert not [note for note in told if "closed loop" in note]


def test_a_strong_controller_that_a_test_signal_moves_more_is_told_beside_a_biased_fit() -> None:
    rng = np.random.default_rng(3)
    noise, dither = lfilter([0.02], [1.0, -0.9], rng.standard_normal((2, N))), rng.standard_normal(N)
    u, y, x, total = np.zeros(N), np.zeros(N), 0.0, 0.0
    for k in range(N):
        x = 0.9 * x + (0.1 * u[k - 1] if k else 0.0)
        y[k] = x + noise[0, k]
        total += 0.5 * y[k]
        u[k] = dither[k] - 5.0 * y[k] - total
    fit = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y", sysid.OE(nb=1, nf=1, nk=1))
    assert any("closed loop" in note for note in fit.warnings)


def test_the_same_stretches_are_asked_once_and_each_input_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """All inputs are asked of one factor: a second one that is not set from the output changes nothing of the first."""
    made = list[int]()

    def counted(blocks: list[np.ndarray], **options: int) -> Triangle:
        made.append(blocks[0].shape[1])
        return triangle(blocks, **options)

    monkeypatch.setattr(feedback, "triangle", counted)
    monkeypatch.setattr(feedback, "_memory", Memory(4))
    u, y = closed_loop(0)
    other = np.random.default_rng(9).standard_normal((N, 2))
    one, three = found(u, y), find_feedback([Segment(inputs=np.column_stack([other, u]), output=y)])
    assert one.at_once and three.at_once
    assert three.share_at_once == pytest.approx(one.share_at_once, rel=0.1)
    assert len(made) == 4
    assert found(u, y) is one
    assert len(made) == 4


@pytest.mark.parametrize("seed", [7, 8, 10])
def test_two_inputs_that_step_on_one_beat_are_no_loop(seed: int) -> None:
    """Each moves some 40 times: of a heater with a fan it was said that its temperature acts on both."""
    rng, n, x, y = np.random.default_rng(seed), 1800, 20.0, list[float]()
    power = np.repeat(rng.uniform(10.0, 90.0, n // 40 + 1), 40)[:n]
    fan = np.repeat(rng.choice([0.2, 0.5, 1.0], n // 60 + 1), 60)[:n]
    for k in range(n):
        x += 2.0 * (0.02 * power[max(k - 6, 0)] - (0.004 + 0.012 * fan[k]) * (x - 20.0)) / 1.5
        y.append(x)
    u, noisy, at = np.column_stack([power, fan]), np.array(y) + 0.15 * rng.standard_normal(n), np.arange(n) // (n // 16)
    for fold in range(4):  # as a search leaves out one block of four
        kept = [np.flatnonzero((at >= low) & (at < low + 3)) for low in range(fold - 3, 16, 4)]
        parts = [Segment(inputs=u[one], output=noisy[one]) for one in kept if len(one)]
        result = find_feedback(parts)
        assert isinstance(result, feedback.Feedback)
        assert not result.found
