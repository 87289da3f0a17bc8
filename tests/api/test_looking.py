"""The look at data first from Python: what is asked in a line answers, prints, draws and saves itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sysid
from sysid.errors import ConfigError
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.traces import TraceSet


def traces(outputs: int = 1) -> TraceSet:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, 100), 5)
    y = np.convolve(u, [0.0, 0.0, *(0.3 * 0.7 ** np.arange(60))])[:500]
    columns = np.column_stack([(k + 1) * y + 0.01 * rng.standard_normal(500) for k in range(outputs)])
    return sysid.data((u, columns), sample_time=0.1, split=0.8, units={"u": "V"})


def test_advice_prints_what_was_found_and_draws_it() -> None:
    found = sysid.advise(traces(), "u -> y")
    assert "acts after 2 samples" in str(found)
    assert str(found) in found._repr_html_().replace("&gt;", ">")
    assert "pre-wrap" in found._repr_html_(), "on a phone nothing is cut off"
    assert set(found.to_frame()["verdict"]) <= {"fine", "worth knowing", "look at this", "cannot be said", ""}
    assert len(found.plot().axes) == 3


def test_channels_whose_names_tell_need_no_mapping() -> None:
    assert str(sysid.advise(traces()).mapping) == "u -> y"
    with pytest.warns(GuessedWarning, match=r"guessed: u -> y1\+y2: by their names"):
        assert list(sysid.advise(traces(2)).outputs) == ["y1", "y2"]


def test_several_outputs_are_looked_at_one_by_one() -> None:
    found = sysid.advise(traces(2), "u -> y1+y2")
    assert list(found.outputs) == ["y1", "y2"]
    assert set(found.to_frame()["output"]) == {"y1", "y2"}
    assert "u -> y2" in str(found)


def test_estimates_of_several_outputs_are_one_an_output() -> None:
    """MATLAB's ``impulseest``, ``spa`` and ``etfe`` take records of several outputs; here they were refused."""
    data = traces(2)
    pulse, response = sysid.impulse_response(data, "u -> y1+y2"), sysid.frequency_response(data, "u -> y1+y2")
    assert list(pulse.outputs) == list(response.outputs) == ["y1", "y2"]
    one = sysid.impulse_response(data, "u -> y2")
    assert np.array_equal(pulse["y2"].step(), one.step()) and str(one) in str(pulse)
    assert str(sysid.frequency_response(data, "u -> y1")) in str(response)
    assert list(pulse.plot()) == list(response.plot(unit="rad/s")) == ["y1", "y2"]
    with pytest.raises(ConfigError, match="no output y3") as refused:
        pulse["y3"]
    assert "y1, y2" in str(refused.value)


def test_a_record_with_nothing_to_draw_says_so() -> None:
    found = sysid.advise(sysid.data((np.ones(50), np.arange(50.0)), sample_time=1.0))
    with pytest.raises(ConfigError, match="nothing to draw"):
        found.plot()


def test_responses_draw_themselves_and_models_over_them() -> None:
    data = traces()
    fit = sysid.fit(data, "u -> y", sysid.ARX(na=1, nb=1, nk=2), stability=sysid.StabilityOptions(count=0))
    response = sysid.frequency_response(data, method="welch", resolution=2.0)
    gain = response.plot(fit).axes[0]
    assert fit.model.structure.label in [line.get_label() for line in gain.lines]
    pulse = sysid.impulse_response(data, kernel="TC")
    assert pulse.dead_times[0].best == 2
    assert len(pulse.plot().axes) == 1
    with pytest.raises(ConfigError, match="kernel"):
        sysid.impulse_response(data, kernel="SE")


@pytest.mark.parametrize("whole", [True, False], ids=["one model", "a model an output"])
def test_a_model_of_several_outputs_is_drawn_over_one_of_them(whole: bool) -> None:
    """One model of all had been left out, and a fit an output was refused with a traceback."""
    data = traces(2)
    fit = sysid.fit(data, "u -> y1+y2", sysid.LinearStateSpace(states=4) if whole else sysid.ARX(na=1, nb=1, nk=2))
    gain, phase = sysid.frequency_response(data, "u -> y2", resolution=2.0).plot(fit).axes[:2]
    assert len(gain.lines) == 2 and gain.lines[1].get_ydata()[0] == pytest.approx(2.0, rel=0.1)
    assert phase.lines[1].get_ydata()[0] == pytest.approx(phase.lines[0].get_ydata()[0], abs=10.0)


def test_a_model_is_turned_as_the_response_of_its_own_input() -> None:
    """By the first input's phase, of -165 degrees here, the second's model was drawn 360 below what was measured."""
    u = np.random.default_rng(1).standard_normal((4000, 2))
    leads = u[:, 0] - 0.5 * np.r_[0.0, u[:-1, 0]]
    lags = np.convolve(u[:, 1], 0.3 * 0.7 ** np.arange(60))[:4000]
    data = sysid.data((u, -leads - lags), sample_time=1.0)
    fit = sysid.fit(data, "u1+u2 -> y", sysid.ARX(na=1, nb=3, nk=0))
    figure = sysid.frequency_response(data, "u1+u2 -> y", frequency=np.linspace(0.3, 3.0, 50)).plot(fit)
    begun = [[line.get_ydata()[0] for line in place.lines] for place in figure.axes[1:4:2]]
    np.testing.assert_allclose([measured for measured, _ in begun], [-165.0, 150.0], atol=15.0)
    np.testing.assert_allclose([drawn for _, drawn in begun], [measured for measured, _ in begun], atol=10.0)


def test_an_excitation_is_saved_and_read_again(tmp_path: Path) -> None:
    found = sysid.excite("prbs", samples=63, sample_time=0.1, low=0.0, high=5.0, names=["a", "b"], units=["V", "mm"])
    again = sysid.load(found.save(tmp_path / "u.csv"))
    np.testing.assert_array_equal(again.traces[0].values, found.values)
    assert [channel.label for channel in again.channels] == ["a [V]", "b [mm]"]
    assert len(found.plot().axes) == 4


def test_what_is_printed_says_what_was_estimated() -> None:
    response = sysid.impulse_response(traces(), "u -> y", lags=30)
    assert "u: dead time 2 (2 to 2) samples" in str(response) and "gain 0.999" in str(response)
    assert repr(response) == str(response) and len(str(response).splitlines()) == 2
    assert str(sysid.frequency_response(traces(), "u -> y")).startswith("frequency response, u -> y: SPA, ")
    analysis = sysid.fit(traces(), "u -> y", sysid.ARX(na=1, nb=1, nk=1)).residuals(traces())
    assert str(analysis).splitlines()[1:] == list(analysis.sentences)
