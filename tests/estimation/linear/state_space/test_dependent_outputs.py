"""Outputs that are made of each other: their errors have fewer dimensions than there are outputs."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

import sysid


def test_an_output_that_is_the_sum_of_others_is_fitted_with_them() -> None:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.integers(0, 2, 60), 5) * 2.0 - 1.0
    y = np.column_stack([lfilter([0.0, 0.1], [1.0, -0.9], u), lfilter([0.0, 0.1], [1.0, -0.5], u)])
    y += 0.01 * rng.standard_normal(y.shape)
    y = np.column_stack([y, y @ [1.0, 1.0], y @ [1.0, -3.0], y @ [0.3, 0.7]])
    traces = sysid.data((u, y), sample_time=0.1)
    quiet = sysid.StabilityOptions(count=0)
    fit = sysid.fit(traces, "u -> y1+y2+y3+y4+y5", sysid.VectorStateSpace(states=2), stability=quiet)
    np.testing.assert_allclose(np.sort(np.roots(fit.model.ratios[(0, 0)].F)), [0.5, 0.9], atol=0.02)
