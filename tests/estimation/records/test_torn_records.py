"""Records that masked samples tear into stretches, each with a first state of its own under a model of the noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid


@pytest.mark.parametrize(
    "structure",
    [
        sysid.BJ(nb=(1,), nf=(1,), nc=1, nd=1, nk=(1,)),
        sysid.ARMAX(na=1, nb=(1,), nc=1, nk=(1,)),
        sysid.LinearStateSpace(states=1),
        sysid.OE(nb=(1,), nf=(1,), nk=(1,)),
    ],
    ids=lambda one: type(one).__name__,
)
def test_many_lone_masked_samples_are_told_where_the_noise_is_modelled(structure: object) -> None:
    """Coefficients had intervals that did not hold the truth, without a word."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)
    y = lfilter([0.0, 0.2], [1.0, -0.8], u) + 0.03 * rng.normal(size=600)
    lone, block = y.copy(), y.copy()
    lone[10::12] = np.nan
    block[200:300] = np.nan
    for values, said in ((lone, not isinstance(structure, sysid.OE)), (block, False)):
        traces = sysid.data((u, values), sample_time=1.0, repairs={"nan": "mask"})
        notes = sysid.fit(traces, "u -> y", structure).notes
        assert any("Masked samples part these records into" in note for note in notes) is said


def test_short_records_are_not_called_masked() -> None:
    rng = np.random.default_rng(3)
    inputs = [np.repeat(rng.choice([-1.0, 1.0], 6), 5) for _ in range(3)]
    records = [(u, 1.0 + lfilter([0.0, 0.2], [1.0, -0.8], u) + 0.03 * rng.normal(size=30)) for u in inputs]
    structure = sysid.BJ(nb=(1,), nf=(1,), nc=1, nd=1, nk=(1,))
    start = sysid.Start(kind="estimated")
    notes = sysid.fit(sysid.data(records, sample_time=1.0), "u -> y", structure, start=start).notes
    assert any("These are 3 records of some 30 samples" in note for note in notes)
    assert not any("Masked" in note for note in notes)
