"""Outputs that jump by themselves are told before a search; what steps, stops or oscillates is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid.models import Mapping
from sysid.traces import Channel, Trace
from sysid.workbench.auto.jumps import jumps_of, jumps_told
from tests.traces.made import trace_of

MAPPING = Mapping.parse("u -> y")
N = 400


def told(u: NDArray[np.float64], y: NDArray[np.float64]) -> list[str]:
    trace = trace_of({"u": u, "y": y}, name="r", sample_time=0.01, units={"u": "V", "y": "m/s"})
    assert bool(jumps_of([trace], MAPPING)) is bool(jumps_told([trace], MAPPING))
    return jumps_told([trace], MAPPING)


def velocity(restitution: float) -> NDArray[np.float64]:
    """Of a ball that is let go."""
    height, speed, found = 1.0, 0.0, []
    for _ in range(N):
        height, speed = height + 0.01 * speed, speed - 0.0981
        if height <= 0.0 and speed < 0.0:
            height, speed = 0.0, -restitution * speed
        found.append(speed)
    return np.array(found)


def test_a_velocity_that_flips_is_told_with_what_a_sample_costs() -> None:
    (said,) = told(np.full(N, 0.8), velocity(0.8))
    assert "y jumps within a sample while no input moves" in said
    assert "one jump a sample early or late is an error of" in said
    assert "fits: in the pipeline" in said


def test_jumps_whose_equations_were_found_ask_for_none() -> None:
    channels = (Channel(name="u", unit="V"), Channel(name="y", unit="m/s"))
    values = np.column_stack([np.full(N, 0.8), velocity(0.8)])
    trace = Trace(name="r", sample_time=0.01, channels=channels, values=values)
    (said,) = jumps_told([trace], MAPPING, understood=True)
    assert "equations of that were found" in said
    assert "fits:" not in said


def test_what_inputs_and_ends_and_time_constants_do_is_no_jump() -> None:
    rng = np.random.default_rng(0)
    steps, still = np.repeat(rng.uniform(-1.0, 1.0, N // 20), 20), np.zeros(N)
    assert told(steps, 3.0 * steps) == []
    assert told(steps, np.clip(np.cumsum(0.02 * steps), -0.1, 0.1)) == []
    assert told(still, np.exp(-np.arange(N) / 5.0)) == []
    assert told(still, np.sin(np.arange(N) / 3.0)) == []
    assert told(still, np.full(N, 2.0)) == []
    assert told(still, rng.standard_normal(N)) == []


def test_an_input_that_jumps_a_dead_time_before_is_what_jumps() -> None:
    steps = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, N // 20), 20)
    assert told(steps, np.concatenate([np.zeros(8), np.tanh(steps[:-8])])) == []
    ball = velocity(0.8)
    assert told(np.where(np.arange(N) < 7, 0.0, 0.8), ball) == told(np.full(N, 0.8), ball)
    assert told(steps, ball)
