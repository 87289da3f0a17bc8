"""How fits of equations end: a minimum at a kink of the loss is a minimum."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.estimation import Status


@pytest.mark.parametrize("seed", [0, 2])
def test_a_curve_whose_bends_stand_at_samples_has_come_to_its_minimum(seed: int) -> None:
    """Its error was that of the noise, and it had ended as one that should try another start."""
    rng = np.random.default_rng(4000 + seed)
    u = np.repeat(rng.uniform(-1.5, 1.5, 150), 8)
    y = lfilter([0.0, 0.12, 0.08], [1.0, -1.5, 0.7], np.clip(u, -0.5, 0.5))
    noise = 0.03 * y.std()
    traces = sysid.data((u, y + noise * rng.standard_normal(len(u))), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y", sysid.HammersteinWiener(states=2, input="piecewise 6"))
    assert fit.history["mse"][-1] < 1.05 * noise**2
    assert fit.status is Status.CONVERGED
