"""Limits of time count the wall, or the processor time of who trains."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

from sysid.estimation import Training, clock, fit_neural_state_space
from sysid.estimation.clock import SLOWEST, now, processor_time
from sysid.models import Mapping, NeuralStateSpace, Start, StartKind
from tests.estimation.networks.test_neural_state_space import steps
from tests.traces.made import trace_of


def test_the_wall_counts_unless_something_else_is_said() -> None:
    before = time.perf_counter()
    assert before <= now() <= time.perf_counter()


def test_processor_time_counts_while_it_is_asked_for() -> None:
    wall, worked = [100.0], [7.0]
    with processor_time(wall=lambda: wall[0], processor=lambda: worked[0]):
        assert now() == 100.0
        wall[0], worked[0] = 103.0, 8.5
        assert now() == 101.5
        # Who waits for something, or has hardly a processor, does not train for ever.
        wall[0] = 180.0
        assert now() == 100.0 + 80.0 / SLOWEST
        # Two threads have a processor each: it is no later than on the wall.
        worked[0] = 500.0
        assert now() == 180.0
    assert abs(now() - time.perf_counter()) < 1.0


def test_a_clock_is_given_back_where_a_fit_fails() -> None:
    def failing() -> None:
        with processor_time():
            raise ArithmeticError

    with pytest.raises(ArithmeticError):
        failing()
    assert abs(now() - time.perf_counter()) < 1.0


@pytest.mark.parametrize(("seconds", "begun"), [(100.0, 1), (3000.0, 4), (float("inf"), 4)])
def test_where_iterations_are_slow_there_are_fewer_starts(
    monkeypatch: pytest.MonkeyPatch, seconds: float, begun: int
) -> None:
    """Every look at this clock takes a second: an iteration takes some."""
    ticks = itertools.count()
    monkeypatch.setattr(clock._CLOCK, "read", lambda: float(next(ticks)))
    u = steps(80, np.random.default_rng(0))
    y = np.tanh(np.convolve(u, 0.5 ** np.arange(10))[:80])
    trace = trace_of({"u": u, "y": y}, name="t")
    fit = fit_neural_state_space(
        [trace], Mapping.parse("u -> y"), NeuralStateSpace(states=1, neurons=2),
        Training(starts=4, max_iterations=100, max_time_s=seconds, workers=1, tolerance=0.0),
        start=Start(kind=StartKind.REST), rest_output=0.0,
    )  # fmt: skip
    assert len({one.start for one in fit.attempts}) == begun
    assert any(f"Of 4 starts {begun} had a place" in note for note in fit.notes) is (begun < 4)
    assert f"among {begun} starts" in " ".join(fit.notes)
    # The time of those that were left out is that of the one that was not.
    assert max(one.iterations for one in fit.attempts) > 20
