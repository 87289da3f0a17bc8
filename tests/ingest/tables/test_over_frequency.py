"""Tables whose rows are frequencies and no samples over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import sysid
from sysid.errors import UserError
from sysid.ingest import FileOptions, TimeOptions, inspect_file, propose_dataset

N = 40
LOGARITHMIC, EVEN = np.logspace(0, 3, N), np.arange(1.0, N + 1)

SWEEPS: dict[str, dict[str, np.ndarray]] = {
    "a sweep": {"Frequency_Hz": LOGARITHMIC, "gain": 1 / LOGARITHMIC, "phase [deg]": -LOGARITHMIC},
    "an even one, which rises as a clock does": {"freq [Hz]": EVEN, "mag [dB]": -EVEN},
    "one for each load": {"load": np.repeat([1.0, 2.0], N), "f [kHz]": np.tile(EVEN, 2), "gain": np.tile(1 / EVEN, 2)},
    "in rad/s": {"omega": LOGARITHMIC, "re": 1 / LOGARITHMIC, "im": -1 / LOGARITHMIC},
    "a few even ones in rad/s": {"w [rad/s]": EVEN, "gain": 1 / EVEN, "phase [deg]": -EVEN},
    "one that falls, as of impedances": {"Freq": LOGARITHMIC[::-1], "Zreal": LOGARITHMIC, "Zimag": -EVEN},
    "one that only its numbers tell": {"c1": LOGARITHMIC, "c2": -EVEN, "c3": -EVEN},
}

STAMPED: dict[str, dict[str, np.ndarray]] = {
    "potentiostats": {"freq/Hz": LOGARITHMIC[::-1], "Re(Z)/Ohm": EVEN, "-Im(Z)/Ohm": EVEN, "time/s": 1.5 * EVEN},
    "gain analysers": {"Time (Sec)": EVEN, "Freq(Hz)": LOGARITHMIC, "Zmod (ohm)": EVEN, "Zphz (deg)": -EVEN},
    "primes": {"Time(Sec)": EVEN, "Freq(Hz)": LOGARITHMIC, "Z'(a)": EVEN, "Z''(b)": -EVEN},
}

RECORDS: dict[str, dict[str, np.ndarray]] = {
    "a frequency that is a signal": {"freq [Hz]": 50 + np.sin(EVEN), "y": np.cos(EVEN)},
    "an instantaneous frequency beside a clock": {"t [s]": EVEN, "freq [Hz]": LOGARITHMIC, "y": np.cos(EVEN)},
    "the phase of what is swept": {"t [s]": EVEN, "freq [Hz]": LOGARITHMIC, "phase [rad]": np.sin(EVEN)},
    "a motor that is started": {"u [V]": np.ones(N), "omega [rad/s]": 100 * (1 - np.exp(-EVEN / 20))},
    "a shaft in rad/s that runs down": {"speed [rad/s]": 100 * np.exp(-EVEN / 20), "torque [N*m]": np.cos(EVEN)},
    "a ramp of something else": {"speed": LOGARITHMIC, "y": np.cos(EVEN)},
}


@pytest.mark.parametrize("case", SWEEPS)
def test_a_frequency_response_is_told(tmp_path: Path, case: str) -> None:
    pd.DataFrame(SWEEPS[case]).to_csv(tmp_path / "a.csv", index=False)
    found = inspect_file(tmp_path / "a.csv")
    assert any("these rows are frequencies" in problem for problem in found.problems)
    assert found.time.column is None


@pytest.mark.parametrize("case", SWEEPS)
def test_a_frequency_response_is_no_record_at_any_door(tmp_path: Path, case: str) -> None:
    """It had been loaded, advised on and fitted as samples that are 1 s apart."""
    path = tmp_path / "a.csv"
    pd.DataFrame(SWEEPS[case]).to_csv(path, index=False)
    for door in (lambda: sysid.load(path), lambda: propose_dataset(inspect_file(path))):
        with pytest.raises(UserError, match="no record over time") as caught:
            door()
        assert f"sysid fit-response {path} --poles 2" in str(caught.value)
    with pytest.raises(UserError, match=r"(?s)no record over time.*sysid\.fit_response"):
        sysid.data(pd.DataFrame(SWEEPS[case]))


@pytest.mark.parametrize("case", STAMPED)
def test_a_response_whose_rows_have_times_is_no_record_either(tmp_path: Path, case: str) -> None:
    path = tmp_path / "a.csv"
    pd.DataFrame(STAMPED[case]).to_csv(path, index=False)
    for door in (lambda: sysid.load(path), lambda: propose_dataset(inspect_file(path))):
        with pytest.raises(UserError, match="no record over time"):
            door()
    assert len(sysid.response_data(path, units={"gain": "1"})) == N


@pytest.mark.parametrize("case", ["a sweep", "one that only its numbers tell"])
def test_rows_whose_distance_is_said_are_samples(tmp_path: Path, case: str) -> None:
    pd.DataFrame(SWEEPS[case]).to_csv(tmp_path / "a.csv", index=False)
    found = inspect_file(tmp_path / "a.csv", files=FileOptions(time=TimeOptions(step=0.1)))
    assert "sample_time: 0.1" in propose_dataset(found)


def test_complex_numbers_of_a_workspace_are_a_response(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"w": EVEN, "H": 1 / (1 + 1j * EVEN)})
    with pytest.raises(UserError, match="w rises from 1 to 40: these rows are frequencies"):
        sysid.load(tmp_path / "a.mat")


@pytest.mark.parametrize("case", RECORDS)
def test_a_record_over_time_is_none(tmp_path: Path, case: str) -> None:
    pd.DataFrame(RECORDS[case]).to_csv(tmp_path / "a.csv", index=False)
    assert not any("frequencies" in problem for problem in inspect_file(tmp_path / "a.csv").problems)
