"""What is told of a free run that is lost: for its poles, or for its first state alone."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid


def test_a_run_that_is_lost_diverges_and_has_no_percent() -> None:
    """It had a fit of minus 10 to the 40th percent, digit by digit."""
    rng = np.random.default_rng(0)
    u, y = np.zeros(900), np.zeros(900)
    for k in range(1, 900):
        y[k] = 1.1 * y[k - 1] + 0.5 * u[k - 1] + 0.01 * rng.standard_normal()
        u[k] = rng.uniform(-1.0, 1.0) - 0.8 * y[k]
    fit = sysid.fit(sysid.data((u, y), sample_time=0.1), "u -> y", sysid.ARX(na=1, nb=1, nk=1))
    assert [note for note in fit.notes if "worse than a constant (it diverges)" in note]


@pytest.mark.parametrize(
    "structure", [sysid.ARX(na=1, nb=1, nk=1), sysid.LinearStateSpace(states=1)], ids=["ARX", "SS"]
)
@pytest.mark.parametrize("records", [1, 2])
@pytest.mark.parametrize("n", [900, 2_000, 4_000, 9_000])
def test_a_run_of_any_length_that_is_lost_ends_no_fit(structure: object, records: int, n: int) -> None:
    """1.1 to the 4,000th: what was asked of the error of a plant that a controller holds ended in an overflow."""
    rng = np.random.default_rng(3)
    r = np.repeat(rng.choice([-1.0, 1.0], n // 30 + 1), 30)
    u, y = np.zeros(n), np.zeros(n)
    for k in range(1, n):
        y[k] = 1.1 * y[k - 1] + 0.2 * u[k - 1] + 0.05 * rng.standard_normal()
        u[k] = 3.0 * (r[k] - y[k])
    traces = sysid.data([(u, y)] * records, sample_time=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit = sysid.fit(traces, "u -> y", structure)
    assert fit.model.pole_radius == pytest.approx(1.1, abs=0.02)
    assert [note for note in fit.notes if "worse than a constant (it diverges)" in note]
    assert not [note for note in fit.notes if "no noise of a sensor" in note]


@pytest.mark.parametrize("seed", [0, 3])
def test_a_run_that_is_poor_for_its_first_state_is_not_blamed_on_the_inputs(seed: int) -> None:
    """Three slow inputs, and a record that begins far from rest: its fit was -110 %, and *other orders* the remedy."""
    rng = np.random.default_rng(seed)
    u = [np.repeat(rng.uniform(-1, 1, 30), 10) for _ in range(3)]
    y = 0.2 * lfilter([0, 0.02], [1, -1.97, 0.9704], u[0]) + lfilter([0, 0.01], [1, -0.99], u[1])
    y = y + 0.05 * lfilter([1], [1, -0.95], rng.standard_normal(300)) + 5 * np.exp(-np.arange(300) / 80)
    traces = sysid.data((np.column_stack(u), y), sample_time=1.0)
    fit = sysid.fit(traces, "u1+u2+u3 -> y", sysid.OE(nb=(2, 2, 2), nf=(2, 2, 2), nk=(1, 1, 1)))
    (told,) = (note for note in fit.warnings if "for how it begins" in note)
    assert "Record from rest" in told
    assert not [note for note in fit.warnings if "than a constant" in note or "Nothing in these records" in note]
