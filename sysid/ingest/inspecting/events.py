"""Two samples at one instant: what a simulation writes before and after an event."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid.ingest.tables.columns import RawColumn

_SHARE = 0.9
_CLEAR = 2.0


def are_events(stamps: NDArray[np.float64], columns: Sequence[RawColumn]) -> bool:
    """Whether samples that share a stamp are the values before and after an event.

    Where they differ, the first goes on from the sample before, and the next sample from the last: the jump lies
    between the two. Values that a logger wrote twice differ by noise, or not at all.

    Args:
        stamps: Shape ``(n,)``, seconds.
        columns: The columns beside them, each of shape ``(n,)``.

    Returns:
        Whether the last of them is what holds from that instant on.
    """
    again = np.concatenate([[False], stamps[1:] == stamps[:-1]])
    first = np.flatnonzero(~again[:-1] & again[1:])
    last = np.flatnonzero(again & ~np.append(again[1:], False))
    inner = (first > 0) & (last < len(stamps) - 1)
    first, last = first[inner], last[inner]
    clear = jumps = 0
    for column in columns:
        values = column.values
        if column.problem is not None or len(values) != len(stamps):
            continue
        jump = np.abs(values[last] - values[first])
        beside = np.abs(values[first] - values[first - 1]) + np.abs(values[last + 1] - values[last])
        jumps += int((jump > 0.0).sum())
        clear += int((jump > _CLEAR * beside).sum())
    return jumps > 0 and clear >= _SHARE * jumps
