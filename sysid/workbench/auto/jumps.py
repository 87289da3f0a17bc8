"""Outputs that jump while no input moves: a velocity that flips, a state that is reset, a counter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.models import Mapping
from sysid.traces import Trace

JUMP = 0.05
"""Share of an output's range that it moves within a sample beside its own trend."""
ABOVE = 10.0
"""Times the most that it moves so at nine tenths of all samples, which a jump is at least."""
QUIET = 3
"""Samples before and behind it in which no input moves: what an input's step does by itself is no jump."""
FEWEST = 0.2
"""Share of the records that have one at least."""
LATE, ALIKE, SEVERAL = 4, 0.9, 3
"""Part of the longest record to which a dead time may come, share of the jumps that follow an input's at one, and how
many are more than chance."""

UNDERSTOOD = (
    "Between its jumps the reference is linear, and a level tells when one comes: equations of that were found in the "
    "experiments and are tried first (docs/how/events.md)"
)
"""What is said of jumps where equations of them were found."""


def jumps_of(traces: Sequence[Trace], mapping: Mapping) -> dict[str, NDArray[np.float64]]:
    """Of each output that jumps the sizes of its jumps, as shares of its range.

    A jump is a step from sample to sample that neither the one before nor the one behind continues, while the inputs
    stand.

    Args:
        traces: The records.
        mapping: What moves, and what answers.

    Returns:
        By name; without those of which fewer than :data:`FEWEST` of the records have one.

    Example:
        >>> from sysid.traces import Channel, Trace
        >>> fall = np.concatenate([np.arange(0.0, -40.0, -1.0), np.arange(30.0, -20.0, -1.0)])
        >>> channels = (Channel(name="u", unit="1"), Channel(name="v", unit="m/s"))
        >>> trace = Trace(name="r", sample_time=0.1, channels=channels, values=np.column_stack([0.0 * fall, fall]))
        >>> {name: sizes.round(2).tolist() for name, sizes in jumps_of([trace], Mapping.parse("u -> v")).items()}
        {'v': [1.01]}
    """
    found = {}
    still = [_still(trace.columns(mapping.inputs)) for trace in traces]
    for name in mapping.outputs:
        span = max(trace[name].max() for trace in traces) - min(trace[name].min() for trace in traces)
        if not span > 0.0:
            continue
        beside = [_beside(trace[name]) / span for trace in traces]
        usual = float(np.quantile(np.concatenate(beside), 0.9))
        jumps = [np.flatnonzero(s & (b > JUMP) & (b > ABOVE * usual)) for b, s in zip(beside, still, strict=True)]
        if np.mean([len(one) > 0 for one in jumps]) >= FEWEST and not _late(traces, mapping, jumps):
            found[name] = np.concatenate([b[at] for b, at in zip(beside, jumps, strict=True)])
    return found


def _late(traces: Sequence[Trace], mapping: Mapping, jumps: Sequence[NDArray[np.intp]]) -> bool:
    """Whether nearly all jumps are those of an input, some samples later: a dead time."""
    for name in mapping.inputs:
        span = max(trace[name].max() for trace in traces) - min(trace[name].min() for trace in traces)
        steps = [_beside(trace[name]) > JUMP * span for trace in traces]
        for late in range(QUIET, 1 + max(map(len, traces)) // LATE):
            # Of the first samples nobody knows what moved before.
            follow = np.concatenate([step[at[at >= late] - late] for step, at in zip(steps, jumps, strict=True)])
            if follow.sum() >= SEVERAL and follow.mean() >= ALIKE:
                return True
    return False


def jumps_told(traces: Sequence[Trace], mapping: Mapping, *, understood: bool = False) -> list[str]:
    """What of some records no smooth model does, in words, and what one can do about it.

    Args:
        traces: The records.
        mapping: What moves, and what answers.
        understood: Whether equations of the events were found in the records.

    Returns:
        A sentence for each output that jumps.
    """
    told = []
    longest = max((len(trace) for trace in traces), default=1)
    for name, sizes in jumps_of(traces, mapping).items():
        usual = float(np.median(sizes))
        late = 100.0 * usual / np.sqrt(longest)
        jumps = (
            f"{name} jumps within a sample while no input moves, by {100.0 * usual:.2g} % of its range ({len(sizes)} "
            "times), as a velocity that flips or a state that is reset. "
        )
        if understood:
            told.append(f"{jumps}{UNDERSTOOD}")
            continue
        told.append(
            f"{jumps}What is searched is smooth from sample to "
            f"sample; one jump a sample early or late is an error of {late:.2g} % over a run (root mean square). Where "
            "you know what happens then, write it as equations (fits: in the pipeline of experiments; "
            "docs/how/events.md)"
        )
    return told


def _beside(output: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each sample's step is from the nearer of its neighbours' steps."""
    step = np.diff(output)
    if len(step) < 3:
        return np.zeros(len(output))
    away = np.minimum(np.abs(step[1:-1] - step[:-2]), np.abs(step[1:-1] - step[2:]))
    return np.concatenate([[0.0, 0.0], away, [0.0]])


def _still(inputs: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Samples around which no input moves."""
    moves = np.concatenate([[False], np.any(np.diff(inputs, axis=0) != 0.0, axis=1)])
    near = np.convolve(moves, np.ones(2 * QUIET + 1), mode="same") > 0.0 if len(moves) > 2 * QUIET else moves
    return ~near
