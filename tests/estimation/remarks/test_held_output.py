"""Outputs that are measured more slowly than they are recorded: found, told by every fit, and mended by one repair."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

import sysid
from sysid.estimation.nonparametric.segments import Segment
from sysid.estimation.remarks.held_output import held_for

POLE, EVERY = 0.95, 5


def record(seed=0, n=2000, hold=20, noise=0.01):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, n // hold + 1), hold)[:n]
    return u, lfilter([0.0, 1.0 - POLE], [1.0, -POLE], u) + noise * rng.standard_normal(n)


def told(u, y):
    return held_for([Segment(inputs=u[:, np.newaxis], output=y)])


def test_a_hold_is_found_and_one_that_is_not_quite_regular_too():
    u, y = record()
    assert told(u, np.repeat(y[::EVERY], EVERY)) == EVERY
    at = np.cumsum(np.random.default_rng(1).integers(4, 7, len(y)))
    at = at[at < len(y)]
    assert told(u, y[np.maximum.accumulate(np.where(np.isin(np.arange(len(y)), at), np.arange(len(y)), 0))]) == EVERY


def test_an_output_that_its_held_inputs_let_move_is_measured_at_every_sample():
    u, _ = record(noise=0.0)
    assert told(u, 2.0 * u + 1.0) == 1


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 999),
    hold=st.integers(1, 40),
    step=st.floats(1e-4, 0.2),
    noise=st.sampled_from([0.0, 0.003, 0.1]),
)
def test_a_converter_however_coarse_is_no_hold(seed, hold, step, noise):
    u, y = record(seed, hold=hold, noise=noise)
    assert told(u, np.round(y / step) * step) == 1


@pytest.mark.parametrize(
    "structure", [sysid.TransferFunction(poles=1, zeros=0, delays=1), sysid.NeuralStateSpace(states=1, neurons=2)]
)
def test_every_fit_tells_it_and_its_remedy_works(structure):
    u, y = record()
    values = {"u": u, "level": np.repeat(y[::EVERY], EVERY)}
    asked = {"inputs": "u", "outputs": "level", "sample_time": 0.1}
    training = sysid.Training(starts=1, max_iterations=20) if "Neural" in type(structure).__name__ else None
    found = sysid.fit(sysid.data(values, **asked), "u -> level", structure, training, stability=None)
    assert any("level changes only after 5 samples" in one and "{level: mask}" in one for one in found.warnings)
    mended = sysid.data(values, repairs={"repeats": {"level": "mask"}}, **asked)
    again = sysid.fit(mended, "u -> level", structure, training, stability=None)
    assert not again.warnings
    if training is None:
        lag, mended_lag = (float(one.poles().to_frame()["pole"].iloc[0].real) for one in (found, again))
        assert abs(mended_lag - POLE) < 0.002 < abs(lag - POLE)
