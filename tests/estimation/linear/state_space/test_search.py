"""Of state spaces each contains those of fewer states: it is never worse over the records that it was fitted to."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid


def two_tanks(seed: int, samples: int) -> sysid.TraceSet:
    """One above the other, both may flow over: no linear system is right."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.5, 4.0, samples // 10), 10)
    x = np.full((2, samples + 1), 4.0)
    for k in range(samples):
        x[0, k + 1] = min(x[0, k] + 0.12 * u[k] - 0.14 * np.sqrt(max(x[0, k], 0.0)), 10.0)
        x[1, k + 1] = min(x[1, k] + 0.14 * np.sqrt(max(x[0, k], 0.0)) - 0.13 * np.sqrt(max(x[1, k], 0.0)), 10.0)
    return sysid.data((u, x[1, :-1] + 0.01 * rng.standard_normal(samples)), sample_time=1.0)


@pytest.mark.parametrize(
    ("seed", "samples", "noise"),
    [(3, 300, True), (13, 300, True), (14, 600, True), (2, 300, False), (5, 600, False)],
    ids=str,
)
def test_more_states_never_fit_the_records_worse(seed: int, samples: int, noise: bool) -> None:
    """From subspace estimates alone each of these ends in a worse minimum at 3 or 4."""
    traces = two_tanks(seed, samples)
    errors = [
        sysid.fit(traces, "u -> y", sysid.LinearStateSpace(states=n, noise=noise)).history["mse"][-1]
        for n in (1, 2, 3, 4)
    ]
    assert all(after <= before * (1.0 + 1e-4) for before, after in itertools.pairwise(errors)), errors


@pytest.mark.parametrize("seed", [2, 5])
def test_higher_orders_of_an_output_error_model_never_fit_the_records_worse(seed: int) -> None:
    traces = two_tanks(seed, 300)
    errors = [sysid.fit(traces, "u -> y", sysid.OE(nb=n, nf=n, nk=1)).history["mse"][-1] for n in (1, 2, 3, 4)]
    assert all(after <= before * (1.0 + 1e-4) for before, after in itertools.pairwise(errors)), errors


@pytest.mark.parametrize("seed", [2, 3, 5])
def test_an_output_error_model_finds_what_a_state_space_without_noise_finds(seed: int) -> None:
    """They are the same systems."""
    traces = two_tanks(seed, 300)
    ours = sysid.fit(traces, "u -> y", sysid.OE(nb=2, nf=2, nk=1)).history["mse"][-1]
    theirs = sysid.fit(traces, "u -> y", sysid.LinearStateSpace(states=2, noise=False)).history["mse"][-1]
    np.testing.assert_allclose(ours, theirs, rtol=1e-3)


def test_a_model_of_the_noise_never_fits_the_records_worse_than_none() -> None:
    """Of white noise its steps from a subspace estimate end in a worse minimum than those without it."""
    rng = np.random.default_rng(5)
    u = np.repeat(rng.uniform(-1.0, 1.0, (50, 2)), 10, axis=0)
    y = lfilter([0.0, 1.0], np.poly([0.9, 0.8]), u[:, 0]) + lfilter([0.0, 1.0], np.poly([0.95, 0.7]), u[:, 1])
    traces = sysid.data((u, y + 0.05 * y.std() * rng.standard_normal(500)), sample_time=1.0)
    with_noise, without = (
        sysid.fit(traces, "u1+u2 -> y", sysid.LinearStateSpace(states=4, noise=noise)).history["mse"][-1]
        for noise in (True, False)
    )
    assert with_noise < without
