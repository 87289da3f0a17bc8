"""Where a fit by Levenberg-Marquardt stands, what is seen of it on the way, and where it ended."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.damping.base import AbstractDamping
from sysid.estimation.least_squares.evidence import Prior
from sysid.estimation.least_squares.provider import Linearisation
from sysid.estimation.results.result import Evidence, Status


@dataclass(frozen=True, kw_only=True)
class Iteration:
    """What a progress bar or a learning curve sees.

    Args:
        iteration: Iterations done.
        mse: Mean squared residual in scaled numbers.
        damping: Damping factor.
        effective_parameters: Number of parameters that the data determine; NaN before the first update.
        elapsed_s: Seconds since the fit began.
    """

    iteration: int
    mse: float
    damping: float
    effective_parameters: float
    elapsed_s: float


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """Where a fit stands."""

    # updated after each accepted step
    theta: NDArray[np.float64]
    at: Linearisation
    # updated every iteration
    damping: AbstractDamping
    iteration: int = 0
    # updated with the evidence
    prior: Prior
    evidence: Evidence | None = None
    # used for termination and reports
    losses: tuple[float, ...] = ()
    curve: tuple[Iteration, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Solution:
    """Where a fit ended.

    Args:
        state: Where it stands; a later run can go on from here.
        status: Why it stopped.
    """

    state: State
    status: Status

    @property
    def theta(self) -> NDArray[np.float64]:
        """Flat parameters."""
        return self.state.theta

    @property
    def curve(self) -> tuple[Iteration, ...]:
        """One entry per iteration, the start first."""
        return self.state.curve

    @property
    def evidence(self) -> Evidence | None:
        """From the last update; ``None`` if there was none."""
        return self.state.evidence

    @property
    def at(self) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix at ``theta``."""
        return self.state.at
