"""The phase of a measured response has every turn of a dead time, however far apart the frequencies are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid

DEAD, T = 30, 0.5


def _data(seed: int, noise: float) -> sysid.traces.TraceSet:
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(6000)
    late = np.r_[np.zeros(DEAD), u[:-DEAD]]
    y = lfilter([0.2], [1.0, -0.8], late)
    return sysid.data((u, y + noise * y.std() * rng.standard_normal(len(y))), sample_time=T)


def _true(w: np.ndarray) -> np.ndarray:
    z = np.exp(1j * w * T)
    return np.degrees(-DEAD * w * T - np.angle(1.0 - 0.8 / z))


@pytest.mark.parametrize("noise", [0.0, 0.5])
@pytest.mark.parametrize(
    "w",
    [
        pytest.param(np.array([0.1, 0.7, 2.3, 5.0]), id="four"),
        pytest.param(np.array([3.1]), id="one"),
        pytest.param(np.array([5.0, 0.1, 2.3]), id="in any order"),
        pytest.param(np.pi / T * np.arange(1, 201) / 200, id="the usual ones"),
    ],
)
def test_a_dead_time_loses_no_turn_between_far_frequencies(w: np.ndarray, noise: float) -> None:
    found = sysid.frequency_response(_data(0, noise), "u -> y", frequency=w, resolution=0.03)
    error = np.degrees(found.phase[:, 0]) - _true(w)
    assert np.abs(error).max() < (10.0 if noise == 0.0 else 60.0)  # what the window smears, and noise; a turn is 360


def test_a_frequency_that_is_not_in_the_input_turns_nothing_behind_it() -> None:
    """Below 1 rad/s nothing moves: the phase there is anybody's, and had been unwrapped through."""
    n = np.arange(8000)
    rng = np.random.default_rng(3)
    lines = np.arange(300, 4000)  # of 2 pi / (8000 T) rad/s: from 0.47 rad/s on
    u = np.fft.irfft(np.r_[np.zeros(300), np.exp(2j * np.pi * rng.random(len(lines))), 0.0]) * 100.0
    y = lfilter([0.2], [1.0, -0.8], np.r_[np.zeros(DEAD), u[:-DEAD]]) + 0.02 * rng.standard_normal(len(n))
    w = np.array([1.0, 2.0, 4.0, 6.0])
    found = sysid.frequency_response(sysid.data((u, y), sample_time=T), "u -> y", frequency=w)
    assert np.abs(np.degrees(found.phase[:, 0]) - _true(w)).max() < 20.0


def test_a_model_is_drawn_over_far_frequencies_with_as_many_turns() -> None:
    data = _data(0, 0.0)
    fit = sysid.fit(data, "u -> y", sysid.ARX(na=1, nb=1, nk=DEAD), stability=sysid.StabilityOptions(count=0))
    found = sysid.frequency_response(data, frequency=np.array([0.1, 2.3, 5.0]), resolution=0.03)
    below = found.plot(fit, unit="rad/s").axes[1]
    np.testing.assert_allclose(below.lines[1].get_ydata(), below.lines[0].get_ydata(), atol=5.0)
