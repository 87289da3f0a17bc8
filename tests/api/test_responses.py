"""What a linear fit answers to a step and to sines, and its poles, beside other libraries and the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy import signal

import sysid
from sysid.errors import ConfigError

T = 0.1


@pytest.fixture(scope="module")
def traces() -> sysid.api.TraceSet:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], (200, 2)), 5, axis=0)
    y1 = signal.lfilter([0.0, 0.1, 0.08], [1.0, -1.6, 0.8], u[:, 0]) + 0.02 * rng.normal(size=1000)
    y2 = signal.lfilter([0.0, 0.3], [1.0, -0.9], u[:, 1]) + 0.02 * rng.normal(size=1000)
    return sysid.data({"u": u[:, 0], "v": u[:, 1], "y1": y1, "y2": y2}, sample_time=T)


@pytest.fixture(scope="module")
def second(traces: sysid.api.TraceSet) -> sysid.Fit:
    return sysid.fit(traces, "u -> y1", sysid.OE(nb=(2,), nf=(2,), nk=(1,)))


def test_a_step_is_that_of_scipy_and_its_intervals_hold_the_plant(second: sysid.Fit) -> None:
    found = second.step(seconds=6.0)
    A, B, C, D = second.model.matrices
    _, (exact,) = signal.dstep((A, B, C, D, T), n=61)
    np.testing.assert_allclose(found.values, exact, atol=1e-12)
    assert found.time[-1] == pytest.approx(6.0)
    plant = signal.lfilter([0.0, 0.1, 0.08], [1.0, -1.6, 0.8], np.ones(61))
    held = (found.low[:, 0] <= plant) & (plant <= found.high[:, 0])
    assert held[1:].mean() > 0.8
    (said,) = found.info()
    assert said["gain_low"] < 0.9 < said["gain_high"]
    # Overshoot, 10 to 90 % and the last entry into 2 % of a long response of the plant, between its samples.
    long = signal.lfilter([0.0, 0.1, 0.08], [1.0, -1.6, 0.8], np.ones(200)) / 0.9
    time = T * np.arange(200)
    ends = [np.interp(part, long[:6], time[:6]) for part in (0.1, 0.9)]
    assert said["overshoot"] == pytest.approx(100.0 * (long.max() - 1.0), rel=0.05)
    assert said["rise_time"] == pytest.approx(ends[1] - ends[0], rel=0.05)
    last = int(np.flatnonzero(np.abs(long - 1.0) > 0.02)[-1])
    assert said["settling_time"] == pytest.approx(time[last], abs=2 * T)
    assert "overshoots by" in str(found)


@pytest.mark.parametrize("between", ["zoh", "foh"])
def test_a_step_stands_between_samples_whatever_the_inputs_of_the_records_do(between: str) -> None:
    """It had begun half a sample before time zero where they go straight from sample to sample."""
    t = 0.05 * np.arange(800)
    u = np.sin(0.7 * t) + 0.5 * np.sin(3.1 * t)
    sampled = signal.cont2discrete(signal.tf2ss([1.0, 2.0], [0.5, 0.4, 1.0]), 0.05, between)
    y = signal.dlsim(sampled, np.r_[np.zeros(4), u[:-4]])[1][:, 0]
    structure = sysid.TransferFunction(poles=2, zeros=1, delays=4, domain="continuous", intersample=between)
    found = sysid.fit(sysid.data((u, y), sample_time=0.05), "u -> y", structure).step(seconds=5.0)
    exact = signal.step(([1.0, 2.0], [0.5, 0.4, 1.0]), T=t[:97])[1]
    np.testing.assert_allclose(found.values[:, 0], np.r_[np.zeros(4), exact], atol=1e-7)
    assert (found.low[:, 0] <= found.values[:, 0] + 1e-7).all() and (found.values <= found.high + 1e-7).all()


def test_bode_is_the_model_s_own_response_and_zero_frequency_is_the_gain(second: sysid.Fit) -> None:
    w = np.array([0.0, 1.0, 3.0])
    found = sysid.bode(second, frequency=w)
    z = np.exp(-1j * w * T)
    plant = (0.1 * z + 0.08 * z**2) / (1.0 - 1.6 * z + 0.8 * z**2)
    assert ((found.gain_low[:, 0] < np.abs(plant)) & (np.abs(plant) < found.gain_high[:, 0])).all()
    assert found.gain[0, 0] == pytest.approx(second.step().gain[0])
    frame = found.to_frame()
    assert list(frame["frequency"]) == list(w)
    np.testing.assert_allclose(frame["phase"], np.degrees(np.unwrap(np.angle(plant))), atol=2.0)
    assert "largest gain" in str(found)


def test_poles_are_those_of_the_plant_within_their_intervals(second: sysid.Fit) -> None:
    (mode,) = sysid.poles(second)
    s = np.log(complex(0.8, 0.4)) / T
    assert mode.intervals["natural_frequency"][0] < abs(s) < mode.intervals["natural_frequency"][1]
    frame = second.poles().to_frame()
    assert frame["damping_low"][0] < -s.real / abs(s) < frame["damping_high"][0]
    assert math.isnan(frame["time_constant"][0])
    assert "damping" in str(second.poles())


@pytest.mark.parametrize("whole", [True, False], ids=["one model", "a model an output"])
def test_several_outputs_have_a_column_for_each_pair(traces: sysid.api.TraceSet, whole: bool) -> None:
    structure = sysid.LinearStateSpace(states=3) if whole else sysid.ARX(na=2, nb=(2, 2), nk=(1, 1))
    fit = sysid.fit(traces, "u+v -> y1+y2", structure)
    names = ("y1 from u", "y1 from v", "y2 from u", "y2 from v")
    for found in (fit.step(), fit.bode()):
        assert sorted(found.names) == sorted(names)
        assert isinstance(found.plot(), Figure)
    gains = dict(zip(fit.step().names, fit.step().gain, strict=True))
    assert gains["y2 from v"] == pytest.approx(3.0, rel=0.1)
    assert len(fit.poles()) >= 2


def test_several_outputs_say_which_pole_is_whose(traces: sysid.api.TraceSet) -> None:
    """Two poles had both been called u's, and the picture showed the first output's alone."""
    found = sysid.fit(traces, "u+v -> y1+y2", sysid.OE(nb=1, nf=1, nk=1)).poles()
    assert [mode.of for mode in found] == ["y1 from u", "y1 from v", "y2 from u", "y2 from v"]
    assert [place.get_title(loc="left") for place in found.plot().axes] == [mode.of for mode in found]
    shared = sysid.fit(traces, "u+v -> y1+y2", sysid.ARX(na=1, nb=1, nk=1)).poles()
    assert list(shared.to_frame()["of"]) == ["y1", "y2"]


def test_a_phase_has_the_turns_of_a_dead_time_at_any_frequencies() -> None:
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 100), 8)
    y = signal.lfilter(np.r_[np.zeros(60), 0.1], [1.0, -0.9], u)
    fit = sysid.fit(sysid.data((u, y), sample_time=1.0), "u -> y", sysid.OE(nb=1, nf=1, nk=60))
    w = np.array([3.0, 0.1, 1.0])
    truth = np.degrees(-60.0 * w - np.angle(1.0 - 0.9 * np.exp(-1j * w)))
    found = fit.bode(frequency=w)
    np.testing.assert_allclose(found.phase[:, 0], truth, atol=0.1)
    assert (found.phase_low <= found.phase).all() and (found.phase <= found.phase_high).all()
    assert fit.bode().phase[-1, 0] == pytest.approx(-180.0 * 60, abs=0.1)


def test_a_gain_per_rate_keeps_what_is_divided_by_together() -> None:
    u = np.repeat([0.0, 1.0, -1.0, 0.5, 0.0], 20)
    units = {"u": "l/min", "y": "degC"}
    traces = sysid.data((u, signal.lfilter([0.0, 0.2], [1.0, -0.8], u)), sample_time=T, units=units)
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1))
    assert "1.00\u00a0degC/(l/min)" in str(fit.step()) and "degC/(l/min)" in str(fit.bode())


def test_what_integrates_has_an_infinite_gain_and_does_not_settle() -> None:
    integrator = sysid.fit(
        sysid.data(
            (np.repeat([0.0, 1.0, 0.0], 20), np.r_[np.zeros(21), T * np.arange(1, 20), np.full(20, 20 * T)]),
            sample_time=T,
        ),
        "u -> y",
        sysid.ARX(na=1, nb=(1,), nk=(1,), intercept=False),
    )
    (said,) = integrator.step().info()
    assert math.isinf(said["gain"])
    assert math.isnan(said["settling_time"])
    assert "does not settle" in str(integrator.step())
    assert "integrates" in str(integrator.poles())


def test_a_bundle_answers_as_its_fit_without_intervals(second: sysid.Fit, tmp_path) -> None:
    second.save(tmp_path / "bundle", formats=("c",))
    bundle = sysid.read_bundle(tmp_path / "bundle")
    np.testing.assert_allclose(sysid.step(bundle).values, second.step().values, atol=1e-12)
    assert np.isnan(sysid.step(bundle).low).all()
    assert isinstance(sysid.bode(bundle).plot(), Figure)


def test_what_is_no_linear_fit_is_refused_with_what_to_do(traces: sysid.api.TraceSet, second: sysid.Fit) -> None:
    training = sysid.Training(max_iterations=2)
    network = sysid.fit(traces, "u -> y1", sysid.NARX(input_delays=1, output_delays=1, neurons=1), training)
    for call, words in (
        (network.step, "not linear"),
        (network.poles, "not linear"),
        (lambda: sysid.step("second"), "nothing here"),
        (lambda: second.step(seconds=0.0), "not a length"),
        (lambda: second.step(seconds=True), "not a length"),
        (lambda: second.step(seconds="6"), "not a length"),
        (lambda: second.bode(frequency=[-1.0]), "not frequencies"),
        (lambda: second.bode(frequency="fast"), "not frequencies"),
    ):
        with pytest.raises(ConfigError, match=words):
            call()


@pytest.mark.parametrize("structure", [sysid.ARX(na=1, nb=(), nk=()), sysid.LinearStateSpace(states=1)])
def test_a_time_series_has_poles_and_no_responses(structure: object) -> None:
    e = np.random.default_rng(0).normal(size=2000)
    series = sysid.fit(sysid.data({"y": signal.lfilter([1.0], [1.0, -0.8], e)}, sample_time=T), "-> y", structure)
    (mode,) = series.poles()
    assert mode.intervals["time_constant"][0] < -T / math.log(0.8) < mode.intervals["time_constant"][1]
    with pytest.raises(ConfigError, match="no input"):
        series.step()
    with pytest.raises(ConfigError, match="no input"):
        series.poles().plot()
    if isinstance(structure, sysid.ARX):
        assert series.model.b == ()
