"""A step within the samples that give the first state: what is scored behind it is noise, and that is told."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

import sysid

N = 300
STRUCTURE = sysid.OE(nb=1, nf=1, nk=1)


def record(before: int, again: int | None = None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    u = (np.arange(N) >= before).astype(float)
    u[N if again is None else again :] = 0.0
    return u, lfilter([0.0, 0.2], [1.0, -0.8], u) + 0.02 * np.random.default_rng(1).standard_normal(N)


@pytest.mark.parametrize("before", [1, 3])
def test_a_step_too_early_for_a_state_is_told(before: int) -> None:
    traces = sysid.data(record(before), sample_time=1.0)
    (told,) = sysid.fit(traces, "u -> y", STRUCTURE).warnings
    assert told.startswith("u moves within the first 50 samples of a record alone")
    assert sysid.fit(traces, "u -> y", STRUCTURE, start="first-sample").warnings == ()


@pytest.mark.parametrize(("before", "again"), [(5, None), (20, None), (50, None), (3, 200)])
def test_a_step_test_is_scored_over_its_step(before: int, again: int | None) -> None:
    """A step at sample 20 was answered within the window, and a good model of it was told to be no better than a
    constant."""
    traces = sysid.data(record(before, again), sample_time=1.0)
    fit = sysid.fit(traces, "u -> y", STRUCTURE)
    assert fit.warnings == ()
    (evaluation,) = sysid.compare(traces, fit).evaluations.values()
    (found,) = evaluation.cases.values()
    assert found.free_run.nrmse_fit > 75.0
