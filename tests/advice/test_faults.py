"""Faults of a recording are told from what a plant, a command or a controller does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.advice import advise
from sysid.models import NARX, Mapping
from sysid.reporting.advice.words import said
from sysid.traces import Role, TraceSet
from sysid.yaml_files import parse_yaml
from tests.advice.looks import Array, codes, finding, look, looks, noise, plant, steps, trace


def test_limits_spikes_jumps_and_drifts() -> None:
    u = steps(1500, 11)
    y = plant(u) + noise(1500, 11, 0.01)
    clipped = look(trace(u, np.minimum(y, 0.5)))
    assert finding(clipped, "channel.clipped_above", "y").figures["value"] == pytest.approx(0.5)
    spiked = y.copy()
    spiked[[200, 700, 1100]] += 8.0
    assert finding(look(trace(u, spiked)), "channel.spikes", "y").figures["count"] == 3
    jumped = finding(look(trace(u, y + 1.0 * (np.arange(1500) >= 900))), "output.jump", "y").figures
    assert jumped["size"] == pytest.approx(1.0, abs=0.1)
    assert jumped["seconds"] == pytest.approx(450.0, abs=5.0)
    late = replace(trace(u, y + 1.0 * (np.arange(1500) >= 900)), start_time=1000.0)
    assert finding(look(late), "output.jump", "y").figures["seconds"] == 1000.0 + jumped["seconds"]
    drifted = finding(look(trace(u, y + np.linspace(0, 2, 1500))), "output.drift", "y").figures
    assert drifted["size"] == pytest.approx(2.0, abs=0.3)
    coarse = finding(look(trace(u, np.round(y / 0.08) * 0.08)), "channel.resolution", "y").figures
    assert coarse["step"] == pytest.approx(0.08)


def test_a_sensor_that_is_stuck_is_told_with_its_time() -> None:
    u = steps(1500, 11)
    y = np.round(plant(u) + noise(1500, 11, 0.01), 3)
    stuck = y.copy()
    stuck[700:760] = y[700]
    figures = finding(look(trace(u, stuck)), "channel.stuck", "y").figures
    assert (figures["stays"], figures["seconds"]) == (1, 350.0)
    assert figures["samples"] == pytest.approx(60, abs=1)
    assert look(trace(u, y)).find("channel.stuck", "y") is None


def test_a_sensor_that_is_stuck_is_masked_by_the_line_that_is_told() -> None:
    """In the time of the file, and of that case alone where others are recorded at the same time."""
    u = steps(1500, 11)
    y = np.round(plant(u) + noise(1500, 11, 0.01), 3)
    stuck = y.copy()
    stuck[700:760], stuck[900:940] = y[700], y[900]
    late = replace(trace(u, stuck, name="run 3"), start_time=40.0)
    line = said(finding(look(late), "channel.stuck", "y"), {"y": "m"})[1]
    found = parse_yaml(line.split("under source: ")[1].split(". Where")[0], where="the advice")["repairs"]
    assert [set(one) for one in found["mask"]] == [{"channel", "start", "stop"}] * 2
    columns = {"t": late.time, "u": u, "y": stuck}
    masked = sysid.data(columns, inputs="u", outputs="y", repairs=found).traces[0]
    hidden = np.flatnonzero(~masked.usable_of(["y"]))
    assert set(range(701, 760)) | set(range(901, 940)) <= set(hidden) <= set(range(699, 761)) | set(range(899, 941))
    assert look(trace(u, stuck, usable=masked.usable)).find("channel.stuck", "y") is None
    other = replace(trace(u, y), start_time=100.0)
    assert finding(look(late, other), "channel.stuck").reason.count('cases: ["run 3"]') == 2
    unseen = TraceSet(name="x", traces=(late, other), roles={"run 3": Role.ESTIMATION, "a": Role.VALIDATION})
    assert finding(advise(unseen, Mapping.parse("u1 -> y")), "channel.stuck").reason.count('cases: ["run 3"]') == 2


def test_an_output_at_rest_is_not_stuck() -> None:
    """Before the first step, between steps and where each value is held nothing moves it, or it always stands."""
    u = steps(1500, 11)
    u[:300] = 0.0
    exact = np.round(plant(u), 3)
    noisy = np.where(np.arange(1500) < 300, 0.0, exact + np.round(noise(1500, 11, 0.02), 3))
    held = np.repeat((plant(u) + noise(1500, 11, 0.02))[::12], 12)
    for y in (exact, noisy, held):
        assert look(trace(u, y)).find("channel.stuck", "y") is None


@pytest.mark.parametrize("dead", [1, 3])
def test_a_fast_plant_that_has_answered_is_at_no_limit(dead: int) -> None:
    u = np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], 60), 5)
    y = lfilter([*np.zeros(dead), 0.99], [1.0, -0.01], u)
    found = look(trace(u, y, sample_time=10.0))
    assert not codes(found) & {"channel.clipped_above", "channel.clipped_below"}
    assert not any(isinstance(one.structure, NARX) for one in found.suggestions)


def test_levels_of_a_command_are_no_fault_of_a_channel() -> None:
    u = np.round(np.clip(3.0 * steps(1500, 14), -2.0, 2.0), 2)
    assert looks(look(trace(u, plant(u) + noise(1500, 14, 0.02)))) == set()


def kicked(n: int = 3000, pole: float = 1.1) -> tuple[Array, Array]:
    """A plant and the controller that kicks it where its set point steps."""
    rng = np.random.default_rng(3)
    r, e = np.repeat(rng.choice([-1.0, 1.0], n // 30), 30), noise(n, 5, 0.05)
    u, y = np.zeros(n), np.zeros(n)
    for k in range(1, n):
        y[k] = pole * y[k - 1] + 0.2 * u[k - 1] + e[k]
        u[k] = 3.0 * (r[k] - y[k])
    return u, y


@pytest.mark.parametrize("pole", [1.1, 0.9])
def test_the_kicks_of_a_controller_are_no_faults_of_the_recording(pole: float) -> None:
    """It was told to mask 52 samples of the input, which is what moved the plant."""
    u, y = kicked(pole=pole)
    assert look(trace(u, y)).find("channel.spikes", "u1") is None
    u = steps(3000, 2, hold=20)
    u[::100] += 3.0
    assert look(trace(u, plant(u) + noise(3000, 1, 0.02))).find("channel.spikes", "u1") is None


@pytest.mark.parametrize("count", [1, 10])
def test_what_no_output_answers_is_a_fault_in_a_loop_too(count: int) -> None:
    at = np.arange(157, 2900, 260)[:count]
    u = steps(3000, 2, hold=20) + noise(3000, 3, 0.02)
    y, faults = plant(u) + noise(3000, 1, 0.02), np.zeros(3000)
    faults[at] = 60.0
    assert finding(look(trace(u + faults, y)), "channel.spikes", "u1").figures["count"] == count
    u, y = kicked()
    assert finding(look(trace(u + faults, y)), "channel.spikes", "u1").figures["count"] == count


@pytest.mark.parametrize("share", [0.06, 0.2, 0.5])
def test_a_response_is_seen_through_an_output_of_which_samples_are_missing(share: float) -> None:
    """Its inputs are known all along; a fifth missing had made it begin at once and not settle within 1 s."""
    rng = np.random.default_rng(5)
    u = np.repeat(rng.choice([-1.0, 1.0], 240), 10)
    y = lfilter([0.0, 0.2, 0.1], [1.0, -1.5, 0.7], u)
    y = y / y.std() + noise(2400, 1, 0.05)
    seen = np.column_stack([np.ones(2400, dtype=np.bool_), rng.random(2400) >= share])
    whole, found = look(trace(u, y, sample_time=0.1)), look(trace(u, np.where(seen[:, 1], y, 99.0), usable=seen))
    assert finding(found, "amount.masked_output").figures["share"] == pytest.approx(share, abs=0.03)
    assert finding(found, "dead_time").figures["best"] == 1.0
    gains = [finding(one, "settling").figures for one in (whole, found)]
    assert gains[1]["gain"] == pytest.approx(gains[0]["gain"], abs=4.0 * gains[1]["gain_deviation"])
    assert gains[1]["gain_deviation"] < 1.5 * gains[0]["gain_deviation"] / np.sqrt(1.0 - share)
    assert abs(gains[1]["samples"] - gains[0]["samples"]) <= 2.0
    assert found.impulse is not None
    assert found.impulse.explained > 0.995
    assert finding(found, "excitation.rich").figures["order"] == finding(whole, "excitation.rich").figures["order"]
    assert not codes(found) & {"coherence.low", "settling.never", "effect.none"}


def test_a_slow_plant_is_looked_at_slowly_where_samples_of_its_output_are_missing() -> None:
    u, rng = steps(12_000, 3, hold=150), np.random.default_rng(0)
    y = np.asarray(lfilter([0.0, 0.005], [1.0, -0.995], u)) + noise(12_000, 2, 0.005)
    seen = np.column_stack([np.ones(12_000, dtype=np.bool_), rng.random(12_000) >= 0.2])
    found = look(trace(u, np.where(seen[:, 1], y, 99.0), usable=seen))
    assert finding(found, "settling").figures["gain"] == pytest.approx(1.0, abs=0.05)


def test_spikes_in_one_of_a_hundred_samples_are_seen() -> None:
    u = steps(1000, 4)
    y = plant(u) + noise(1000, 4, 0.02)
    y[np.random.default_rng(1).choice(1000, 10, replace=False)] += 8.0
    assert finding(look(trace(u, y)), "channel.spikes", "y").figures["count"] >= 9


def test_a_drift_that_is_the_sum_of_an_input_is_no_drift() -> None:
    u = steps(2000, 9, hold=30) + 0.4
    charge = 0.002 * np.cumsum(u)
    found = look(trace(u, plant(u) + charge + noise(2000, 9, 0.02)))
    assert finding(found, "output.sums", "u1").figures["size"] == pytest.approx(charge[-1] - charge[0], rel=0.2)
    assert "output.drift" not in codes(found)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_curve_is_no_step_that_never_settles(seed: int) -> None:
    """A lag of 100 samples whose output is bent settles: a linear response to it does not."""
    u = np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, 50), 40)
    lag = lfilter([0.0, 0.01], [1.0, -0.99], u)
    y = np.abs(lag) + 0.3 * lag
    found = look(trace(u, y + noise(2000, seed, 0.01 * y.std())))
    assert not codes(found) & {"settling.never", "settling.integrates", "settling"}
    unknown = finding(found, "settling.unknown", "u1")
    assert f"explain {unknown.figures['explained']:.0%} of the output" in said(unknown, {"y": "m"})[0]
    assert unknown.figures["explained"] < 0.9


def test_a_slow_plant_that_is_linear_is_still_told_not_to_settle() -> None:
    u = np.repeat(np.random.default_rng(2).uniform(-1.0, 1.0, 100), 20)
    y = lfilter([0.0, 0.001], [1.0, -0.999], u)
    assert "settling.never" in codes(look(trace(u, y)))
