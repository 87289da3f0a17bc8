"""Frequencies are drawn in one unit wherever they are drawn, in hertz unless asked; numbers stay in rad/s."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.signal import lfilter

import sysid
from sysid.errors import ConfigError
from sysid.reporting.frequency import FrequencyUnit
from sysid.reporting.parts import Picture
from sysid.reporting.sections.advice import advice_section

SAMPLE_TIME = 0.1
U = np.repeat(np.random.default_rng(0).normal(size=100), 6)
Y = lfilter([0.0, 0.1], [1.0, -0.9], U)
TRACES = sysid.data((U, Y), sample_time=SAMPLE_TIME)
FIT = sysid.fit(TRACES, "u -> y", sysid.ARX(na=1, nb=1, nk=1))


def drawn(unit: str | None) -> list[Figure]:
    """Whatever draws a frequency: a model's, a record's with a model over it, the first look."""
    asked = {} if unit is None else {"unit": unit}
    return [
        FIT.bode().plot(**asked),
        sysid.frequency_response(TRACES, "u -> y").plot(FIT, **asked),
        sysid.advise(TRACES, "u -> y").plot(**asked),
    ]


@pytest.mark.parametrize(("unit", "nyquist"), [(None, 5.0), ("Hz", 5.0), ("rad/s", 10.0 * np.pi)])
def test_every_axis_of_frequencies_is_in_the_unit_that_it_says(unit: str | None, nyquist: float) -> None:
    for figure in drawn(unit):
        labels = {axes.get_xlabel() for axes in figure.axes if axes.get_xlabel().startswith("frequency")}
        assert labels == {f"frequency [{unit or 'Hz'}]"}
        lines = [line for axes in figure.axes if axes.get_xscale() == "log" for line in axes.lines]
        assert len(lines) >= 2
        for line in lines:
            assert np.max(line.get_xdata()) == pytest.approx(nyquist, rel=1e-3)


def test_what_is_printed_is_in_hertz_and_what_is_computed_with_in_radians() -> None:
    bode, response = FIT.bode(), sysid.frequency_response(TRACES, "u -> y")
    assert str(bode).endswith("to 5.00 Hz")
    assert "to 5 Hz" in str(response)
    for frequency in (bode.frequency, response.frequency, bode.to_frame()["frequency"].to_numpy()):
        assert frequency.max() == pytest.approx(10.0 * np.pi, rel=1e-3)


def test_a_page_draws_the_unit_that_its_results_ask_for() -> None:
    found = [sysid.advise(TRACES, "u -> y").record]
    for unit, other in ((FrequencyUnit.HERTZ, "rad/s"), (FrequencyUnit.RADIANS, "Hz")):
        (picture,) = [part for part in advice_section(found, unit).parts if isinstance(part, Picture)]
        assert f"frequency [{unit.value}]" in picture.svg
        assert f"frequency [{other}]" not in picture.svg


def test_another_unit_is_refused() -> None:
    with pytest.raises(ConfigError, match="write Hz"):
        FIT.bode().plot(unit="kHz")
