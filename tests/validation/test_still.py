"""Scored records in which nothing happens."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

import sysid
from sysid.models import Mapping
from sysid.traces import TraceSet
from sysid.validation.still import still


def records(level: float) -> TraceSet:
    """A lag of the first order; in the second half the input stands, and the output settles before it or not."""
    rng = np.random.default_rng(0)
    u = np.repeat([*rng.uniform(-1.0, 1.0, 10), *([0.4] * 12)], 20)
    y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 0.005 * rng.standard_normal(len(u))
    y[240:] += level * 0.9 ** np.arange(200)
    return sysid.data([(u[:200], y[:200]), (u[240:], y[240:])], sample_time=0.1, split=["estimation", "validation"])


def test_a_fit_in_percent_of_noise_is_told() -> None:
    """The right model had a fit of 0 % there, without a word."""
    found = sysid.compare(traces := records(0.0), sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1)))
    assert [note for note in found.notes if "In record-2 no input moves, and y hardly does" in note]


def test_an_output_that_moves_by_itself_is_worth_a_score() -> None:
    one, other = records(1.0)
    assert still(Mapping.parse("u -> y"), [one], [other]) == ()
    assert still(Mapping.parse("-> y"), [one], [other]) == ()
    assert still(Mapping.parse("u -> y"), [one], [one]) == ()


def test_an_output_that_moves_little_is_told_though_inputs_move() -> None:
    """Errors of a tenth of what was fitted were a fit of -790 % there, without a word."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 40), 10)
    u[200:] *= 0.05
    y = lfilter([0.0, 0.1], [1.0, -0.9], u) + 0.005 * rng.standard_normal(len(u))
    traces = sysid.data([(u[:200], y[:200]), (u[240:], y[240:])], sample_time=0.1, split=["estimation", "validation"])
    found = sysid.compare(traces, sysid.fit(traces, "u -> y", sysid.ARX(na=1, nb=1, nk=1)))
    (told,) = (note for note in found.notes if "record-2" in note)
    assert "In record-2 y moves by no more than" in told
