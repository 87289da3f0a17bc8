"""What traces say of themselves by name."""

from __future__ import annotations

import numpy as np

from sysid.traces import Channel, Trace, TraceSet

TRACE = Trace(name="EST01", sample_time=0.1, channels=(Channel(name="BP", unit="psi"),), values=np.zeros((5, 1)))


def test_a_trace_says_which_channels_it_has():
    assert "BP" in TRACE
    assert "XX" not in TRACE


def test_a_set_says_which_cases_it_has():
    traces = TraceSet(name="abdx", traces=(TRACE,))
    assert "EST01" in traces
    assert "VAL01" not in traces
