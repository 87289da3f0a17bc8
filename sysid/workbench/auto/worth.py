"""What a trial is worth: its error on what chooses, over several starts, and how far these are apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from statistics import median_high

import numpy as np

from sysid.reporting.sweep_record import Trial

Rank = Callable[[Trial], tuple[float, float, int]]
"""Sorting key of a trial, the best first: the share of what chooses that it does not stay within the tolerance on, its
error, its number."""


def ranked_by(error: Callable[[Trial], float], tolerance: float | None) -> Rank:
    """What chooses.

    Args:
        error: A mean square; infinite for what cannot be used.
        tolerance: Where how many of the traces that choose stay within it comes before the error: a mean hides one
            trace that fails behind others that are far better than they need to be. ``None`` for the error alone.

    Returns:
        The sorting key; what cannot be used is last.
    """

    def rank(trial: Trial) -> tuple[float, float, int]:
        usable = math.isfinite(error(trial))
        outside = 0.0 if tolerance is None or not usable else 1.0 - trial.within(tolerance)
        return outside if usable else math.inf, error(trial), trial.number

    return rank


def error(trial: Trial) -> float:
    """What chooses.

    Args:
        trial: A trial.

    Returns:
        The mean square of its free run over what chooses; infinite for what cannot be used.
    """
    value = float(trial.selection_free_run_mse)
    return value if trial.in_full and math.isfinite(value) else math.inf


def scatter(trials: Sequence[Trial]) -> float:
    """How far the errors of one point from several starts are apart, on the same parts.

    Args:
        trials: From each of the starts.

    Returns:
        Standard deviation of the errors' logarithm over the starts, as a root of a mean square over the parts; 0 where
        fewer than two have come to errors on all of them.
    """
    some = [one.selection_rms_shares for one in trials if one.in_full]
    errors = np.array([one for one in some if one and len(one) == len(max(some, key=len))])
    if len(errors) < 2 or not (np.isfinite(errors) & (errors > 0.0)).all():
        return 0.0
    return float(np.sqrt(np.mean(np.var(np.log(errors), axis=0, ddof=1))))


def with_repeats(trial: Trial, repeats: Sequence[Trial]) -> Trial:
    """A trial whose error is the median of its own and those of others of the same point, the upper one of two.

    Args:
        trial: The trial.
        repeats: The others; one that was dropped or cannot be used counts as without bound.

    Returns:
        The trial; not usable where the median is without bound.
    """
    errors = [trial.selection_free_run_mse, *(r.selection_free_run_mse if r.in_full else math.inf for r in repeats)]
    middle = median_high(errors)
    times = {name: getattr(trial, name) + sum(getattr(one, name) for one in repeats) for name in ("seconds", "cpu_s")}
    return trial.model_copy(update={"selection_free_run_mse": middle, **times})
