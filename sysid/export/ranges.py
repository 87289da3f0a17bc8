"""What records say of channels beside a model: the ranges that they have there, and where they begin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid.export.forms.stage import Range
from sysid.traces import Role, Trace, TraceSet

DIGITS = 4.0
"""Last digits by which a number that was converted from another unit may be off."""


def declared_ranges(inputs: Sequence[str], traces: TraceSet) -> dict[str, Range]:
    """The range that each input has in the estimation traces, which is what a bundle is declared for.

    Args:
        inputs: Names of the inputs.
        traces: The cases.

    Returns:
        By channel; empty without estimation traces.
    """
    return ranges_in(inputs, traces.with_role(Role.ESTIMATION))


def ranges_in(inputs: Sequence[str], traces: Sequence[Trace]) -> dict[str, Range]:
    """The range that each input has in some traces.

    Args:
        inputs: Names of the inputs.
        traces: The traces.

    Returns:
        By channel, of those that they have.
    """
    return {name: found for name in inputs if (found := range_of(name, traces))}


def first_inputs(inputs: Sequence[str], traces: TraceSet) -> dict[str, float]:
    """What each input is at the beginning of the first estimation trace, or of the first trace without one.

    Args:
        inputs: Names of the inputs.
        traces: The cases.

    Returns:
        By channel.
    """
    example = example_of(traces)
    return {name: float(example[name][0]) for name in inputs}


def example_of(traces: TraceSet) -> Trace:
    """The first estimation trace, or the first trace where there is none."""
    estimation = traces.with_role(Role.ESTIMATION)
    return estimation[0] if estimation else traces.traces[0]


def range_of(name: str, estimation: Sequence[Trace]) -> Range | None:
    """Least and greatest of a channel in the traces that have it; ``None`` where none has."""
    there = [trace[name] for trace in estimation if name in trace.channel_names]
    return (min(float(v.min()) for v in there), max(float(v.max()) for v in there)) if there else None


def taking_rounding(ranges: Mapping[str, Range]) -> dict[str, Range]:
    """Ranges that their own ends are in where these come from another unit: 700 mV are 0.7000000000000001 V.

    Args:
        ranges: By channel.

    Returns:
        The ranges, wider by some last digits.

    Example:
        >>> low, high = taking_rounding({"u": (0.0, 0.7)})["u"]
        >>> high >= 0.001 * 700.0 > 0.7
        True
    """
    return {
        name: (low - DIGITS * float(np.spacing(abs(low))), high + DIGITS * float(np.spacing(abs(high))))
        for name, (low, high) in ranges.items()
    }
