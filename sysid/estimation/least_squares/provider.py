"""The seam of every fit: what gives residuals and Jacobians, and what a Gauss-Newton method needs to know of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

LARGEST = 1e150
"""Entries of a matrix from here on are those of sensitivities that explode: what multiplies them may overflow."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Linearisation:
    r"""What a Gauss-Newton method needs to know at one point.

    Args:
        loss: :math:`\frac12 \sum w e^2` in scaled numbers.
        gradient: :math:`J^T W e` with :math:`e = \hat y - y`, shape ``(n_parameters,)``.
        gauss_newton: :math:`J^T W J`, shape ``(n_parameters, n_parameters)``.
        correlation_time: Counted samples after which the residuals count as new information, at least 1 (see
            :func:`correlation_time`); NaN where nobody asked for it.
    """

    loss: float
    gradient: NDArray[np.float64]
    gauss_newton: NDArray[np.float64]
    correlation_time: float = 1.0

    def scaled(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The Gauss-Newton matrix with a diagonal of ones, as rounding should see it.

        Returns:
            The roots of its diagonal, 1 where that is zero, and the matrix divided by them on both sides.
        """
        diagonal = np.diag(self.gauss_newton)
        root = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        return root, self.gauss_newton / root / root[:, np.newaxis]

    @property
    def finite(self) -> bool:
        """Whether the matrix can be used: the sensitivities of an unstable free run grow beyond all numbers."""
        return bool((np.abs(self.gauss_newton) < LARGEST).all() and np.isfinite(self.gradient).all())


class AbstractProvider(ABC):
    """Residuals of a model over experiments, as a function of its flat parameters."""

    n_samples: int
    """Samples that count."""

    @property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Least and greatest value of each parameter; ``None`` where there are no bounds."""
        return None

    def nearest(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """The parameters that a step leads to, where not all that it could lead to are any.

        Args:
            theta: Flat parameters and a step.

        Returns:
            The same shape; as they are by default.
        """
        return theta

    @abstractmethod
    def loss(self, theta: NDArray[np.float64]) -> float:
        """Half the weighted sum of squared residuals; ``inf`` where it is not finite.

        Args:
            theta: Flat parameters.

        Returns:
            The loss in scaled numbers.
        """

    @abstractmethod
    def linearise(self, theta: NDArray[np.float64], *, correlation: bool = True) -> Linearisation:
        """Loss, gradient and Gauss-Newton matrix.

        Args:
            theta: Flat parameters.
            correlation: Whether the correlation time is found as well, for the evidence. A step needs it not, and a
                pass over a short record is so fast that a transform of its residuals is a tenth of it.

        Returns:
            All three, and that time where it was asked for.
        """


class AbstractWeighing(AbstractProvider):
    """Residuals of one output or several, each of which may weigh something else."""

    output_weights: tuple[float, ...] | None
    """What a squared residual of each output counts, in scaled numbers; ``None`` for all alike."""

    @abstractmethod
    def variances(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean squared residual of each output over the samples that count, in scaled numbers, without the weights.

        Args:
            theta: Flat parameters.

        Returns:
            Shape ``(n_outputs,)``.
        """

    @abstractmethod
    def with_output_weights(self, weights: tuple[float, ...]) -> Self:
        """The same residuals with other weights.

        Args:
            weights: One an output.

        Returns:
            The provider.
        """
