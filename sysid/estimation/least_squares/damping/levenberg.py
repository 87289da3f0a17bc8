"""Damping by a multiple of the identity, as ``trainlm`` and ``trainbr`` have it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.damping.base import AbstractDamping


@dataclass(frozen=True, kw_only=True, eq=False)
class LevenbergDamping(AbstractDamping):
    """A multiple of the identity, ten times less after a step that was taken and ten times more after one that was not.

    Levenberg 1944; the factor is the ``mu`` of MATLAB's ``trainbr``, with its defaults (``mu`` 0.005, ``mu_dec`` 0.1,
    ``mu_inc`` 10). For comparisons with networks that were trained there.

    Args:
        factor: Damping factor.
        scale: Ones; ``None`` before the first step.
    """

    kind: ClassVar[str] = "levenberg"

    factor: float = 0.005

    def scaled_by(self, diagonal: NDArray[np.float64]) -> Self:
        """The same damping for every parameter: of the diagonal the size alone counts; see the base class."""
        return replace(self, scale=np.ones_like(diagonal))

    def accepted(self, gain: float) -> Self:  # noqa: ARG002 - it does not ask how good the step was
        """A tenth; see the base class."""
        return replace(self, factor=max(0.1 * self.factor, 1e-12))

    def rejected(self) -> Self:
        """Ten times as much."""
        return replace(self, factor=10.0 * self.factor)
