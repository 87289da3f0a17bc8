"""A dead time of a measured frequency response is a time, and no multiple of a sample time that nobody asked for."""

from __future__ import annotations

import numpy as np
import pytest

import sysid
from sysid.api.measured_responses.fitting import ResponseFit

W = np.logspace(-1, 2, 80)
TRUTH = np.array([10.0, 16.0, 1.2])


def fitted(seconds: float, *, noise: float = 0.0, seed: int = 0, **options: object) -> ResponseFit:
    rng, s = np.random.default_rng(seed), 1j * W
    H = 10.0 * np.exp(-seconds * s) / (s**2 + 1.2 * s + 16.0)
    H = H * (1.0 + noise * (rng.standard_normal(len(W)) + 1j * rng.standard_normal(len(W))))
    structure = sysid.TransferFunction(poles=(2,), zeros=(0,), domain="continuous")
    swept = sysid.response_data({"w [rad/s]": W, "H": H})
    return sysid.fit_response(swept, structure, weighting="relative", **options)


def dead_time(fit: ResponseFit) -> float:
    return float(fit.model.delays[0] * fit.model.sample_time)


@pytest.mark.parametrize("seconds", [0.0199, 0.00257, 0.0])
def test_a_dead_time_between_samples_is_found(seconds: float) -> None:
    """The nearest sample was 9 degrees off at the highest frequency, and the poles made up for it."""
    fit = fitted(seconds)
    assert dead_time(fit) == pytest.approx(seconds, abs=1e-5)
    np.testing.assert_allclose(fit.uncertainty.values, TRUTH, rtol=1e-3)
    assert fit.furthest[1] < 0.1


def test_intervals_hold_the_truth_as_what_is_not_known_of_it_is_in_them() -> None:
    off, late = [], []
    for seed in range(6):
        fit = fitted(0.0199, noise=0.01, seed=seed)
        off.append((fit.uncertainty.values - TRUTH) / fit.uncertainty.standard_deviations)
        (told,) = [one for one in fit.notes if one.startswith("Dead time: ")]
        late.append((dead_time(fit) - 0.0199) / (float(told.split("±")[1].split()[0]) / 1.96))
    assert 0.5 < float(np.sqrt(np.mean(np.square(off)))) < 1.7
    assert 0.3 < float(np.sqrt(np.mean(np.square(late)))) < 1.8


def test_where_somebody_says_the_sample_time_the_dead_time_is_a_multiple_of_it() -> None:
    fit = fitted(0.0199, sample_time=0.004)
    assert (fit.model.sample_time, fit.model.delays) == (0.004, (5,))
    assert not any(one.startswith("Dead time: ") for one in fit.notes)
