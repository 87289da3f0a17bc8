"""Errors by level of the target: every sample in one band, and none lost."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.reporting.sections.amplitude import amplitude_figure, bands
from sysid.reporting.signals import CaseSignals


def signals(target: np.ndarray, error: np.ndarray) -> CaseSignals:
    time = np.arange(len(target), dtype=np.float64)
    return CaseSignals(time=time, target=target, simulated=target + error, predicted=target)


def test_every_sample_lies_in_one_band_and_the_bands_add_up_to_the_whole_error() -> None:
    rng = np.random.default_rng(3)
    cases = {name: signals(rng.uniform(0.0, 60.0, 500), rng.standard_normal(500)) for name in ("A", "B")}
    found = bands(cases)
    whole = np.concatenate([case.error for case in cases.values()])
    assert sum(band.samples for band in found) == 1000
    assert sum(band.samples * band.rms**2 for band in found) == pytest.approx(float(np.sum(whole**2)))
    assert max(band.largest for band in found) == np.max(np.abs(whole))
    assert [band.high for band in found[:-1]] == [band.low for band in found[1:]]


def test_an_error_at_one_level_is_found_at_that_level() -> None:
    target = np.linspace(0.0, 80.0, 801)
    found = bands({"A": signals(target, np.where((target > 31.0) & (target < 39.0), -2.0, 0.0))})
    assert [band.largest for band in found] == [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0]
    assert found[3].mean < -1.5


@pytest.mark.parametrize("last", [np.inf, np.nan])
def test_a_free_run_that_diverges_leaves_no_number_in_its_band(last: float) -> None:
    target = np.linspace(0.0, 8.0, 81)
    error = np.zeros(81)
    error[-1] = last
    found = bands({"A": signals(target, error)})
    assert np.isnan(found[-1].rms)
    assert found[0].rms == 0.0
    assert amplitude_figure(found, label="level", unit="m").axes


def test_a_level_that_does_not_occur_has_no_sample_and_no_error() -> None:
    found = bands({"A": signals(np.array([0.0, 1.0, 8.0]), np.zeros(3))})
    assert [band.samples for band in found] == [1, 1, 0, 0, 0, 0, 0, 1]
    assert np.isnan(found[4].rms)


def test_a_target_that_does_not_vary_has_no_levels() -> None:
    assert bands({"A": signals(np.full(5, 3.0), np.ones(5))}) == []
    assert bands({}) == []
