"""Frequency responses: the plant's, within their bands, by every method; coherence; what was not excited."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from sysid.errors import ConfigError, TraceError
from sysid.estimation.nonparametric.response import estimate_frequency_response
from sysid.estimation.nonparametric.spectra import SpectralMethod
from sysid.models import Mapping
from sysid.traces import Trace
from tests.estimation.nonparametric.test_impulse import ONE, TWO, trace

T = 0.5


def plant(w: NDArray[np.float64]) -> NDArray[np.complex128]:
    z = np.exp(-1j * w * T)
    return np.stack([0.4 * z / (1 - 0.7 * z), -0.2 * z**2 / (1 - 0.5 * z)], axis=1)


def record(n: int, seed: int, noise: float = 0.3) -> Trace:
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((n, 2))
    y = lfilter([0, 0.4], [1, -0.7], u[:, 0]) + lfilter([0, 0, -0.2], [1, -0.5], u[:, 1])
    return trace(u, y + 7.0 + lfilter([noise], [1, -0.6], rng.standard_normal(n)))


@pytest.mark.parametrize("method", SpectralMethod)
def test_the_discs_hold_the_plant_in_nineteen_of_twenty(method: SpectralMethod) -> None:
    inside = []
    for seed in range(8):
        found = estimate_frequency_response([record(2000, seed)], TWO, method=method, resolution=0.3)
        inside.append(np.mean(np.abs(found.values - plant(found.frequency)) <= found.radius))
    assert 0.9 < np.mean(inside) < 0.99


def test_coherence_is_the_share_of_the_inputs() -> None:
    quiet = estimate_frequency_response([record(4000, 0, noise=0.0)], TWO)
    loud = estimate_frequency_response([record(4000, 0, noise=3.0)], TWO)
    assert np.nanmin(quiet.coherence) > 0.98
    assert np.nanmedian(loud.coherence) < 0.3


def test_a_finer_resolution_has_wider_bands() -> None:
    coarse, fine = (estimate_frequency_response([record(2000, 1)], TWO, resolution=r) for r in (0.5, 0.1))
    assert np.median(fine.radius) > 1.5 * np.median(coarse.radius)
    assert fine.resolution == pytest.approx(0.1, rel=0.1)


def test_whole_periods_are_averaged_and_lines_that_are_not_excited_are_said_to_be() -> None:
    rng = np.random.default_rng(2)
    t = np.arange(1200) % 100
    u = np.sum([np.cos(2 * np.pi * k * t / 100 + 7 * k * k) for k in (1, 3, 5, 9)], axis=0)
    y = lfilter([0, 0.4], [1, -0.7], u) + 0.05 * rng.standard_normal(1200)
    found = estimate_frequency_response([trace(u, y)], ONE, method=SpectralMethod.ETFE, period=100)
    seen = np.isfinite(found.gain[:, 0])
    assert np.flatnonzero(seen).tolist() == [0, 2, 4, 8]
    assert np.all(
        np.abs(found.values[seen, 0] - plant(found.frequency[seen])[:, 0]) < 2.0 * found.radius[seen, 0] + 0.01
    )
    assert len(found.notes) == 1


def test_one_periodogram_has_no_bands_and_says_so() -> None:
    found = estimate_frequency_response([record(200, 3)], TWO, method=SpectralMethod.ETFE)
    assert np.isnan(found.radius).all()
    assert found.notes


def test_experiments_and_gaps_are_averaged_and_not_joined() -> None:
    a, b = record(800, 4), record(900, 5)
    usable = np.arange(900) % 300 != 0
    spoiled = b.values.copy()
    spoiled[~usable] = 1e6
    b = trace(spoiled[:, :2], spoiled[:, 2], name="b", usable=usable)
    found = estimate_frequency_response([a, b], TWO, resolution=0.4)
    assert np.mean(np.abs(found.values - plant(found.frequency)) <= 1.5 * found.radius) > 0.9


def test_the_frame_has_gains_between_their_bands() -> None:
    frame = estimate_frequency_response([record(500, 6)], TWO).to_frame()
    assert set(frame["input"]) == {"u1", "u2"}
    assert ((frame["gain_low"] <= frame["gain"]) & (frame["gain"] <= frame["gain_high"])).all()


@pytest.mark.parametrize("arguments", [{"resolution": 0.0}, {"period": 2}, {"frequency": np.array([np.nan])}])
def test_options_out_of_range_are_refused(arguments: dict[str, object]) -> None:
    with pytest.raises(ConfigError):
        estimate_frequency_response([record(100, 7)], TWO, **arguments)


def test_too_short_a_record_and_one_without_inputs_are_refused() -> None:
    with pytest.raises(TraceError):
        estimate_frequency_response([record(9, 7)], TWO)
    with pytest.raises(ConfigError):
        estimate_frequency_response([record(100, 7)], Mapping.parse("-> y"))


def test_a_tone_beside_a_broad_input_is_not_seen_where_it_has_no_power() -> None:
    rng = np.random.default_rng(5)
    u = np.stack([rng.standard_normal(2000), 1e4 * np.sin(0.8 * np.arange(2000))], axis=1)
    found = estimate_frequency_response([trace(u, lfilter([0, 0.4], [1, -0.7], u[:, 0]))], TWO)
    lost = found.inputs[:, 1] <= 0.0
    assert lost.any()
    assert np.isnan(found.values[lost]).all()
