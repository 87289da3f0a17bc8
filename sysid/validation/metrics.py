"""Figures of merit of one output against one target."""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Mapping as Dict
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.traces.trace import LARGEST
from sysid.units import squared


@dataclass(frozen=True, kw_only=True)
class Merit:
    """How a figure of merit is shown: the one place where tables, comparisons and tracking learn of it.

    Args:
        key: Its name in :class:`Figures`, in ``results.json`` and where it is tracked.
        heading: Head of its column.
        unit: ``{unit}`` stands for the output's.
        below: What stands below the heading in place of the unit.
        digits: Significant digits that are printed.
        decimals: Digits behind the point, where those say more.
        compared: Whether a comparison of two models shows it.
    """

    key: str
    heading: str
    unit: str
    below: str = ""
    digits: int = 3
    decimals: int | None = None
    compared: bool = True

    def said(self, unit: str) -> str:
        """What stands below the heading.

        Args:
            unit: The output's.

        Returns:
            The unit, or other words.
        """
        return self.below or self.unit.format(unit=unit, squared=squared(unit))


def _merit(heading: str, unit: str, **shown: Any) -> Any:
    return field(metadata={"heading": heading, "unit": unit, **shown})


@dataclass(frozen=True, kw_only=True)
class Figures:
    """How close an output is to its target.

    Args:
        mse: Mean squared error, in the output's unit squared.
        nrmse_fit: Percent, ``100 (1 - |y - y_hat| / |y - mean(y)|)`` as MATLAB's ``compare`` prints it; NaN for a
            target that does not vary beyond rounding.
        max_abs_error: Largest absolute error, in the output's unit.
        r: Correlation coefficient of target and output; NaN where one of them does not vary.
        unit: The output's unit.
    """

    mse: float = _merit("mse", "{squared}")
    nrmse_fit: float = _merit("fit", "%", digits=4)
    max_abs_error: float = _merit("largest error", "{unit}")
    # R lies close to 1 for any useful model: three digits would print 1.00 for all of them.
    r: float = _merit("R", "", below="correlation", decimals=6, compared=False)
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """The figures as JSON values."""
        return asdict(self)

    @classmethod
    def from_dict(cls, stored: Dict[str, Any]) -> Figures:
        """What :meth:`to_dict` wrote; a figure that a later release added is NaN.

        Args:
            stored: What it wrote.

        Returns:
            The figures.
        """
        numbers = {merit.key: float(stored.get(merit.key, math.nan)) for merit in MERITS}
        return cls(**numbers, unit=stored["unit"])


MERITS = tuple(Merit(key=one.name, **one.metadata) for one in fields(Figures) if one.metadata)
"""The figures of merit in the order of their columns."""


def figures(
    target: NDArray[np.float64], output: NDArray[np.float64], unit: str, counted: NDArray[np.bool_] | None = None
) -> Figures:
    """Compare an output with its target.

    Args:
        target: Shape ``(n_samples,)``.
        output: Shape ``(n_samples,)``; a value that is not finite, or whose square is not, makes every figure
            infinite or NaN.
        unit: Unit of both.
        counted: Which samples count; all by default. Where none does, every figure is NaN.

    Returns:
        The figures.

    Example:
        >>> figures(np.array([0.0, 2.0]), np.array([0.0, 1.0]), "psi").mse
        0.5
    """
    if counted is not None:
        target, output = target[counted], output[counted]
    if len(target) == 0:
        return none(unit)
    still = is_constant(target)
    if not np.abs(output).max() < LARGEST:  # NaN is not either
        return Figures(mse=np.inf, nrmse_fit=np.nan if still else -np.inf, max_abs_error=np.inf, r=np.nan, unit=unit)
    error = output - target
    spread = float(np.linalg.norm(target - target.mean()))
    return Figures(
        mse=float(np.mean(error**2)),
        nrmse_fit=np.nan if still else 100.0 * (1.0 - float(np.linalg.norm(error)) / spread),
        max_abs_error=float(np.abs(error).max()),
        r=np.nan if still or is_constant(output) else float(np.corrcoef(target, output)[0, 1]),
        unit=unit,
    )


def none(unit: str) -> Figures:
    """The figures of what there is not.

    Args:
        unit: The output's unit.

    Returns:
        NaN throughout.
    """
    return Figures(mse=np.nan, nrmse_fit=np.nan, max_abs_error=np.nan, r=np.nan, unit=unit)


def is_constant(signal: NDArray[np.float64]) -> bool:
    """Whether a signal moves by no more than the rounding of its values: nothing relative to its spread means a thing.

    Args:
        signal: Finite, shape ``(n_samples,)``.

    Returns:
        True also for no sample at all.

    Example:
        >>> is_constant(np.full(50, 0.3)), is_constant(np.array([0.3, 0.3000001]))
        (True, False)
    """
    if len(signal) == 0:
        return True
    return bool(np.ptp(signal) <= _ROUNDING * np.finfo(np.float64).eps * np.abs(signal).max())


_ROUNDING = 8.0
"""Units in the last place that a value which was meant to be constant may have been moved by."""


def mean_fit(fits: Iterable[float]) -> float:
    """Mean of fits in percent over the cases that have one; the others' outputs never change.

    Args:
        fits: In percent; NaN where the target does not vary.

    Returns:
        The mean; NaN where no case has a fit.

    Example:
        >>> mean_fit([80.0, float("nan"), 90.0])
        85.0
    """
    defined = [fit for fit in fits if not np.isnan(fit)]
    return float(np.mean(defined)) if defined else float("nan")


def percent(fit: float) -> str:
    """A fit as it stands in a table.

    Args:
        fit: In percent.

    Returns:
        Two digits after the point; ``-`` where the target does not vary, ``< -10000`` where a run is elsewhere, as at
        another level, and ``diverged`` where it is lost.

    Example:
        >>> percent(99.987), percent(float("nan")), percent(-2e4), percent(-np.inf)
        ('99.99', '-', '< -10000', 'diverged')
    """
    if np.isnan(fit):
        return "-"
    return f"{fit:.2f}" if fit > _AWAY else f"< {_AWAY:.0f}" if fit > _LOST else "diverged"


_AWAY, _LOST = -1e4, -1e8
"""Percent below which a number says no more than that the run left its target by a hundred times its range, which a
stable model may do that is at another level than a record in which little happens; and by a million times."""
