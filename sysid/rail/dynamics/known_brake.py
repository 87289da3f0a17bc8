"""A brake that refuses what it was not fitted for: outside a surrogate answers all the same, however wrong."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import AbstractBrake, BrakeOutput, Signal
from sysid.rail.dynamics.surrogate import COMMAND, PIPE
from sysid.units import PSI_IN_PA

EDGE = 0.05
"""Of the width of a range, how far beyond it is let pass (ours): another car's pipe, the last digit of a handle."""


class KnownBrake(AbstractBrake):
    """A brake whose handle and pipe stay where its models were fitted.

    Args:
        brake: The brake.
        ranges: In psi gauge, of the handle (``STP``) and the pipe at the head and the tail (``BP``); others are not
            looked at.
    """

    def __init__(self, brake: AbstractBrake, ranges: Mapping[str, tuple[float, float]]) -> None:
        self.sample_time, self.vehicles = brake.sample_time, brake.vehicles
        self._brake, self._ranges = brake, ranges

    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        """Advance; see :meth:`AbstractBrake.advance`."""
        self._check(COMMAND, command)
        output = self._brake.advance(command, speed=speed, tail_vent=tail_vent)
        for pipe in (output.head_pipe, output.tail_pipe):
            if pipe is not None:
                self._check(PIPE, pipe / PSI_IN_PA)
        return output

    def _check(self, name: str, values: NDArray[np.float64]) -> None:
        low, high = self._ranges.get(name, (-np.inf, np.inf))
        slack = EDGE * (high - low) if name in self._ranges else 0.0
        beyond = values[(values < low - slack) | (values > high + slack)]
        if len(beyond):
            raise ConfigError(
                f"{name} goes to {beyond[0]:.4g} psi, and the traces that fitted it have {low:.4g} to {high:.4g}",
                where="the brake of a surrogate",
                expected=f"{name} from {low:.4g} to {high:.4g} psi",
                got=float(beyond[0]),
                remedy="fit it on traces that go so far, or say options: {beyond: true} to be shown what it does there",
            )
