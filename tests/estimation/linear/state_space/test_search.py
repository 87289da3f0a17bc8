"""Of state spaces each contains those of fewer states: it is never worse over the records that it was fitted to."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import sysid


@pytest.mark.parametrize(
    ("seed", "samples", "noise"),
    [(3, 300, True), (13, 300, True), (14, 600, True), (2, 300, False), (5, 600, False)],
    ids=str,
)
def test_more_states_never_fit_the_records_worse(seed: int, samples: int, noise: bool) -> None:
    """Two tanks that may flow over: from subspace estimates alone each of these ends in a worse minimum at 3 or 4."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.5, 4.0, samples // 10), 10)
    x = np.full((2, samples + 1), 4.0)
    for k in range(samples):
        x[0, k + 1] = min(x[0, k] + 0.12 * u[k] - 0.14 * np.sqrt(max(x[0, k], 0.0)), 10.0)
        x[1, k + 1] = min(x[1, k] + 0.14 * np.sqrt(max(x[0, k], 0.0)) - 0.13 * np.sqrt(max(x[1, k], 0.0)), 10.0)
    traces = sysid.data((u, x[1, :-1] + 0.01 * rng.standard_normal(samples)), sample_time=1.0)
    errors = [
        sysid.fit(traces, "u -> y", sysid.LinearStateSpace(states=n, noise=noise)).history["mse"][-1]
        for n in (1, 2, 3, 4)
    ]
    assert all(after <= before * (1.0 + 1e-4) for before, after in itertools.pairwise(errors)), errors
