"""How far the outputs of two runs are apart."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def largest_difference(output: NDArray[Any], expected: NDArray[np.float64]) -> float:
    """The largest absolute difference of two records.

    Args:
        output: Any shape.
        expected: The same shape.

    Returns:
        The difference; infinite where one of them is not a number and the other is, or where both are infinite
        with different signs.

    Example:
        >>> largest_difference(np.array([1.0, np.nan]), np.array([1.5, np.nan]))
        0.5
    """
    return float(np.max(differences(output, expected), initial=0.0))


def differences(output: NDArray[Any], expected: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of each sample and output, of any shape; 0 where both are the same, not a number too, and infinite where one is.

    Args:
        output: Of one run.
        expected: Of the other, same shape.

    Returns:
        Same shape.
    """
    same = (output == expected) | (np.isnan(output) & np.isnan(expected))
    with np.errstate(invalid="ignore"):
        difference = np.where(same, 0.0, np.abs(output - expected))
    return np.asarray(np.nan_to_num(difference, nan=np.inf, posinf=np.inf), dtype=np.float64)
