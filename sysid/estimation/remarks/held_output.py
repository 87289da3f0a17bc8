"""Outputs that are measured more slowly than they are recorded: each value stands until the next one comes.

A fit takes the hold for the plant's: its time constants and dead times come out too long, in narrow intervals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.nonparametric.segments import Segment

LOOKED_AT = 20_000
"""Samples of a stretch that are looked at: more would not make the finding any surer."""
LEAST_CHANGES, FEW_LEVELS = 20, 20
"""Changes that it takes to say so; values up to which an output is a switch, or a command's own levels."""
EARLY, STEADY = 0.02, 0.5
"""Share of the changes that may come sooner than after this part of the usual time: noise and motion do not wait."""
COARSE = 2.0
"""Steps of its converter that a usual change must have: a slow signal stands between two of them."""
ALIKE = 1.2
"""How many more changes the output has than the inputs, at most, where it may be these that let it change."""

ROUNDING = 1e-9
"""Of a channel's size, up to which a bend is none."""


def held_for(segments: Sequence[Segment]) -> int:
    """For how many samples an output stands between its changes.

    Args:
        segments: Stretches of samples that count.

    Returns:
        The usual number; 1 for an output that may change at any sample, or where that cannot be told.
    """
    gaps, sizes, values, moves = [np.empty(0, dtype=np.int64)], [np.empty(0)], [np.empty(0)], 0
    for segment in segments:
        y, u = segment.output[:LOOKED_AT], segment.inputs[:LOOKED_AT]
        steps = np.diff(y)
        at = np.flatnonzero(steps)
        gaps.append(np.diff(at))
        sizes.append(np.abs(steps[at]))
        values.append(y)
        moves += int(np.count_nonzero(np.diff(u, axis=0).any(axis=1)))
    between, levels = np.concatenate(gaps), np.unique(np.concatenate(values))
    if len(between) < LEAST_CHANGES or len(levels) <= FEW_LEVELS:
        return 1
    usual = float(np.median(between))
    if usual < 2.0 or np.mean(between < max(2.0, STEADY * usual)) > EARLY:
        return 1
    of_inputs = moves / ALIKE <= len(between) <= moves * ALIKE
    if of_inputs or np.median(np.concatenate(sizes)) < COARSE * np.diff(levels).min():
        return 1
    return round(usual)


def straight_for(segments: Sequence[Segment]) -> int:
    """How many samples long the straight lines are that a whole record goes in, as an interpolated one does.

    Args:
        segments: Stretches of samples that count.

    Returns:
        The usual number, the same for the output and every input that moves; 1 where one of them does otherwise: a
        plant alone makes lines of its own, and an input that is held is no interpolated one.
    """
    m = segments[0].inputs.shape[1] if segments else 0
    columns = [
        [s.output[:LOOKED_AT] for s in segments],
        *([s.inputs[:LOOKED_AT, j] for s in segments] for j in range(m)),
    ]
    moving = [parts for parts in columns if any(np.ptp(part) > 0.0 for part in parts if len(part))]
    found = {_line_of(parts) for parts in moving} if m and len(moving) > 1 else {1}
    return found.pop() if len(found) == 1 else 1


def _line_of(parts: Sequence[NDArray[np.float64]]) -> int:
    """How many samples lie between the bends of a channel; 1 where it may bend anywhere, or stands still between."""
    between, still = [np.empty(0, dtype=np.int64)], 0.0
    for part in parts:
        if len(part) < LEAST_CHANGES:
            continue
        bends = np.abs(np.diff(part, n=2))
        between.append(np.diff(np.flatnonzero(bends > ROUNDING * float(np.abs(part).max()))))
        still = max(still, float(np.mean(np.diff(part) == 0.0)))
    gaps = np.concatenate(between)
    if len(gaps) < LEAST_CHANGES or still > STEADY:
        return 1
    usual = float(np.median(gaps))
    return round(usual) if usual > 2.0 and np.mean(np.abs(np.rint(gaps / usual) * usual - gaps) > 0.5) <= EARLY else 1
