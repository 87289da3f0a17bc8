"""Termination: when to stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sysid.estimation.results.result import Status

MAX_DAMPING = 1e12
"""Damping at which a step no longer changes the parameters in double precision."""


@dataclass(frozen=True, kw_only=True)
class Termination:
    """Limits of a fit.

    Args:
        max_iterations: Steps taken or tried.
        max_time_s: Wall time in seconds.
        tolerance: Relative improvement of the loss over ``patience`` iterations below which the fit
            has converged.
        patience: Iterations over which improvement is judged.
    """

    max_iterations: int = 200
    max_time_s: float = float("inf")
    tolerance: float = 1e-4
    patience: int = 10

    def check(self, *, iteration: int, elapsed: float, losses: Sequence[float], damping: float) -> Status | None:
        """Whether to stop now.

        Args:
            iteration: Iterations done.
            elapsed: Seconds since this run of the fit began.
            losses: Loss after each iteration, the start first.
            damping: Damping factor now.

        Returns:
            Why to stop, or ``None`` to go on.
        """
        if damping > MAX_DAMPING:
            return Status.STALLED
        if len(losses) > self.patience:
            before, now = losses[-1 - self.patience], losses[-1]
            if before - now <= self.tolerance * abs(before):
                return Status.CONVERGED
        if iteration >= self.max_iterations:
            return Status.MAX_ITERATIONS
        if elapsed > self.max_time_s:
            return Status.TIME_LIMIT
        return None
