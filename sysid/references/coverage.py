"""Choosing among random experiments those that see most: by where their inputs are and have been, before any is run."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import scipy
from numpy.typing import NDArray

BINS = 8
"""Of each range: of an input as it is, as it was lately and for long; of two inputs together as they were lately."""


def cells(
    inputs: NDArray[np.float64], ranges: NDArray[np.float64], lags: tuple[float, float]
) -> list[NDArray[np.int64]]:
    """Where the samples of an experiment lie: each input with its own past, and every two with each other.

    Args:
        inputs: Shape ``(n_samples, n_inputs)``.
        ranges: Of the inputs, shape ``(n_inputs, 2)``.
        lags: A short and a long time, in samples, over which the past is smoothed.

    Returns:
        For each input and each pair of them the number of its cell, sample by sample.
    """
    level = (inputs - ranges[:, 0]) / (ranges[:, 1] - ranges[:, 0])
    short, long = (_smoothed(level, lag) for lag in lags)
    at = [np.clip((BINS * one).astype(np.int64), 0, BINS - 1) for one in (level, short, long)]
    own = [(at[0][:, k] * BINS + at[1][:, k]) * BINS + at[2][:, k] for k in range(inputs.shape[1])]
    return own + [at[1][:, i] * BINS + at[1][:, j] for i, j in combinations(range(inputs.shape[1]), 2)]


def _smoothed(level: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    """Behind a lag of first order that begins where the signal does."""
    a = float(np.exp(-1.0 / lag))
    filtered, _ = scipy.signal.lfilter([1.0 - a], [1.0, -a], level, axis=0, zi=a * level[:1])
    return np.asarray(filtered, dtype=np.float64)


def most_seen(groups: Sequence[Sequence[Sequence[NDArray[np.int64]]]]) -> list[int]:
    """One of each group, one after the other: that which adds most to what those before it have seen.

    What is seen counts as the sum over cells of the root of the samples in them: the first sample in a cell is worth
    more than another thousand where there were many, and adding one by one comes within ``1 - 1/e`` of the best set
    (Nemhauser, Wolsey and Fisher 1978).

    Args:
        groups: Of each group the cells of its experiments, as :func:`cells` gives them.

    Returns:
        The place in each group; the first of equal ones.

    Example:
        >>> here, there = [np.array([3, 3])], [np.array([5, 6])]
        >>> most_seen([[here, there], [there, here]])
        [1, 1]
    """
    seen: list[NDArray[np.float64]] = [np.zeros(BINS**3) for _ in groups[0][0]] if groups else []
    chosen = []
    for group in groups:
        counts = [[np.bincount(one, minlength=BINS**3) for one in experiment] for experiment in group]
        gains = [
            sum(float(np.sum(np.sqrt(had + new) - np.sqrt(had))) for had, new in zip(seen, some, strict=True))
            for some in counts
        ]
        best = int(np.argmax(gains))
        seen = [had + new for had, new in zip(seen, counts[best], strict=True)]
        chosen.append(best)
    return chosen
