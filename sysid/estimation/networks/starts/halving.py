"""Successive halving: when starts are looked at, who goes on, and what all of it takes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

from sysid.estimation.networks.training import Training

RUNGS = (0.04, 0.12, 0.36, 0.65, 1.0)
"""Shares of the iterations after which the starts are looked at and, but for the last, half of them dropped
(successive halving, Jamieson and Talwalkar 2016). Who stays is decided by the error on the estimation traces: early
on, what the selection traces say of a start is noise; they choose at the end, among all states looked at."""

T = TypeVar("T")


def better_half(ranked: Sequence[T], least: int = 1) -> Sequence[T]:
    """Who goes on after a look.

    Args:
        ranked: The best first.
        least: So many go on in any case.

    Returns:
        Half of them, the larger one of an odd number.

    Example:
        >>> better_half("abc"), better_half("a"), better_half("abcdef", least=4)
        ('ab', 'a', 'abcd')
    """
    return ranked[: max((len(ranked) + 1) // 2, least)]


def rungs_of(training: Training) -> tuple[float, ...]:
    """When the starts of a training are looked at.

    Args:
        training: How to train.

    Returns:
        Shares of its iterations; one start is looked at in the end alone.
    """
    return RUNGS if training.n_starts > 1 else RUNGS[-1:]


def planned_iterations(training: Training, least: int = 1) -> float:
    """Iterations of the whole multistart, all starts together, if none of them converges early.

    Args:
        training: How to train.
        least: Starts that are trained to their end.

    Returns:
        Their number.

    Example:
        >>> planned_iterations(Training(max_iterations=100))
        100.0
        >>> round(planned_iterations(Training(max_iterations=100, starts=8)))
        176
    """
    return training.max_iterations * turns(training.n_starts, rungs_of(training), 1, least)


def turns(starts: int, rungs: Sequence[float], workers: int, least: int = 1) -> float:
    """How long the whole multistart takes where so many starts run at the same time.

    Args:
        starts: How many there are.
        rungs: Shares of the iterations after which half of them are dropped.
        workers: Starts that run side by side.
        least: Starts that are trained to their end.

    Returns:
        In units of one start's run, if none converges early.
    """
    taken, before, n = 0.0, 0.0, starts
    for share in rungs:
        taken, before, n = (
            taken + math.ceil(n / workers) * (share - before), share, len(better_half(range(n), least))
        )  # fmt: skip
    return taken
