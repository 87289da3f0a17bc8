"""The look at data first: what is in a record is said, what is not is not, and what cannot be said is said to be so."""

from __future__ import annotations

import ast
import re
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

import sysid.advice
from sysid.advice import Topic, Verdict, advise
from sysid.errors import ChannelError
from sysid.excitation import KINDS, excite
from sysid.models import ARX, NARX, Mapping, TransferFunction
from sysid.reporting.advice.sentences import SAID
from sysid.reporting.advice.words import said
from sysid.traces import Role, TraceSet
from tests.advice.looks import Array, codes, finding, look, looks, noise, plant, steps, trace


@pytest.mark.parametrize("seed", range(4))
def test_a_good_linear_record_has_nothing_to_look_at(seed: int) -> None:
    u = steps(1500, seed)
    coloured = lfilter([1.0], [1.0, -0.6], noise(1500, seed, 0.02))
    found = look(trace(u, plant(u) + coloured))
    assert looks(found) == set()
    assert {one.topic for one in found.findings} == set(Topic)
    assert finding(found, "dead_time", "u1").figures["best"] == 2
    settled = finding(found, "settling", "u1").figures
    assert settled["gain"] == pytest.approx(1.5, abs=0.05)
    assert 10 <= settled["samples"] <= 22
    assert finding(found, "feedback.none").figures["p"] > 1e-5
    assert any(isinstance(one.structure, ARX) for one in found.suggestions)
    assert not any(isinstance(one.structure, NARX) for one in found.suggestions)


def test_an_input_settles_beside_one_that_does_not() -> None:
    """Beside a slow one every input had been said not to settle."""
    slow, quick = np.cumsum(noise(1200, 3, 0.2)) + steps(1200, 4), (noise(1200, 5, 1.0) > 1.5).astype(float)
    other = steps(1200, 6)
    y = lfilter([0.0, 0.033], [1.0, -0.967], slow) + lfilter([0.0, -1.5], [1.0, -0.6], quick)
    y += lfilter([0.0, 0.26], [1.0, -0.88], other) + noise(1200, 7, 0.05)
    found = look(trace(np.column_stack([slow, quick, other]), y), mapping="u1+u2+u3 -> y")
    assert finding(found, "settling.never", "u1").verdict is Verdict.LOOK
    assert finding(found, "settling", "u2").figures["gain"] == pytest.approx(-3.75, rel=0.05)
    assert finding(found, "settling", "u3").figures["gain"] == pytest.approx(0.26 / 0.12, rel=0.05)


def test_it_is_the_same_every_time() -> None:
    u = steps(600, 1)
    a = trace(u, plant(u) + noise(600, 1, 0.05))
    assert look(a).to_dict() == look(a).to_dict()


