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

from sysid.traces import Trace
from sysid.workbench.assembly.config import AssemblyConfig
from sysid.workbench.assembly.members import limits_of

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

    def __str__(self) -> str:
        return (
            f"{self.limit} by at most {self.most:.2g} {self.unit} in a sample and {self.summed:.2g} {self.unit} summed "
            f"over a trace ({self.trace})"
        )


def limits_passed(config: AssemblyConfig, traces: Sequence[Trace]) -> list[Passed]:
    """Measured traces beside the limits that are channels.

    Args:
        config: The pipeline.
        traces: Measured traces, with what the known members say; at least one.

    Returns:
        For each such limit by how much it is passed, rounding and the first sample apart (nothing is known before it).
    """
    found = []
    for output, limit in limits_of(config).items():
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


def limit_note(config: AssemblyConfig, traces: Sequence[Trace]) -> str | None:
    """The same as a sentence for the report.

    Args:
        config: The pipeline.
        traces: Measured traces, with what the known members say; at least one.

    Returns:
        It names the limits that are passed; ``None`` where no limit is a channel.
    """
    found = limits_passed(config, traces)
    if not found:
        return None
    passed = sorted((one for one in found if one.most > 0.0), key=lambda one: -one.summed)
    if not passed:
        return f"No training trace ({len(traces)}) passes a limit that is a channel ({len(found)})."
    listed = "; ".join(str(one) for one in passed)
    return f"Training traces ({len(traces)}) pass {len(passed)} of {len(found)} limits that are channels: {listed}."
