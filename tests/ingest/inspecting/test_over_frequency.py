"""Tables whose rows are frequencies and no samples over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sysid.ingest import inspect_file

N = 40
LOGARITHMIC, EVEN = np.logspace(0, 3, N), np.arange(1.0, N + 1)

SWEEPS: dict[str, dict[str, np.ndarray]] = {
    "a sweep": {"Frequency_Hz": LOGARITHMIC, "gain": 1 / LOGARITHMIC, "phase [deg]": -LOGARITHMIC},
    "an even one, which rises as a clock does": {"freq [Hz]": EVEN, "mag [dB]": -EVEN},
    "one for each load": {"load": np.repeat([1.0, 2.0], N), "f [kHz]": np.tile(EVEN, 2), "gain": np.tile(1 / EVEN, 2)},
    "in rad/s": {"omega": LOGARITHMIC, "re": 1 / LOGARITHMIC, "im": -1 / LOGARITHMIC},
}

RECORDS: dict[str, dict[str, np.ndarray]] = {
    "a frequency that is a signal": {"freq [Hz]": 50 + np.sin(EVEN), "y": np.cos(EVEN)},
    "an instantaneous frequency beside a clock": {"t [s]": EVEN, "freq [Hz]": LOGARITHMIC, "y": np.cos(EVEN)},
    "a ramp of something else": {"speed": LOGARITHMIC, "y": np.cos(EVEN)},
}


@pytest.mark.parametrize("case", SWEEPS)
def test_a_frequency_response_is_told(tmp_path: Path, case: str) -> None:
    pd.DataFrame(SWEEPS[case]).to_csv(tmp_path / "a.csv", index=False)
    found = inspect_file(tmp_path / "a.csv")
    assert any("these rows are frequencies" in problem and "fit_spectra" in problem for problem in found.problems)
    assert found.time.column is None


@pytest.mark.parametrize("case", RECORDS)
def test_a_record_over_time_is_none(tmp_path: Path, case: str) -> None:
    pd.DataFrame(RECORDS[case]).to_csv(tmp_path / "a.csv", index=False)
    assert not any("frequencies" in problem for problem in inspect_file(tmp_path / "a.csv").problems)
