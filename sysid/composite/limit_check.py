"""What is declared of what is held, beside the measured traces: a limit that they pass is no limit of the system.

A limit that is a channel comes from switches whose settings were read off a drawing. Where one is a little off, the
switch stays as it was in a few sequences, and its limit holds what in truth moves: no fit says so, and a score only in
the end. On measured traces it shows at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.composite.composite import Composite
from sysid.composite.members import limits_of
from sysid.traces import Trace

ROUNDING = 1e-9
"""Share of the largest value of a channel below which it is as large as its limit."""


@dataclass(frozen=True, kw_only=True)
class Passed:
    """By how much measured traces pass a limit.

    Args:
        output: What is held.
        limit: The channel that holds it.
        most: The largest excess of a sample, in the output's unit.
        summed: The largest sum of a trace's excesses, likewise: how far the output would be held back in the end.
        trace: Name of that trace.
        unit: Of the output.
    """

    output: str
    limit: str
    most: float
    summed: float
    trace: str
    unit: str


@dataclass(frozen=True, kw_only=True)
class LimitCheck:
    """Every limit that is a channel, beside measured traces.

    Args:
        limits: By how much each is passed.
        traces: How many traces were looked at.
    """

    limits: tuple[Passed, ...]
    traces: int


def check_limits(composite: Composite, traces: Sequence[Trace]) -> LimitCheck:
    """Hold measured traces against what is declared of their limits.

    Args:
        composite: What is declared.
        traces: Measured traces, with what the fixed submodels say; at least one.

    Returns:
        What came of it.
    """
    return LimitCheck(limits=tuple(_limits_passed(composite, traces)), traces=len(traces))


def _limits_passed(composite: Composite, traces: Sequence[Trace]) -> list[Passed]:
    """How far each limit that is a channel is passed; not in the first sample, before which nothing is known."""
    found = []
    for output, limit in limits_of(composite).items():
        for sign, channel in ((-1.0, limit.low), (1.0, limit.high)):
            if not isinstance(channel, str) or not all({output, channel} <= set(t.channel_names) for t in traces):
                continue
            excess = [_excess(trace, sign * (trace[output] - trace[channel]), output) for trace in traces]
            sums = [float(one.sum()) for one in excess]
            worst = int(np.argmax(sums))
            found.append(
                Passed(
                    output=output,
                    limit=channel,
                    most=max((float(one.max()) for one in excess if len(one)), default=0.0),
                    summed=sums[worst],
                    trace=traces[worst].name,
                    unit=traces[worst].channel(output).unit,
                )
            )
    return found


def _excess(trace: Trace, over: NDArray[np.float64], output: str) -> NDArray[np.float64]:
    """How far a trace is over a limit, sample by sample."""
    rounding = ROUNDING * float(np.max(np.abs(trace[output]), initial=0.0))
    return np.where(over > rounding, over, 0.0)[1:][trace.usable_samples[1:]]
