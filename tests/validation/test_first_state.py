"""First states that are estimated on too few samples for a pole that does not forget them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

import sysid


@pytest.mark.parametrize(("pole", "told"), [(0.9998, True), (0.95, False)])
def test_what_a_slow_pole_does_with_a_poor_first_state_is_told(pole: float, told: bool) -> None:
    """The plant itself loses a point of the fit on the unseen half, without a word."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 80), 50)
    y = lfilter([0.0, 1.0 - pole], [1.0, -pole], u)
    y = y / y.std() + 0.1 * rng.normal(size=4000)
    traces = sysid.data((u, y), sample_time=1.0, split=0.5)
    fit = sysid.fit(traces, "u -> y", sysid.OE(nb=(1,), nf=(1,), nk=(1,)))
    found = [note for note in sysid.compare(traces, fit).notes if "does not forget how a run begins" in note]
    assert bool(found) is told
    if told:
        (note,) = found
        assert "start: {estimated: 400}" in note
        score = sysid.compare(traces, fit, start={"estimated": 400})
        assert f"on 400 samples {score.to_frame()['fit'][1]:.2f} %" in note
        assert not [note for note in score.notes if "does not forget" in note]
        assert not [note for note in sysid.compare(traces, fit, start="rest").notes if "does not forget" in note]
