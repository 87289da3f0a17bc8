"""The step of the converter that a signal came through: what of it is resolution, and not motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ROUNDING, EVEN = 1e-6, 0.95
"""Part of a signal's range that is rounding, as float32 leaves it; and part of the distances between its values that
are multiples of one, where that is the step of a converter."""

FEW_STEPS, VISIBLE = 4, 0.01
"""Steps that a signal of a converter has at least: a switch has fewer; and least part of a signal's standard deviation
that a coarse step is."""


def converter_step(values: NDArray[np.float64]) -> float | None:
    """The step of a converter, where all values are multiples of one.

    Args:
        values: Finite, shape ``(n,)``.

    Returns:
        The step, in the values' unit; ``None`` where they have none, or are too few to say.

    Example:
        >>> converter_step(np.round(np.sin(np.arange(200.0)) / 0.1) * 0.1).__round__(9)
        0.1
    """
    apart = np.diff(np.unique(values)) if len(values) >= 20 else np.empty(0)
    apart = apart[apart > ROUNDING * apart.sum()]
    if not 0 < len(apart) <= 0.7 * len(values) or apart.sum() / FEW_STEPS < apart.min():
        return None
    count = apart / apart.min()
    return float(apart.min()) if np.mean(np.abs(count - np.round(count)) < 0.05) > EVEN else None


def coarse_step(values: NDArray[np.float64]) -> float | None:
    """The step of a converter that is coarse: a signal that moves by less from sample to sample shows its steps.

    Args:
        values: Neighbouring samples, finite, shape ``(n,)``.

    Returns:
        The step, in the values' unit; ``None`` where it is fine, or the signal goes several steps at a time, as
        commands do.
    """
    step = converter_step(values)
    if step is None:
        return None
    moves = np.abs(np.diff(values))
    one_by_one = np.median(moves[moves > 0.5 * step]) < 1.5 * step
    shown = step**2 > np.mean(moves**2) and step > VISIBLE * float(values.std())
    return step if one_by_one and shown else None
