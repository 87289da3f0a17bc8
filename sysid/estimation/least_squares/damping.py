"""Damping: how far a Levenberg-Marquardt step may go."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True, eq=False)
class MarquardtDamping:
    """Damping proportional to the curvature of each parameter, steered by the gain ratio.

    The damped matrix is ``H + factor * diag(scale)``. Scaling by the diagonal of ``H`` (Marquardt 1963), kept
    at its running maximum (Moré 1978, "The Levenberg-Marquardt algorithm: implementation and theory", eq. 6.3),
    makes the step independent of the units of the parameters; damping by a multiple of the identity stalls on
    networks whose weights matter very differently. The factor follows Nielsen 1999 ("Damping parameter in
    Marquardt's method", eq. 3.3).

    Args:
        factor: Damping factor.
        growth: By what it grows at the next rejection.
        scale: Shape ``(n_parameters,)``; zeros before the first step.
    """

    factor: float = 1e-3
    growth: float = 2.0
    scale: NDArray[np.float64] | None = None

    def scaled_by(self, diagonal: NDArray[np.float64]) -> MarquardtDamping:
        """The damping with its scale raised to this diagonal.

        Args:
            diagonal: Diagonal of the penalised Gauss-Newton matrix, shape ``(n_parameters,)``.

        Returns:
            The damping for the next step.
        """
        # A slow forgetting of the running maximum: the free run's curvature falls by orders of magnitude once an
        # unstable start has been tamed, and a scale that remembers it for ever would freeze those parameters.
        scale = diagonal if self.scale is None else np.maximum(diagonal, 0.5 * self.scale)
        return replace(self, scale=scale)

    def accepted(self, gain: float) -> MarquardtDamping:
        """The damping after a step that was taken.

        Args:
            gain: Actual over predicted decrease of the loss.

        Returns:
            Smaller damping the better the prediction was.
        """
        return replace(self, factor=max(self.factor * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 1e-12), growth=2.0)

    def rejected(self) -> MarquardtDamping:
        """The damping after a step that was not taken."""
        return replace(self, factor=self.factor * self.growth, growth=2.0 * self.growth)
