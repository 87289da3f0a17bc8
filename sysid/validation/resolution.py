"""What records can tell apart: whether one free run is better than another by more than chance.

The squared errors of two runs over the same records are compared part by part. A part is many samples long, so that
errors which hang together from sample to sample are not counted as news. The difference of the means is known as well
as these differences scatter (batch means: Law, Simulation Modeling and Analysis, 2015, section 9.5.3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

PARTS, SHORTEST = 12, 8
"""Parts of a record, fewer where one would have fewer samples than this."""
FEWEST = 4
"""Parts in all without which no difference is told from chance."""
ROUNDING = 1e-14
"""Squared error over variance below which an error is rounding: no record has seven digits."""


def parts_of(error: NDArray[np.float64]) -> tuple[float, ...]:
    """Means of squared errors over parts of a record, in time order.

    Args:
        error: Errors of the samples that count, shape ``(n_samples,)``.

    Returns:
        One mean a part; none where nothing counts.
    """
    count = min(PARTS, max(len(error) // SHORTEST, 1))
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that has left
        return tuple(float(np.mean(part**2)) for part in np.array_split(error, count) if len(part))


def tied(ours: Sequence[float], theirs: Sequence[float]) -> bool:
    """Whether two free runs cannot be told apart: their errors differ by no more than one standard error.

    Args:
        ours: Mean squared errors by part, of one.
        theirs: Of the other, over the same parts.

    Returns:
        Whether they cannot; never where there are too few parts, or a run is not finite.
    """
    one, other = np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64)
    if len(one) != len(other) or len(one) < FEWEST or not (np.isfinite(one) & np.isfinite(other)).all():
        return False
    by = other - one
    return bool(abs(by.mean()) <= by.std(ddof=1) / math.sqrt(len(by)))


def exact(parts: Sequence[float]) -> bool:
    """Whether an error is nothing but rounding.

    Args:
        parts: Squared errors over the target's variance, by part.

    Returns:
        Whether it is.
    """
    return bool(len(parts)) and float(np.mean(parts)) <= ROUNDING
