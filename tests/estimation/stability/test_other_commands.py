"""Commands that a system might be given next: pieces of the records' inputs, in other order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.errors import TraceError
from sysid.estimation.stability.other_commands import LONGEST, OtherCommands
from sysid.traces import Channel, Trace

CHANNELS = tuple(Channel(name=name, unit="V") for name in ("u", "mass", "y"))


def record(n: int, *, mass: float = 1.0, seed: int = 0, usable: np.ndarray | None = None) -> Trace:
    u = np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.0, n), 100)[:n]
    values = np.column_stack([u, np.full(n, mass), np.cumsum(u)])
    return Trace(name=f"mass {mass:g}", sample_time=1.0, channels=CHANNELS, values=values, usable=usable)


def commands(*traces: Trace) -> OtherCommands:
    return OtherCommands.of(traces, ["u", "mass"], ["y"])


@given(n=st.integers(20, 3000), seed=st.integers(0, 100))
def test_inputs_are_those_of_the_record_sample_by_sample(n: int, seed: int) -> None:
    trace = record(n)
    (drawn,) = commands(trace).draw(1, seed)
    assert len(drawn.inputs) == min(n, LONGEST)
    assert set(drawn.inputs[:, 0].tolist()) <= set(trace["u"].tolist())
    assert not drawn.judged.any()


def test_a_step_may_follow_sooner_than_any_of_the_record_did() -> None:
    held = [np.diff(np.flatnonzero(np.diff(one.inputs[:, 0]))).min() for one in commands(record(1000)).draw(20, 0)]
    assert min(held) < 50


def test_what_stands_still_within_a_record_stands_still_within_a_command() -> None:
    drawn = list(commands(record(300, mass=1.0), record(300, mass=2.0)).draw(20, 0))
    assert all(np.ptp(one.inputs[:, 1]) == 0.0 for one in drawn)
    assert {one.inputs[0, 1] for one in drawn} == {1.0, 2.0}


def test_the_same_seed_gives_the_same_commands_and_another_one_others() -> None:
    first, again, other = ([one.inputs for one in commands(record(500)).draw(3, seed)] for seed in (1, 1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not all(np.array_equal(a, b) for a, b in zip(first, other, strict=True))


def test_gaps_are_left_out() -> None:
    usable = np.ones(400, dtype=bool)
    usable[100:300] = False
    values = record(400).values.copy()
    values[100:300, 0] = 99.0
    trace = Trace(name="gap", sample_time=1.0, channels=CHANNELS, values=values, usable=usable)
    assert all(np.abs(one.inputs[:, 0]).max() <= 1.0 for one in commands(trace).draw(20, 0))


def test_traces_that_are_too_short_are_told() -> None:
    with pytest.raises(TraceError, match="long enough"):
        commands(record(10))
