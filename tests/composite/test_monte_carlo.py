"""Monte Carlo test: what is lost is counted, the worst is named, and each state has its own errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sysid.composite.doubt.monte_carlo import run_monte_carlo
from sysid.composite.members import assembled
from sysid.traces import Channel, Trace
from tests.composite.composites import models, pipe, trace


def test_it_counts_what_is_lost_and_names_the_worst():
    whole = assembled(pipe(), models())
    sequences = [trace(seed=s) for s in range(12)]
    found = run_monte_carlo(whole, sequences, "AR", limit=1e6)
    errors = [np.sqrt(np.mean((whole.simulate_trace(t)["AR"] - t["AR"]) ** 2)) for t in sequences]
    assert found.sequences == 12
    assert found.within == 1.0
    assert found.quantiles[1.0] == pytest.approx(max(errors))
    assert found.worst[0][1] == pytest.approx(max(errors))
    assert len(found.worst) == 10


def test_each_kind_of_sequence_has_figures_of_its_own():
    whole = assembled(pipe(), models())
    kinds = {"ramps-": 3, "sine-": 2}
    sequences = [replace(trace(seed=s), name=f"{kind}{s:03}") for kind, n in kinds.items() for s in range(n)]
    errors = {t.name: np.sqrt(np.mean((whole.simulate_trace(t)["AR"] - t["AR"]) ** 2)) for t in sequences}
    limit = float(np.median(list(errors.values())))
    found = run_monte_carlo(whole, sequences, "AR", limit)
    assert {kind: one.sequences for kind, one in found.by_kind.items()} == {"ramps": 3, "sine": 2}
    for kind, one in found.by_kind.items():
        own = [error for name, error in errors.items() if name.startswith(kind)]
        assert one.within == np.mean(np.array(own) < limit)
        assert one.quantiles[1.0] == pytest.approx(max(own))
    assert run_monte_carlo(whole, sequences[:3], "AR", limit).by_kind == {}


class Halves:
    """An annotator: the first half of a trace is one state, the second another; a third never occurs."""

    channel, labels = "state", ("early", "never", "late")

    def __call__(self, trace: Trace) -> Trace:
        numbers = np.repeat([0.0, 2.0], len(trace) // 2)
        channels = (*trace.channels, Channel(name="state", unit="1"))
        return replace(trace, channels=channels, values=np.column_stack([trace.values, numbers]))


def test_it_says_what_the_errors_of_each_state_are():
    whole = assembled(pipe(), models())
    sequences = [trace(seed=s) for s in range(5)]
    found = run_monte_carlo(whole, sequences, "AR", 1.0, annotator=Halves())
    halves = [((whole.simulate_trace(t)["AR"] - t["AR"]) ** 2).reshape(2, -1).mean(axis=1) ** 0.5 for t in sequences]
    for label, errors in zip(("early", "late"), np.transpose(halves), strict=True):
        assert found.by_state[label][0.5] == pytest.approx(np.median(errors))
        assert found.by_state[label][1.0] == pytest.approx(errors.max())
    assert "never" not in found.by_state
