"""What trace sets say of the traces in them."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.traces import Channel, Role, Trace, TraceSet

TRACE = Trace(name="EST01", sample_time=0.1, channels=(Channel(name="BP", unit="psi"),), values=np.zeros((5, 1)))


def test_a_set_says_which_cases_it_has():
    traces = TraceSet(name="abdx", traces=(TRACE,))
    assert "EST01" in traces
    assert "VAL01" not in traces


@pytest.mark.parametrize(("start", "shares"), [(0, True), (30, True), (50, False)])
def test_a_case_that_has_samples_of_a_fitted_one_is_known(start: int, shares: bool) -> None:
    values = np.random.default_rng(0).standard_normal((80, 1))

    def cut(name: str, a: int, b: int) -> Trace:
        return Trace(
            name=name, sample_time=0.1, channels=TRACE.channels, values=values[a:b].copy(), start_time=round(0.1 * a, 9)
        )

    other = Trace(name="other", sample_time=0.1, channels=TRACE.channels, values=-values)
    roles = {"fitted": Role.ESTIMATION, "again": Role.SELECTION, "other": Role.TEST}
    traces = TraceSet(name="rig", traces=(cut("fitted", 0, 50), cut("again", start, 80), other), roles=roles)
    assert traces.shared == ((("again", "fitted"),) if shares else ())
