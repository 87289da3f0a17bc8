"""Which channels of some records say anything: those that move, and are not made of others."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

STILL = 8.0 * np.finfo(np.float64).eps
"""How far a channel moves, relative to its size, below which it never changes."""
SAME = 1e-9
"""Part of an input that others do not explain, below which it is made of them."""


def informative(inputs: NDArray[np.float64]) -> tuple[int, ...]:
    """The inputs whose effects records tell: those that move, and are not made of ones before them.

    Args:
        inputs: All that count, shape ``(n_samples, n_inputs)``.

    Returns:
        Their places, in order.
    """
    kept: list[int] = []
    for j, column in enumerate(inputs.T):
        if not still(column) and not (kept and _made_of(column, inputs[:, kept])):
            kept.append(j)
    return tuple(kept)


def still(column: NDArray[np.float64]) -> bool:
    """Whether a channel never changes, but for rounding."""
    return bool(np.ptp(column) <= STILL * np.abs(column).max(initial=0.0))


def _made_of(column: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    return own_part(column, others) <= SAME


def own_part(column: NDArray[np.float64], others: NDArray[np.float64]) -> float:
    """The part of a channel's movement that others do not explain; 1 beside none.

    Args:
        column: Shape ``(n_samples,)``; it moves.
        others: Shape ``(n_samples, n)``.

    Returns:
        From 0 to 1, in standard deviations.
    """
    basis = unit(np.column_stack([others, np.ones(len(column))]))
    left = column - basis @ np.linalg.lstsq(basis, column, rcond=None)[0]
    return float(np.linalg.norm(left) / max(float(np.linalg.norm(column - column.mean())), np.finfo(np.float64).tiny))


def unit(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Columns of length 1; those of zeros stay."""
    tiny = float(np.finfo(np.float64).tiny)
    lengths = np.maximum(np.sqrt(np.sum(columns**2, axis=0)), tiny)
    return np.asarray(columns / lengths, dtype=np.float64)


def with_past(usable: NDArray[np.bool_], lags: int) -> NDArray[np.bool_]:
    """Samples that are not masked, nor any of the last ones before them.

    Args:
        usable: Which are not masked, shape ``(n_samples,)``.
        lags: How many before.

    Returns:
        The same shape.
    """
    whole = np.all([np.roll(usable, lag) for lag in range(lags + 1)], axis=0)
    whole[:lags] = False
    return np.asarray(whole)


def by_chance(share: float, used: int, free: int) -> float:
    """How probable it is that columns explain so much of noise (F test).

    Args:
        share: The part of its squares that they explain.
        used: The columns, or the parameters that they stand for.
        free: Degrees of freedom that are left.

    Returns:
        The probability.
    """
    left = max(1.0 - share, float(np.finfo(np.float64).eps))
    return float(scipy.special.fdtrc(used, free, share / used * free / left))


def by_chance_of_signs(products: NDArray[np.float64]) -> float:
    """How probable it is at most that moves go together so much, were their signs by chance (Hoeffding 1963).

    The F test takes noise to be alike at every sample. Where a few jumps are all that is new in two signals, one that
    falls on another explains as much as many do; here it counts as one.

    Args:
        products: Of what is new in both, sample by sample.

    Returns:
        The probability's bound.
    """
    largest = float(np.abs(products).max(initial=0.0))
    if largest == 0.0:
        return 1.0
    scaled = products / largest  # squares of what is small are no number
    return float(np.exp(-0.5 * scaled.sum() ** 2 / (scaled @ scaled)))


def beyond_chance(share: float, before: int, after: int) -> float:
    """The part of squares that columns explain, less what they would of noise.

    Args:
        share: The part that they explain.
        before: Degrees of freedom without them.
        after: Degrees of freedom with them.

    Returns:
        From 0 to 1.
    """
    return max(0.0, 1.0 - (1.0 - share) * before / after)
