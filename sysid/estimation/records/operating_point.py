"""The operating point that deviation variables are counted from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sysid.models import ARX


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """Values around which a linear model without an intercept is fitted.

    A linear model of pressures around 90 psi that has neither an intercept nor deviation variables is forced
    through the origin, far outside its data.

    Args:
        inputs: One value per input, in its unit.
        output: The output's value, in its unit.

    Example:
        >>> point = OperatingPoint(inputs=(90.0,), output=2.0)
        >>> point.intercept(ARX(na=1, nb=(1,), nk=(1,), intercept=False), np.array([0.1, 0.5]))
        -8.0
    """

    inputs: tuple[float, ...]
    output: float

    def intercept(self, orders: ARX, coefficients: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
        """The constant that turns a model of deviations into the same model of the values themselves.

        Args:
            orders: The structure.
            coefficients: ``[b of input 1 | ... | a]`` of the deviations, shape ``(n_regressors,)``.

        Returns:
            A value in the output's unit.
        """
        values = [u for u, nb in zip(self.inputs, orders.nb, strict=True) for _ in range(nb)]
        return float(self.output - np.dot(coefficients, values + [self.output] * orders.na))
