"""Damping by the curvature of each parameter, steered by how well the last step was foretold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.damping.base import AbstractDamping


@dataclass(frozen=True, kw_only=True, eq=False)
class MarquardtDamping(AbstractDamping):
    """Damping proportional to the curvature of each parameter, steered by the gain ratio.

    Scaling by the diagonal of ``H`` (Marquardt 1963), kept
    at its running maximum (Moré 1978, "The Levenberg-Marquardt algorithm: implementation and theory", eq. 6.3),
    makes the step independent of the units of the parameters; damping by a multiple of the identity stalls on
    networks whose weights matter very differently. The factor follows Nielsen 1999 ("Damping parameter in
    Marquardt's method", eq. 3.3).

    Args:
        factor: Damping factor.
        growth: By what it is multiplied at the next rejection.
        scale: Shape ``(n_parameters,)``; ``None`` before the first step.
    """

    kind: ClassVar[str] = "marquardt"

    factor: float = 1e-3
    growth: float = 2.0

    def scaled_by(self, diagonal: NDArray[np.float64]) -> Self:
        """The damping with its scale raised to this diagonal; see the base class."""
        # A slow forgetting of the running maximum: the free run's curvature falls by orders of magnitude once an
        # unstable start has been tamed, and a scale that remembers it for ever would freeze those parameters.
        scale = diagonal if self.scale is None else np.maximum(diagonal, 0.5 * self.scale)
        return replace(self, scale=scale)

    def accepted(self, gain: float) -> Self:
        """Smaller damping the better the prediction was; see the base class."""
        return replace(self, factor=max(self.factor * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 1e-12), growth=2.0)

    def rejected(self) -> Self:
        """The damping after a step that was not taken."""
        return replace(self, factor=self.factor * self.growth, growth=2.0 * self.growth)
