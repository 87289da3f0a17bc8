"""What stands for a missing value, and what the pattern of a channel's missing values says of them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

_HELD_SHARE = 0.5
_FEWEST_KNOWN = 4
_FAR = 5.0  # times the range of all other values
_MARKS = (-9999.0, -999.0, -999.25, -99999.0, -32768.0, -1e30, 9999.0, 99999.0, 32767.0, 1e30, 9.9e37)
"""Numbers that loggers write for want of one."""


def blanks_mean(values: NDArray[np.float64]) -> Literal["hold", "mask"]:
    """Whether the missing values of a channel are as before, or unknown.

    Event loggers, PLC and CAN exports write a value when it changes, or when its turn comes: most cells are blank, and
    those that are not stand alone. A sensor that drops out leaves runs of blanks among many values.

    Args:
        values: Shape ``(n,)``, NaN where there is none.

    Returns:
        ``hold`` if blanks mean as before, ``mask`` if nothing is known of them.

    Example:
        >>> nan = float("nan")
        >>> blanks_mean(np.array([1.0, nan, nan, nan, 3.0, nan, nan, 1.0])), blanks_mean(np.array([1.0, 2.0, nan, 4.0]))
        ('hold', 'mask')
    """
    known = np.isfinite(values)
    count = int(known.sum())
    if count < 2:
        return "mask"
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(np.int8)))
    stretch = float(np.mean(edges[1::2] - edges[::2]))
    sparse = count <= _HELD_SHARE * len(values) and stretch <= 2.0 and len(edges) > 2
    levels = values[known]
    # Levels that come again, and never twice in a row: what is written is each change.
    changes = count >= _FEWEST_KNOWN and bool((np.diff(levels) != 0.0).all()) and len(np.unique(levels)) <= count // 2
    return "hold" if sparse or (changes and len(edges) > 2) else "mask"


def marks_in(values: NDArray[np.float64]) -> list[float]:
    """Numbers that seem to stand for missing values: -9999, 32767 and their like, far outside everything else.

    Args:
        values: A column as the file has it, before units, shape ``(n,)``.

    Returns:
        The numbers; none where they may be values.

    Example:
        >>> marks_in(np.array([1.0, 2.0, -9999.0, 1.5])), marks_in(np.array([-9000.0, 2.0, -9999.0, 1.5]))
        ([-9999.0], [])
    """
    known = np.isfinite(values)
    finite = values if known.all() else values[known]
    if not len(finite):
        return []
    ends = (float(finite.min()), float(finite.max()))
    found = [mark for mark in _MARKS if mark in ends]
    others = finite[~np.isin(finite, found)] if found else finite
    if not found or 2 * len(others) < len(finite) or np.ptp(others) == 0.0:
        return []
    low, high, reach = float(others.min()), float(others.max()), _FAR * float(np.ptp(others))
    return [mark for mark in found if mark < low - reach or mark > high + reach]
