"""The short way from a measured frequency response."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

import sysid
from sysid.errors import UserError
from sysid.testing import first_order_record

W = np.geomspace(0.5, 200.0, 60)
H = signal.freqs([400.0], [1.0, 4.0, 100.0], W)[1]
SWEPT = sysid.response_data({"f [Hz]": W / (2 * np.pi), "re": H.real, "im": H.imag}, name="arm")
TWO = sysid.TransferFunction(poles=(2,), zeros=(0,), delays=(0,), domain="continuous")
QUICK = sysid.TransferFunctionTraining(scattered_starts=0)


def fitted(**asked: Any) -> Any:
    return sysid.fit_response(SWEPT, TWO, training=QUICK, **asked)


def test_a_response_is_fitted_told_drawn_and_tabled() -> None:
    fit = fitted(mapping="current -> angle", units={"current": "A", "angle": "rad"})
    assert fit.fit_percent == pytest.approx(100.0)
    np.testing.assert_allclose(np.sort_complex(fit.model.poles(0)), [-2 - 96**0.5 * 1j, -2 + 96**0.5 * 1j])
    assert "Fit of the frequency response: 100.00 %" in fit.summary()
    assert any("60 points from 0.07958 to 31.83 Hz" in note for note in fit.notes)
    assert "damping 0.200" in str(fit.poles())
    table = fit.to_frame()
    np.testing.assert_allclose(table["model_phase"], table["phase"], atol=1e-6)
    assert [axes.get_ylabel() for axes in fit.plot().axes] == ["gain [rad/A]", "phase [degrees]", "error [%]"]


def test_a_fit_of_fewer_poles_says_how_far_it_is_off() -> None:
    one = sysid.TransferFunction(poles=(1,), zeros=(0,), delays=(0,), domain="continuous")
    fit = sysid.fit_response(SWEPT, one, training=QUICK)
    assert fit.fit_percent < 50.0
    decibel, degrees, _ = fit.furthest
    assert decibel > 3.0
    assert degrees > 45.0


def test_it_is_written_as_files_that_run(tmp_path: Path) -> None:
    fit = fitted(sample_time=0.001)
    bundle = fit.save(tmp_path / "arm", formats=("c",))
    settled = bundle.simulate(np.ones(5000))[-1]
    assert settled == pytest.approx(4.0, rel=1e-3)
    assert bundle.ranges == {}
    assert "frequency response (60 points" in (tmp_path / "arm" / "MODEL_CARD.md").read_text()


@pytest.mark.parametrize("weighting", ["none", "relative", "root", "coherence"])
def test_a_weighting_says_where_the_fit_is_good(weighting: str) -> None:
    """Two poles of three: one resonance low and one of a hundredth of its size."""
    high = signal.freqs([400.0], [1.0, 4.0, 8000.0], W)[1]
    swept = sysid.response_data({"w [rad/s]": W, "H": H + high, "coherence": np.where(W < 30.0, 0.2, 0.99)})
    fit = sysid.fit_response(swept, TWO, training=QUICK, weighting=weighting)
    off = np.abs(fit.values / swept.values - 1.0)
    resonance = np.abs(W - 10.0) < 3.0
    assert (off[resonance].max() < 0.3) == (weighting in {"none", "root"})


def test_an_estimated_response_is_fitted() -> None:
    traces = sysid.load(first_order_record())
    found = sysid.frequency_response(traces)
    structure = sysid.TransferFunction(poles=(1,), zeros=(0,), delays=(1,), domain="discrete")
    fit = sysid.fit_response(found, structure, sample_time=traces.sample_time, training=QUICK)
    assert fit.model.mapping == found.mapping
    assert fit.fit_percent > 50.0  # a window of the estimate takes the rest


REFUSED: dict[str, tuple[Any, str]] = {
    "another structure": (
        lambda: sysid.fit_response(SWEPT, sysid.ARX(na=1, nb=1, nk=1)),
        "fitted by a transfer function",
    ),
    "a record": (lambda: sysid.fit_response(sysid.load(first_order_record()), TWO), "response_data"),
    "two inputs": (lambda: fitted(mapping="a+b -> y"), "one input to one output"),
    "no such weighting": (lambda: fitted(weighting="inv"), "no such weighting"),
    "no coherence": (lambda: fitted(weighting="coherence"), "no coherence to weight by"),
    "no sample time": (
        lambda: sysid.fit_response(SWEPT, sysid.TransferFunction(poles=(2,), zeros=(1,))),
        "has a sample time",
    ),
    "none at all": (lambda: fitted(sample_time=0.0), "not a sample time"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_fitted_is_said(case: str) -> None:
    ask, says = REFUSED[case]
    with pytest.raises(UserError, match=says):
        ask()
