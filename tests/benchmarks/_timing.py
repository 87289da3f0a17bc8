"""How run times are taken and said, and the compiled reference that they stand beside."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.machine import Probe
from sysid.airbrake.simulate import simulate
from sysid.reporting.numbers import number
from tests.benchmarks._findings import found


@dataclass(frozen=True)
class Taken:
    """Seconds of one run that simulates ``duration`` seconds, on so many cores."""

    wall: float
    processor: float
    duration: float
    cores: int = 1

    @property
    def seconds(self) -> float:
        """What counts: on one core processor time, which other work hardly changes; on several what a clock shows."""
        return self.processor if self.cores == 1 else self.wall

    @property
    def pace(self) -> str:
        """Per simulated second."""
        per = 1e6 * self.seconds / self.duration
        return f"{number(per)} µs per simulated s, {number(self.duration / self.seconds)} times real time"

    @property
    def other(self) -> str:
        """The other of the two times."""
        if self.cores == 1:
            return f"by the clock {number(1e3 * self.wall)} ms"
        return f"processor time of all threads {number(1e3 * self.processor)} ms"


def taken(work: Callable[[], object], repeats: int, duration: float, cores: int = 1) -> Taken:
    """Medians over repeats, after one run that warms up."""
    work()
    walls, processors = [], []
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        work()
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return Taken(statistics.median(walls), statistics.median(processors), duration, cores)


def say(what: str, one: Taken, *, target: float | None = None, published: str = "", more: str = "") -> None:
    """A run time as a finding: milliseconds, on several cores seconds."""
    unit, factor = ("ms", 1e3) if one.cores == 1 else ("s", 1.0)
    note = "; ".join(filter(None, (one.pace, one.other, more)))
    found(what, factor * one.seconds, unit, target=target, published=published, note=note)


def say_faster(what: str, slow: Taken, fast: Taken, target: float | None = None) -> None:
    """By how much one is faster than another, as a finding."""
    # What is slow runs on one core: by its processor time, so that load never makes two threads look better.
    other = f"by the clock {number(slow.wall / fast.wall)} x"
    if fast.cores > 1:
        # A projection: that of a machine which is otherwise idle.
        other = f"by processor time over {fast.cores} cores {number(fast.cores * slow.processor / fast.processor)} x"
    found(what, slow.seconds / fast.seconds, "x", target=target, at_least=True, note=other)


def reference(command: Command, pairs: int) -> Callable[[], object]:
    """The compiled physics on a train of so many wagon pairs, recording every cylinder."""
    consist = Consist(pairs=pairs)
    probes = tuple(Probe(quantity="cylinder", node=node) for node in consist.valve_nodes)
    return lambda: simulate(command, consist=consist, probes=probes)


def handle(command: Command) -> np.ndarray:
    """The handle at each sample, shape ``(n_samples, 1)``."""
    return command.sampled(sample_time=0.1)[:, np.newaxis]