@pytest.mark.parametrize("gain", [1.0, 3.0])
def test_feedback_is_found_and_the_same_plant_without_it_has_none(gain: float) -> None:
    rng = np.random.default_rng(1)
    n, e = 2000, noise(2000, 2, 0.3)
    reference = np.repeat(rng.choice([-1.0, 1.0], n // 20), 20)
    verdicts = []
    for k in (0.0, gain):
        x, u, y = 0.0, np.zeros(n), np.zeros(n)
        for t in range(1, n):
            x = 0.8 * x + 0.3 * u[t - 1]
            y[t] = x + e[t] + 0.6 * e[t - 1]
            u[t] = k * (reference[t] - y[t - 1]) if k else reference[t]
        verdicts.append(finding(look(trace(u, y)), "feedback.found" if k else "feedback.none").verdict)
    assert verdicts == [Verdict.FINE, Verdict.LOOK]


@pytest.mark.parametrize("seed", range(4))
def test_input_and_output_that_are_exchanged_are_told_from_feedback(seed: int) -> None:
    u = steps(1500, seed)
    found = finding(look(trace(plant(u) + noise(1500, seed, 0.05), u)), "feedback.exchanged", "u1")
    assert found.verdict is Verdict.LOOK
    assert found.figures["backward"] > 0.9
    assert found.figures["forward"] < 0.6


def test_collinear_inputs_are_named() -> None:
    a, b = steps(1200, 3), steps(1200, 4)
    found = look(
        trace(np.column_stack([a, b, np.roll(a, 2)]), plant(a) + plant(b) + noise(1200, 3, 0.05)),
        mapping="u1+u2+u3 -> y",
    )
    assert set(finding(found, "collinearity.same").subject) == {"u1", "u3"}
    apart = look(trace(np.column_stack([a, b]), plant(a) + plant(b)), mapping="u1+u2 -> y")
    assert finding(apart, "collinearity.none").verdict is Verdict.FINE


def test_a_slow_input_is_not_exciting_and_few_moves_are_counted() -> None:
    t = np.arange(1000)
    sine = np.sin(2 * np.pi * t / 200)
    assert finding(look(trace(sine, plant(sine) + noise(1000, 1, 0.01))), "excitation.low").figures["order"] <= 3
    step = (t > 300).astype(np.float64)
    assert "excitation.few_moves" in looks(look(trace(step, plant(step) + noise(1000, 1, 0.01))))


# One sine asks for little: the test before has it.
@pytest.mark.parametrize("kind", sorted({*KINDS} - {"sine"}))
def test_every_excitation_passes(kind: str) -> None:
    x = excite(kind, samples=2000, sample_time=0.5, seed=1, low=0.0, high=4.0)
    found = look(trace(x.values, plant(x.values[:, 0]) + noise(2000, 4, 0.05)))
    excitation = [one for one in found.of(Topic.EXCITATION) if one.code != "excitation.two_levels"]
    assert [one.verdict for one in excitation] in ([Verdict.FINE], [Verdict.NOTE])
    assert excitation[0].figures["order"] >= 4


def test_dead_times_are_those_of_each_input() -> None:
    u = np.random.default_rng(5).uniform(-1, 1, (1500, 2))
    found = look(trace(u, plant(u[:, 0], 7) + plant(u[:, 1], 1) + noise(1500, 5, 0.1)), mapping="u1+u2 -> y")
    assert [finding(found, "dead_time", name).figures["best"] for name in ("u1", "u2")] == [7, 1]


def test_an_input_that_does_nothing_is_told() -> None:
    u = np.column_stack([steps(1200, 6), steps(1200, 7)])
    found = look(trace(u, plant(u[:, 0]) + noise(1200, 6, 0.1)), mapping="u1+u2 -> y")
    assert finding(found, "effect.none").subject == ("u2",)


def test_the_only_input_of_a_single_step_is_not_to_be_left_out() -> None:
    u = np.repeat([0.0, 1.0], [30, 300])
    found = look(trace(u, lfilter([0.0, 0.0, 0.06], [1.0, -0.96], u) + noise(330, 0, 0.12)))
    assert "effect.none" not in codes(found)
    assert "Keep it, as it is the only input that moves." in str(said(finding(found, "effect.unseen"), {}))


def test_too_fast_and_too_slow_sampling() -> None:
    u = steps(3000, 8, hold=150)
    slow = lfilter([0.0, 0.01], [1.0, -0.99], u)
    fast = finding(look(trace(u, slow + noise(3000, 8, 0.002))), "sampling.fast").figures
    assert 150 <= fast["rise"] <= 280
    assert 5.0 < fast["proposed"] < 20.0
    v = steps(800, 8, hold=3)
    assert "sampling.slow" in looks(look(trace(v, np.roll(v, 1) + noise(800, 8, 0.01))))


def test_a_long_record_says_how_much_of_it_was_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sysid.advice.record.SEEN", 400)
    monkeypatch.setattr("sysid.advice.amount.SEEN", 400)
    u = steps(1000, 15)
    found = look(trace(u, plant(u) + noise(1000, 15, 0.02)))
    assert finding(found, "amount.part").figures["seen"] == 400
    assert finding(found, "dead_time").figures["best"] == 2


@pytest.mark.parametrize("other", ["noise", "an input that is missing"])
def test_a_gain_of_a_response_that_explains_little_is_told_to_be_one(other: str) -> None:
    """It had been called fine where the response explained 41 % of the output."""
    u = steps(2000, 3)
    y = plant(u)
    beside = noise(2000, 3, 1.0) if other == "noise" else plant(steps(2000, 4, hold=9))
    found = look(trace(u, y + 1.2 * y.std() * beside / beside.std()))
    told = finding(found, "settling.little", "u1")
    assert told.verdict is Verdict.NOTE
    assert told.figures["explained"] == pytest.approx(0.41, abs=0.1)
    assert told.figures["gain"] == pytest.approx(1.5, abs=3.0 * told.figures["gain_deviation"])
    assert "sampling.good" not in codes(found)
    assert "explains only" in said(told, {"u1": "V", "y": "m"})[0]


def test_noise_is_measured() -> None:
    u = steps(3000, 9)
    y = plant(u)
    found = look(trace(u, y + noise(3000, 9, 0.5 * y.std())))
    assert finding(found, "noise.some").figures["deviation"] == pytest.approx(0.5 * y.std(), rel=0.1)
    assert "noise.loud" in looks(look(trace(u, y + noise(3000, 9, 2.0 * y.std()))))


@pytest.mark.parametrize("seed", range(3))
def test_curvature_is_found_without_periods(seed: int) -> None:
    u = steps(2000, seed)
    y = plant(u)
    found = look(trace(u, y - 0.3 * y**3 + 0.2 * y**2 + noise(2000, seed, 0.02)))
    assert finding(found, "linearity.curved").verdict is Verdict.LOOK
    assert any(isinstance(one.structure, NARX) for one in found.suggestions)


@pytest.mark.parametrize("lines", ["full", "odd-random"])
def test_distortion_is_told_from_noise_with_periods(lines: str) -> None:
    x = excite("multisine", samples=4096, sample_time=0.5, periods=4, lines=lines, band=(0.002, 0.4), seed=3).values
    y = plant(x[:, 0])
    linear = finding(look(trace(x, y + noise(4096, 1, 0.1))), "linearity.best_linear_is_enough")
    bent = finding(look(trace(x, y + 0.3 * y**2 - 0.2 * y**3 + noise(4096, 1, 0.1))), "linearity.distorted")
    assert linear.figures["noise_db"] == pytest.approx(bent.figures["noise_db"], abs=3.0)
    assert bent.figures["distortion"] > 20 * linear.figures["distortion"]
    assert bent.figures["period"] == 1024


def test_an_even_system_is_not_called_linear() -> None:
    u = np.repeat(np.random.default_rng(2).choice([-1.0, 1.0], 300), 5)
    found = look(trace(u, np.abs(plant(u)) + noise(1500, 2, 0.01)))
    assert "linearity.none_seen" not in codes(found)


def test_what_is_masked_and_what_scores_is_not_looked_at() -> None:
    u = steps(1500, 12)
    y = plant(u) + noise(1500, 12, 0.02)
    usable = np.ones(1500, dtype=np.bool_)
    usable[500:520] = False
    spoiled = y.copy()
    spoiled[500:520] = 1e9
    found = look(trace(u, spoiled, usable=usable))
    assert looks(found) == set()
    assert finding(found, "amount.masked").figures["stretches"] == 2
    other = trace(u, np.zeros(1500), name="b")
    both = TraceSet(name="x", traces=(trace(u, y), other), roles={"a": Role.ESTIMATION, "b": Role.VALIDATION})
    assert looks(advise(both, Mapping.parse("u1 -> y"))) == set()


def test_several_experiments_have_levels_of_their_own() -> None:
    parts = [steps(700, seed) for seed in (1, 2, 3)]
    found = look(*(trace(u, plant(u) + level + noise(700, k, 0.02), name=str(k))
                   for k, (u, level) in enumerate(zip(parts, (0.0, 50.0, -20.0), strict=True))))  # fmt: skip
    assert looks(found) == set()
    assert finding(found, "amount").figures["experiments"] == 3


def test_records_without_input_and_without_change() -> None:
    y = np.asarray(lfilter([1.0], [1.0, -1.2, 0.5], noise(800, 1, 1.0)))
    found = look(trace(np.empty((800, 0)), y), mapping="-> y")
    assert finding(found, "amount.no_input").verdict is Verdict.NOTE
    (one,) = found.suggestions
    assert isinstance(one.structure, ARX)
    assert one.structure.na == 2
    still = look(trace(np.ones(300), noise(300, 1, 1.0)))
    assert {"channel.constant_input", "dynamics.unknown"} <= codes(still)
    assert "channel.constant_output" in looks(look(trace(steps(300, 1), np.full(300, 4.0))))


def test_noise_on_the_output_proposes_a_transfer_function_first() -> None:
    u = steps(2000, 13)
    found = look(trace(u, plant(u) + noise(2000, 13, 0.3)))
    first = found.suggestions[0].structure
    assert isinstance(first, TransferFunction)
    assert first.delays == (2,)


def test_a_missing_channel_is_refused() -> None:
    with pytest.raises(ChannelError):
        look(trace(steps(100, 1), steps(100, 2)), mapping="u3 -> y")


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 60),
    st.integers(0, 2),
    st.sampled_from(["random", "constant", "ramp", "step", "tiny", "huge", "integers"]),
    st.sampled_from([None, "some", "all", "one"]),
    st.integers(0, 10**6),
)
def test_any_record_ends_in_words(n: int, m: int, kind: str, mask: str | None, seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(n, dtype=np.float64)
    u, y = rng.standard_normal((n, m)), rng.standard_normal(n)
    if kind == "constant":
        u, y = np.ones((n, m)), np.full(n, -3.0)
    elif kind in {"ramp", "step"}:
        u = np.tile((t if kind == "ramp" else t > n / 2)[:, None], (1, m)).astype(np.float64)
        y = 2.0 * t + 1.0
    elif kind in {"tiny", "huge"}:
        scale = 1e-60 if kind == "tiny" else 1e60
        u, y = u * scale, y * scale
    elif kind == "integers":
        u, y = np.round(u), np.round(y)
    usable = {None: None, "some": t % 7 > 0, "all": np.zeros(n, dtype=np.bool_), "one": t == 0}[mask]
    mapping = {0: "-> y", 1: "u1 -> y", 2: "u1+u2 -> y"}[m]
    found = look(trace(u, y, usable=usable), mapping=mapping)
    assert all(said(one, dict(found.units))[0] for one in found.findings)
    assert all("nan" not in said(one, dict(found.units))[0] for one in found.findings if one.figures)


def test_every_code_that_is_written_has_words() -> None:
    folder = Path(sysid.advice.__file__).parent
    tree = [node for file in folder.glob("*.py") for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))]
    texts = {node.value for node in tree if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    topics = {code.partition(".")[0] for code in SAID}
    written = {text for text in texts if re.fullmatch(r"[a-z_]+\.[a-z_]+", text) and text.partition(".")[0] in topics}
    assert len(written) > 40
    assert written <= set(SAID)


def test_ten_thousand_samples_take_less_than_three_seconds_of_processor_time() -> None:
    u = np.column_stack([steps(10_000, 1), steps(10_000, 2)])
    a = trace(u, plant(u[:, 0]) + plant(u[:, 1], 5) + noise(10_000, 1, 0.1))
    look(a, mapping="u1+u2 -> y")
    began = time.thread_time()
    look(a, mapping="u1+u2 -> y")
    assert time.thread_time() - began < 3.0


def test_many_short_records_are_as_exciting_as_one() -> None:
    """Steps that begin with their records: with as many lags as samples the last two were always the same."""
    found = look(*(trace(u := steps(12, k, 4), plant(u), name=f"r{k}") for k in range(100)))
    assert finding(found, "excitation.rich").figures["looked_for"] == 6


def test_an_input_that_stands_in_one_of_several_records_is_no_fault() -> None:
    """Squares of it were left out there and not elsewhere: arrays of different widths, and a trace."""
    rng = np.random.default_rng(0)
    u = np.repeat([*rng.uniform(-1.0, 1.0, 30), *([0.4] * 15)], 20)
    y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 0.005 * rng.standard_normal(len(u))
    traces = sysid.data([(u[:600], y[:600]), (u[600:], y[600:])], sample_time=0.1)
    assert "linearity.none_seen" in [one.code for one in sysid.advise(traces, "u -> y").findings]


def test_a_record_sampled_far_too_fast_is_looked_at_more_slowly() -> None:
    u = steps(5000, 3, hold=200)
    y = lfilter([1.0 / 1000.0], [1.0, -(1.0 - 1.0 / 1000.0)], u) + noise(5000, 3, 0.05)
    found = look(trace(u, y))
    assert not codes(found) & {"effect.none", "output.drift", "linearity.nothing_explained"}
    assert finding(found, "sampling.fast").verdict is Verdict.LOOK


def held_by_a_controller(n: int, seed: int) -> tuple[Array, Array]:
    """A plant with a pole at 1.05 under proportional control, without noise that goes round."""
    r, x = steps(n, seed, hold=40), 0.0
    u, y = np.zeros(n), np.zeros(n)
    for k in range(n):
        u[k], y[k] = 3.0 * (r[k] - x), x
        x = 1.05 * x + 0.05 * u[k]
    return u, y + noise(n, seed, 0.01)


def test_a_plant_that_a_controller_holds_is_told_by_its_pole() -> None:
    found = look(trace(*held_by_a_controller(800, 5)))
    assert {"feedback.holds", "dynamics.runs_away"} <= looks(found)
    assert finding(found, "dynamics.runs_away").figures["pole"] == pytest.approx(1.05, abs=0.02)
    assert not codes(found) & {"settling", "feedback.none", "noise.loud"}
    assert [type(one.structure) for one in found.suggestions] == [ARX]


def test_what_rings_longer_than_the_lags_is_linear_and_no_network_is_asked_for() -> None:
    pole, u = 0.998 * np.exp(0.3j), steps(2500, 1, hold=3)
    y = lfilter([1.0], np.real(np.poly([pole, pole.conj()])), u)
    found = look(trace(u, y + noise(2500, 1, 0.001 * float(y.std()))))
    told = finding(found, "dynamics.rings").figures
    assert told["hertz"] == pytest.approx(0.3 / np.pi, rel=0.02)
    assert told["explained"] > 0.9
    assert not codes(found) & {"linearity.nothing_explained", "noise.loud"}
    assert not any(isinstance(one.structure, NARX) for one in found.suggestions)


def test_inputs_that_move_together_are_not_said_to_do_nothing() -> None:
    u = steps(800, 2)
    found = look(trace(np.column_stack([u, 10.0 * u + 3.0]), plant(u) + noise(800, 2, 0.02)), mapping="u1+u2 -> y")
    assert [one.subject for one in found.findings if one.code == "effect.shared"] == [("u1",), ("u2",)]
    assert not codes(found) & {"effect.none", "settling"}


def test_an_input_that_only_changes_what_another_does_is_kept() -> None:
    u, flow = steps(600, 6), steps(600, 7, hold=30)
    y = plant(u) * (1.0 + 0.4 * flow) + noise(600, 6, 0.02)
    found = look(trace(np.column_stack([u, flow]), y), mapping="u1+u2 -> y")
    assert finding(found, "effect.by_product", "u2").figures["share"] > 0.5


def test_a_response_that_changes_over_the_record_is_told() -> None:
    u = steps(1500, 8)
    strength = np.linspace(0.6, 1.4, 1500)
    told = finding(look(trace(u, plant(u) * strength + noise(1500, 8, 0.02))), "response.varies").figures
    assert (told["low"], told["high"]) == pytest.approx((0.6, 1.4), abs=0.1)


def test_no_rate_is_proposed_that_loses_what_the_output_does() -> None:
    """A pendulum of 2 s was to be resampled to 1.4 s: its linear response drifts, and that was taken for its rise."""
    u, x, speed = 7.0 * steps(1000, 5, 35), 0.0, 0.0
    y = np.empty(1000)
    for t in range(1000):
        y[t] = x
        for _ in range(5):
            speed += 0.01 * (u[t] - 9.81 * np.sin(x) - 0.6 * speed)
            x += 0.01 * speed
    found = look(trace(u, y + noise(1000, 5, 0.02), sample_time=0.05))
    assert "sampling.fast" not in codes(found)


def test_a_curve_without_memory_gets_a_network_without_memory() -> None:
    u = np.repeat(np.random.default_rng(5).uniform(-2.0, 2.0, 100), 6) + noise(600, 6, 0.05)
    found = look(trace(u, np.exp(u) + noise(600, 9, 0.02)))
    assert [one.structure.label for one in found.suggestions if one.code == "structure.curve"] == ["NFIR 0:0/8"]
    assert "structure.network" not in {one.code for one in found.suggestions}


def test_an_answer_one_sample_later_is_not_at_once() -> None:
    u = steps(600, 8, 1)
    found = look(trace(u, np.asarray(lfilter([0.0, 1.425], [1.0, -0.05], u)) + noise(600, 8, 0.02)))
    assert "sampling.at_once" not in codes(found)
    at_once = look(trace(u, 2.0 * u + noise(600, 9, 0.02)))
    assert "sampling.at_once" in codes(at_once)
