"""The clock that limits of time are held against: that on the wall, or the processor time of who trains.

A limit by the wall means half as much training on a machine that is half as free. Where many fits are compared, each is
to come equally far whatever else the machine does: their limits count the time in which this process had a processor,
and only how many fits there are depends on the wall.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SLOWEST = 4.0
"""Seconds by the wall that a second of processor time may take: beyond that, the wall counts after all."""


class _Clock:
    """Which clock counts in this process."""

    def __init__(self) -> None:
        self.read: Callable[[], float] = time.perf_counter


_CLOCK = _Clock()


def now() -> float:
    """The time by the clock that counts.

    Returns:
        Seconds; differences alone mean something.
    """
    return _CLOCK.read()


@contextmanager
def processor_time(
    wall: Callable[[], float] = time.perf_counter, processor: Callable[[], float] = time.process_time
) -> Iterator[None]:
    """Let limits of time in this process count processor time, or a :data:`SLOWEST`-th of the wall's if that is more.

    It never goes faster than the wall, however many threads work.

    Args:
        wall: Seconds by the wall.
        processor: Seconds of processor time.

    Yields:
        While that is so.
    """
    before, at, spent = _CLOCK.read, wall(), processor()

    def read() -> float:
        gone = wall() - at
        return at + min(gone, max(processor() - spent, gone / SLOWEST))

    _CLOCK.read = read
    try:
        yield
    finally:
        _CLOCK.read = before
