"""The linear map that most of some samples follow, where others follow none or another."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DRAWS, LOOKED = 400, 4000
"""Times that samples are drawn at random to find what most of them follow, and samples on which that is seen."""
MOST: Final = 0.95
"""Share of the samples that follow a map at which no other is drawn."""


def majority_map(
    terms: Array, values: Array, span: Array, near: float, *, rng: np.random.Generator, among: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.intp]] | None:
    """Of maps through a few samples that which passes nearest to most, as in RANSAC (Fischler and Bolles 1981).

    Args:
        terms: Shape ``(n_samples, n_terms)``.
        values: Shape ``(n_samples, n_values)``.
        span: Range of each value.
        near: Share of it that a sample may be off which follows.
        rng: Of the draws.
        among: Samples that count, shape ``(n_samples,)``.

    Returns:
        The map, shape ``(n_terms, n_values)``, and the samples that follow it; ``None`` where hardly any do.

    Example:
        >>> x = np.arange(60.0)[:, np.newaxis] / 60.0
        >>> y = np.where(x < 0.4, -1.0, 2.0 * x)
        >>> every, rng = np.ones(60, dtype=bool), np.random.default_rng(0)
        >>> found, follow = majority_map(x, y, np.array([3.0]), 1e-9, rng=rng, among=every)
        >>> found.round(6).tolist(), len(follow)
        ([[2.0]], 36)
    """
    places, n = np.flatnonzero(among), terms.shape[1]
    if len(places) < 2 * n:
        return None
    size = np.maximum(np.abs(terms[places]).max(axis=0), 1e-300)
    scaled = np.zeros(terms.shape)
    scaled[places] = terms[places] / size

    def follows(found: Array, of: tuple[Array, Array]) -> NDArray[np.bool_]:
        return np.asarray((np.abs(of[0] @ found - of[1]) <= near * span).all(axis=1))

    looked = rng.choice(places, min(len(places), LOOKED), replace=False)
    seen, best = (scaled[looked], values[looked]), np.zeros(len(looked), dtype=bool)
    for _ in range(DRAWS):
        few = rng.choice(looked, n + 1, replace=False)
        follow = follows(np.linalg.lstsq(scaled[few], values[few], rcond=None)[0], seen)
        best = follow if follow.sum() > best.sum() else best
        if best.mean() > MOST:
            break
    if best.sum() < 2 * n:
        return None
    chosen, found = looked[best], np.zeros((n, values.shape[1]))
    for _ in range(3):
        found = np.linalg.lstsq(scaled[chosen], values[chosen], rcond=None)[0]
        chosen = places[follows(found, (scaled[places], values[places]))]
    return (found / size[:, np.newaxis], chosen) if len(chosen) >= n else None
