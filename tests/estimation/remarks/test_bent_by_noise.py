"""ARX models that noise on the output has bent are told by what instruments make of the same orders."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid

N = 1200
A = np.poly([0.97 * np.exp(1.2j), 0.97 * np.exp(-1.2j)]).real


@pytest.mark.parametrize("order", [2, 4])
def test_noise_of_a_sensor_is_told_and_no_curve_is(order: int) -> None:
    """It was told as a curve that the model lacks, with a network to try, of a plant that is linear."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 6), 6)
    y = lfilter([0.0, 0.5, 0.3], A, u)
    y += 0.2 * y.std() * rng.standard_normal(N)
    traces = sysid.data((u, y), sample_time=1.0)
    (told,) = sysid.fit(traces, "u -> y", sysid.ARX(na=order, nb=order, nk=1)).warnings
    assert told.startswith("Least squares one step ahead has bent this model")
    assert sysid.fit(traces, "u -> y", sysid.OE(nb=2, nf=2, nk=1)).warnings == ()


def test_noise_that_has_the_plants_poles_bends_nothing() -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 6), 6)
    y, v = lfilter([0.0, 0.5, 0.3], A, u), lfilter([1.0], A, rng.standard_normal(N))
    traces = sysid.data((u, y + 0.3 * y.std() / v.std() * v), sample_time=1.0)
    told = sysid.fit(traces, "u -> y", sysid.ARX(na=2, nb=2, nk=1)).warnings
    assert not [one for one in told if "bent" in one]
