"""Whether the parameters of a fit one step ahead are known well enough for a free run."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid
from sysid.models import AbstractStructure
from sysid.traces import TraceSet

TOLD = "not known well enough for a free run"


def record(n: int, noise: float) -> TraceSet:
    """A slow plant under a drift of its own, in few samples or in many."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.standard_normal(n // 5), 5)
    y = lfilter([0.0, 0.05], [1.0, -0.95], u) + noise * lfilter([0.3], [1.0, -0.97], rng.standard_normal(n))
    return sysid.data((u, y), sample_time=1.0)


ONE_STEP = pytest.mark.parametrize(
    "structure", [sysid.ARX(na=8, nb=8, nk=1), sysid.LinearStateSpace(states=3)], ids=str
)


@ONE_STEP
def test_a_short_record_of_a_slow_plant_is_told(structure: AbstractStructure) -> None:
    fit = sysid.fit(record(60, noise=0.5), "u -> y", structure)
    (told,) = (note for note in fit.notes if TOLD in note)
    assert told in fit.warnings
    assert "that of y by ±" in told


@ONE_STEP
def test_a_long_one_is_not(structure: AbstractStructure) -> None:
    fit = sysid.fit(record(2_000, noise=0.05), "u -> y", structure)
    assert not any(TOLD in note for note in fit.notes)


def test_a_fit_of_the_free_run_keeps_near_the_record() -> None:
    fit = sysid.fit(record(60, noise=0.5), "u -> y", sysid.OE(nb=2, nf=2, nk=1))
    assert not any(TOLD in note for note in fit.notes)
