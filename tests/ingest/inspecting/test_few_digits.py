"""Clocks of which only the first digits were written, as by ``%g``: no sample is lost, and the step is theirs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.ingest import inspect_file, load_dataset, propose_dataset
from sysid.ingest.inspecting.restarts import of_few_digits


def written(step: float, digits: int, n: int, first: float = 0.0) -> list[float]:
    return [float(f"{first + k * step:.{digits}g}") for k in range(n)]


@pytest.mark.parametrize(("step", "digits", "n"), [(0.135, 3, 3000), (0.01, 5, 150_000), (0.5, 4, 30_000)])
def test_a_clock_of_few_digits_loses_no_sample(tmp_path: Path, step: float, digits: int, n: int) -> None:
    rows = "".join(f"{t:.12g},{k % 7},{k % 11}\n" for k, t in enumerate(written(step, digits, n)))
    (tmp_path / "rig.csv").write_text(f"time [s],u,y\n{rows}")
    found = inspect_file(tmp_path / "rig.csv")
    assert f"the clock is written in {digits} digits" in found.time_told
    (tmp_path / "dataset.yaml").write_text(propose_dataset(found))
    trace = load_dataset(tmp_path / "dataset.yaml").traces[0]
    assert (len(trace), trace.sample_time) == (n, step)


@given(st.floats(1e-4, 10.0), st.integers(2, 6), st.integers(50, 400), st.floats(0.0, 100.0))
def test_what_is_found_has_all_of_the_stamps(step: float, digits: int, n: int, first: float) -> None:
    stamps = np.array(written(step, digits, n, float(f"{first:.{digits}g}")))
    found = of_few_digits(stamps)
    unit = 10.0 ** (np.floor(np.log10(np.maximum(stamps, 1e-300)) + 1e-12) - digits + 1)
    if stamps[-1] - stamps[0] > 10.0 * unit[-1]:
        assert found is not None
        again = stamps[0] + found[0] * np.arange(n)
        assert np.all(np.abs(again - stamps) <= 0.5 * (unit + unit[0]) * (1.0 + 1e-5))


@pytest.mark.parametrize(
    "stamps",
    [
        [0.0, 0.1, 0.2, 0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2],  # a sample is missing
        [0.0, 1.0, 1.0, 2.0, 4.0, 4.0, 7.0, 8.0, 8.0, 11.0, 12.0],  # events
        [3.0, 2.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],  # out of order
    ],
)
def test_a_clock_that_is_uneven_or_stands_is_none(stamps: list[float]) -> None:
    assert of_few_digits(np.array(stamps)) is None
