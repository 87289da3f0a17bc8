"""Uncertainty: how well the data determine the parameters of a model."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

_OPTIONAL = ("profile", "noise_covariance")
"""Fields that only some fits have."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Uncertainty:
    r"""Estimates with their covariance, under white residuals and a true structure.

    Args:
        names: What each parameter is.
        values: Estimates, shape ``(n_parameters,)``.
        covariance: Shape ``(n_parameters, n_parameters)``; NaN in rows of parameters that the data do not determine.
        noise_variance: Variance of the residuals, :math:`\sum e^2 / (N - p)`, in the output's unit squared; of
            several outputs the root of the determinant of their covariance, one for each.
        profile: Ends of 95 % intervals by profile likelihood, shape ``(n_parameters, 2)``; infinite where the data do
            not end one. ``None`` where nobody asked for them.
        noise_covariance: Covariance of the residuals of several outputs, in the products of their units, shape
            ``(n_outputs, n_outputs)``; ``None`` of one.

    Example:
        >>> u = Uncertainty(names=("a1",), values=np.array([0.5]), covariance=np.array([[0.01]]), noise_variance=1.0)
        >>> u.interval(0.95).round(3).tolist()
        [[0.304, 0.696]]
    """

    names: tuple[str, ...]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    noise_variance: float
    profile: NDArray[np.float64] | None = None
    noise_covariance: NDArray[np.float64] | None = None

    @property
    def standard_deviations(self) -> NDArray[np.float64]:
        """One standard deviation of each estimate, shape ``(n_parameters,)``."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, probability: float = 0.95) -> NDArray[np.float64]:
        """Two-sided interval of each parameter, from the normal distribution.

        Args:
            probability: That it holds the true value.

        Returns:
            Shape ``(n_parameters, 2)``.
        """
        half = scipy.stats.norm.ppf(0.5 + 0.5 * probability) * self.standard_deviations
        return np.column_stack([self.values - half, self.values + half])

    @property
    def sentence(self) -> str:
        """Each parameter with half of its 95 % interval; those that have none alone."""
        half = self.interval(0.95)[:, 1] - self.values
        each = zip(self.names, self.values, half, strict=True)
        return ", ".join(
            f"{name} = {value:.5g}{'' if np.isnan(wide) else f' ± {wide:.2g}'}" for name, value, wide in each
        )

    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values."""
        optional = {name: getattr(self, name) for name in _OPTIONAL}
        return {
            "names": list(self.names),
            "values": self.values.tolist(),
            "covariance": self.covariance.tolist(),
            "noise_variance": self.noise_variance,
            **{name: values.tolist() for name, values in optional.items() if values is not None},
        }

    @classmethod
    def from_dict(cls, fields: Dict[str, Any]) -> Uncertainty:
        """The uncertainty that :meth:`to_dict` wrote.

        Args:
            fields: What it wrote.

        Returns:
            The uncertainty.
        """
        return cls(
            names=tuple(fields["names"]),
            values=np.asarray(fields["values"], dtype=np.float64),
            covariance=np.asarray(fields["covariance"], dtype=np.float64),
            noise_variance=float(fields["noise_variance"]),
            **{name: np.asarray(fields[name], dtype=np.float64) for name in _OPTIONAL if name in fields},
        )


_TINY = 1e-300


def generalised_variance(covariance: NDArray[np.float64]) -> float:
    """One figure for the noise of several outputs: the root of the determinant of their covariance, one for each.

    Args:
        covariance: Shape ``(n_outputs, n_outputs)``.

    Returns:
        Of one output its variance.

    Example:
        >>> float(round(generalised_variance(np.diag([4.0, 9.0])), 12))
        6.0
    """
    p = len(covariance)
    return float(np.exp(np.linalg.slogdet(covariance + _TINY * np.eye(p))[1] / p))
