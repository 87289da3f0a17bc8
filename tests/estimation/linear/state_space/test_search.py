"""Of state spaces each contains those of fewer states: it is never worse over the records that it was fitted to."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import sysid


@pytest.mark.parametrize("noise", [True, False], ids=["innovations", "output error"])
@pytest.mark.parametrize("seed", range(4))
def test_more_states_never_fit_the_records_worse(seed: int, noise: bool) -> None:
    """A valve's curve, a limit and noise: no linear system is right, and subspace starts may end in a bad minimum."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.5, 4.0, 30), 10)
    x = np.zeros((2, 301))
    for k in range(300):
        x[0, k + 1] = min(x[0, k] + 0.3 * u[k] - 0.35 * np.sqrt(max(x[0, k], 0.0)), 10.0)
        x[1, k + 1] = x[1, k] + 0.35 * np.sqrt(max(x[0, k], 0.0)) - 0.3 * np.sqrt(max(x[1, k], 0.0))
    y = x[1, :-1] + 0.05 * rng.standard_normal(300)
    traces = sysid.data((u, y), sample_time=1.0)
    errors = [
        sysid.fit(traces, "u -> y", sysid.LinearStateSpace(states=n, noise=noise)).history["mse"][-1]
        for n in (1, 2, 3, 4)
    ]
    assert all(after <= before * (1.0 + 1e-4) for before, after in itertools.pairwise(errors)), errors
