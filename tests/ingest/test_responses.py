"""Files of measured frequency responses."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import sysid
from sysid.errors import UserError
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.ingest.responses import read_response

W = np.geomspace(0.5, 200.0, 30)
HZ = W / (2.0 * np.pi)
H = 4.0 * np.exp(-0.02j * W) / (1.0 + 0.1j * W)
DB, DEG = 20.0 * np.log10(np.abs(H)), np.degrees(np.unwrap(np.angle(H)))

SAID: dict[str, dict[str, Any]] = {
    "decibels and degrees": {"Frequency [Hz]": HZ, "Magnitude [dB]": DB, "Phase [deg]": DEG},
    "in rad/s, a ratio and radians": {"w (rad/s)": W, "Gain [1]": np.abs(H), "Phase (rad)": np.angle(H)},
    "units in names": {"freq_kHz": HZ / 1e3, "mag_dB": DB, "phase_deg": DEG},
    "real and imaginary parts": {"Frequency_Hz": HZ, "Real": H.real, "Imag": H.imag},
    "an impedance, from fast to slow": {"Freq/Hz": HZ[::-1], "Re(Z)": H.real[::-1], "-Im(Z)": -H.imag[::-1]},
}


@pytest.mark.parametrize("case", SAID)
def test_a_response_is_read_from_what_its_columns_say(tmp_path: Path, case: str) -> None:
    pd.DataFrame(SAID[case]).to_csv(tmp_path / "a.csv", index=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for found in (read_response(tmp_path / "a.csv"), read_response(SAID[case])):
            np.testing.assert_allclose(found.frequency, W, rtol=1e-9)
            np.testing.assert_allclose(found.values, H, rtol=1e-9)


def test_what_is_guessed_is_told_and_can_be_said(tmp_path: Path) -> None:
    pd.DataFrame({"f": HZ, "mag": DB, "phase": np.angle(H)}).to_csv(tmp_path / "a.csv", index=False)
    with pytest.warns(GuessedWarning) as told:
        found = read_response(tmp_path / "a.csv")
    assert [str(one.message).split("guessed: ")[1][:12] for one in told] == [
        "f in Hz, as ",
        "mag in dB, a",
        "phase in rad",
    ]
    assert len(found.notes) == 3
    np.testing.assert_allclose(found.values, H)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        said = read_response(tmp_path / "a.csv", units={"frequency": "rad/s", "gain": "dB", "phase": "rad"})
    np.testing.assert_allclose(said.frequency, HZ)


@pytest.mark.parametrize(
    ("unit", "frequency"), [("rad/TimeUnit", W), ("Hz", HZ), ("kHz", HZ / 1e3), ("rad/s", W)], ids=str
)
def test_an_frd_of_matlab_is_read_in_the_unit_that_it_says(tmp_path: Path, unit: str, frequency: np.ndarray) -> None:
    about = {"Frequency": frequency, "FrequencyUnit": unit, "TimeUnit": "seconds", "Ts": 0.01}
    savemat(tmp_path / "a.mat", {"G": {"ResponseData": H.reshape(1, 1, -1), **about}})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read_response(tmp_path / "a.mat")
    np.testing.assert_array_equal(found.values, H)
    np.testing.assert_allclose(found.frequency, W)
    with pytest.raises(UserError, match="no record over time"):
        sysid.load(tmp_path / "a.mat")


def test_one_of_several_responses_of_an_frd_is_named(tmp_path: Path) -> None:
    several = np.stack([1 * H, 2 * H, 3 * H, 4 * H]).reshape(2, 2, -1)
    savemat(tmp_path / "a.mat", {"G": {"ResponseData": several, "Frequency": W, "FrequencyUnit": "rad/s"}})
    with pytest.raises(UserError, match="several columns may be the complex"):
        read_response(tmp_path / "a.mat")
    found = read_response(tmp_path / "a.mat", columns={"complex": "ResponseData(2,1)"})
    np.testing.assert_array_equal(found.values, 3 * H)


def test_columns_are_named_where_nothing_tells_them(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.csv", np.c_[HZ, DB, DEG, 0.5 + 0 * HZ], delimiter=",")
    named = {"gain": "column_2", "phase": "column_3", "coherence": "column_4"}
    found = read_response(tmp_path / "a.csv", columns=named, units={"frequency": "Hz", "gain": "dB", "phase": "deg"})
    np.testing.assert_allclose(found.values, H)
    assert found.coherence is not None
    assert (found.coherence == 0.5).all()


def test_rows_with_a_blank_are_left_out_and_told() -> None:
    gaps = np.where(np.arange(len(W)) == 3, np.nan, H.real)
    found = read_response({"f [Hz]": HZ, "re": gaps, "im": H.imag})
    assert len(found) == len(W) - 1
    assert found.notes == ("1 rows with a blank left out",)


REFUSED: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "two responses": ({"f [Hz]": HZ, "mag1 [dB]": DB, "mag2 [dB]": DB, "ph [deg]": DEG}, {}, "several columns may be"),
    "a gain alone": ({"f [Hz]": HZ, "mag [dB]": DB}, {}, "the phase of the response is missing"),
    "no frequencies": ({"x": H.real, "mag [dB]": DB, "ph [deg]": DEG}, {}, "no column rises"),
    "one for each load": (
        {"f [Hz]": np.tile(HZ, 2), "re": np.tile(DB, 2), "im": np.tile(DEG, 2)},
        {},
        "several sweeps",
    ),
    "a unit that is none": ({"f": HZ, "re": DB, "im": DEG}, {"units": {"frequency": "bar"}}, "no such unit"),
    "a part that is none": ({"f": HZ, "re": DB, "im": DEG}, {"columns": {"size": "re"}}, "columns has no size"),
    "a column that is none": ({"f": HZ, "re": DB, "im": DEG}, {"columns": {"real": "r"}}, "real|r"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_response_is_refused(case: str) -> None:
    columns, asked, says = REFUSED[case]
    with pytest.raises(UserError, match=says):
        read_response(columns, **asked)
