"""How many coefficients of its effect a signal can tell: its order of persistent excitation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from sysid.estimation.nonparametric.evidence import triangle
from sysid.estimation.nonparametric.segments import columns_of_lags

BLOCK = 2**15
"""Samples whose lags are laid side by side at a time."""
MOST, NEEDED = 40, 4
"""Orders that are looked for, and below which nothing can be fitted."""
SEEN = 1e-4
"""Part of its largest direction that the smallest must have, in root mean square, to count as excited."""


def largest_order(parts: Sequence[NDArray[np.float64]]) -> int:
    """The largest order that can be looked for: a stretch has to show its lags more than once.

    Args:
        parts: Stretches of a signal.

    Returns:
        At least 1, at most :data:`MOST`.
    """
    return max(1, min(MOST, sum(map(len, parts)) // 4, max(map(len, parts)) // 2))


def excitation_order(
    parts: Sequence[NDArray[np.float64]], most: int = MOST, *, seen: float = SEEN
) -> tuple[int, float]:
    """How many past values of a signal can be told apart: its order of persistent excitation.

    Args:
        parts: Its stretches; each is counted from the mean of all.
        most: The largest order that is looked for.
        seen: Part of its largest direction that the smallest must have, in root mean square, to count as excited.

    Returns:
        The order, and the condition number of the lags at the order :data:`NEEDED` or the largest there is.
    """
    n = min(most, largest_order(parts))
    mean = np.concatenate(parts).mean()
    rows = (
        (part, slice(first, min(first + BLOCK, len(part))))
        for part in parts
        for first in range(n - 1, len(part), BLOCK)
    )
    blocks = (columns_of_lags(part, range(n), at) - mean for part, at in rows)
    R = triangle((np.column_stack([b, b[:, 0]]) for b in blocks), free=0).R[:n, :n]
    best, condition = 0, np.inf
    for order in range(1, n + 1):
        size = linalg.svdvals(R[:order, :order]) if len(R) >= order else np.zeros(1)
        ratio = float(size[0] / size[-1]) if size[-1] > 0.0 else np.inf
        if ratio > 1.0 / seen:
            break
        best = order
        if order <= NEEDED:
            condition = ratio
    return best, condition
