"""Figures of merit of one output against one target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Figures:
    """How close an output is to its target.

    Args:
        mse: Mean squared error, in the output's unit squared.
        nrmse_fit: Percent, ``100 (1 - |y - y_hat| / |y - mean(y)|)`` as MATLAB's ``compare`` prints it; NaN for a
            target that does not vary.
        max_abs_error: Largest absolute error, in the output's unit.
        r: Correlation coefficient of target and output; NaN where one of them does not vary.
        unit: The output's unit.
    """

    mse: float
    nrmse_fit: float
    max_abs_error: float
    r: float
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """The figures as JSON values."""
        return {
            "mse": self.mse,
            "nrmse_fit": self.nrmse_fit,
            "max_abs_error": self.max_abs_error,
            "r": self.r,
            "unit": self.unit,
        }


def figures(
    target: NDArray[np.float64], output: NDArray[np.float64], unit: str, counted: NDArray[np.bool_] | None = None
) -> Figures:
    """Compare an output with its target.

    Args:
        target: Shape ``(n_samples,)``.
        output: Shape ``(n_samples,)``; a value that is not finite makes every figure infinite or NaN.
        unit: Unit of both.
        counted: Which samples count; all by default.

    Returns:
        The figures.

    Example:
        >>> figures(np.array([0.0, 2.0]), np.array([0.0, 1.0]), "psi").mse
        0.5
    """
    if counted is not None:
        target, output = target[counted], output[counted]
    if not np.isfinite(output).all():
        return Figures(mse=np.inf, nrmse_fit=-np.inf, max_abs_error=np.inf, r=np.nan, unit=unit)
    error = output - target
    spread = float(np.linalg.norm(target - target.mean()))
    varies = spread > 0.0 and float(np.ptp(output)) > 0.0
    return Figures(
        mse=float(np.mean(error**2)),
        nrmse_fit=100.0 * (1.0 - float(np.linalg.norm(error)) / spread) if spread > 0.0 else np.nan,
        max_abs_error=float(np.abs(error).max()),
        r=float(np.corrcoef(target, output)[0, 1]) if varies else np.nan,
        unit=unit,
    )
