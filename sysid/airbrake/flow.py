"""Flow through an orifice: the coefficient Cq*Cm as a function of the pressure ratio, and its table.

The mass flow through an orifice of area ``A`` from ``p_high`` to ``p_low`` is
``A * kappa(p_low / p_high) * p_high / sqrt(T)`` with ``kappa = Cq * Cm``: Cm is the isentropic flow
function (choked below the critical ratio), Cq the discharge coefficient of Perry's polynomial, as in
the pneumatic-orifice libraries that the dissertation's ``CMCQ.mat`` stands for.

``kappa`` falls to zero like ``sqrt(1 - r)``: its slope at r = 1 is infinite, and an explicit scheme
chatters there. A *laminar* branch (ISO 6358: linear in r above a ratio of 0.995 to 0.999) removes that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import StabilityError

GAS_CONSTANT = 287.0
"""Specific gas constant of air in J/(kg K) (dissertation, Appendix C)."""

HEAT_RATIO = 1.4
"""Ratio of specific heats of air (dissertation, Appendix C)."""

CRITICAL_RATIO = (2.0 / (HEAT_RATIO + 1.0)) ** (HEAT_RATIO / (HEAT_RATIO - 1.0))
"""Pressure ratio at and below which the flow is choked: 0.528282."""

PERRY = (0.8414, -0.1002, 0.8415, -3.9, 4.6001, -1.6827)
"""Perry's discharge coefficient, from the constant term upwards."""

TABLE_INTERVALS = 4096
"""Intervals of the lookup table; uniform in ``sqrt(1 - r)``, hence clustered towards r = 1."""


def discharge_coefficient(ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Perry's discharge coefficient Cq.

    Args:
        ratio: Low over high absolute pressure, in [0, 1], any shape.

    Returns:
        Cq, dimensionless, same shape.
    """
    value = np.zeros_like(ratio, dtype=np.float64)
    for factor in reversed(PERRY):
        value = value * ratio + factor
    return value


def flow_function(ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Isentropic flow function Cm.

    Args:
        ratio: Low over high absolute pressure, in [0, 1], any shape.

    Returns:
        Cm in s sqrt(K) / m, same shape.

    Example:
        >>> flow_function(np.array([0.3, 0.8, 1.0])).round(6).tolist()
        [0.040418, 0.033095, 0.0]
    """
    ratio = np.maximum(np.asarray(ratio, dtype=np.float64), CRITICAL_RATIO)
    g = HEAT_RATIO
    # The difference of two powers loses all digits near r = 1; expm1 and log keep them.
    power = ratio ** (2.0 / g) * -np.expm1((g - 1.0) / g * np.log(ratio))
    return np.sqrt(2.0 * g / (GAS_CONSTANT * (g - 1.0)) * np.abs(power))


def flow_coefficient(ratio: NDArray[np.float64], *, laminar_ratio: float | None = None) -> NDArray[np.float64]:
    """Cq * Cm, with a linear branch near r = 1 if asked for.

    Args:
        ratio: Low over high absolute pressure, in [0, 1], any shape.
        laminar_ratio: Ratio above which the coefficient falls linearly to zero at r = 1.

    Returns:
        Cq * Cm in s sqrt(K) / m, same shape.

    Example:
        >>> flow_coefficient(np.array([0.0, 0.9, 0.999])).round(6).tolist()
        [0.034008, 0.015322, 0.001584]
    """
    ratio = np.asarray(ratio, dtype=np.float64)
    plain = discharge_coefficient(ratio) * flow_function(ratio)
    if laminar_ratio is None:
        return plain
    edge = np.array(laminar_ratio)
    slope = float(discharge_coefficient(edge) * flow_function(edge)) / (1.0 - laminar_ratio)
    return np.where(ratio > laminar_ratio, slope * (1.0 - ratio), plain)


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowTable:
    """The flow coefficient, tabulated uniformly in ``s = sqrt(1 - r)``.

    In ``s`` the coefficient has no singularity, so that linear interpolation is exact to some 1e-7.

    Args:
        values: Cq * Cm at ``s = 0, 1/n, ..., 1``, shape ``(n + 1,)``, in s sqrt(K) / m.
    """

    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        values.setflags(write=False)
        object.__setattr__(self, "values", values)

    @property
    def slopes(self) -> NDArray[np.float64]:
        """Difference to the next value, 0 for the last; same shape as ``values``."""
        return np.append(np.diff(self.values), 0.0)

    @property
    def steepest(self) -> float:
        """Largest ``-d kappa / d r`` of the branch at r = 1, taken over a tenth of a percent of pressure.

        For a table with a laminar branch this is the slope of that branch.
        """
        width = 1e-3
        return float(self(np.array(1.0 - width))) / width

    def __call__(self, ratio: NDArray[np.float64]) -> NDArray[np.float64]:
        """Interpolate.

        Args:
            ratio: Low over high absolute pressure, in [0, 1], any shape.

        Returns:
            Cq * Cm, same shape.
        """
        n = len(self.values) - 1
        position = np.sqrt(1.0 - np.asarray(ratio, dtype=np.float64)) * n
        index = position.astype(np.int64)
        return self.values[index] + (position - index) * self.slopes[index]


def flow_table(*, laminar_ratio: float | None = None) -> FlowTable:
    """The table from the formulas.

    Args:
        laminar_ratio: Ratio above which the flow is laminar (linear), or ``None`` for the plain formula.

    Returns:
        The table.

    Raises:
        StabilityError: If ``laminar_ratio`` is not between the critical ratio and 1.
    """
    if laminar_ratio is not None and not CRITICAL_RATIO < laminar_ratio < 1.0:
        raise StabilityError(
            "the laminar branch cannot start there",
            where="laminar_ratio",
            expected=f"a pressure ratio above {CRITICAL_RATIO:.4f} and below 1",
            got=laminar_ratio,
            remedy="use a value from 0.99 to 0.999, or none",
        )
    s = np.linspace(0.0, 1.0, TABLE_INTERVALS + 1)
    return FlowTable(values=flow_coefficient(1.0 - s * s, laminar_ratio=laminar_ratio))
