r"""What a long ARX model leaves unexplained: errors that no model of the same records can clearly undercut.

A long ARX model comes as near to any linear system with noise as its order allows, and is found without a search. A
model whose one-step errors are as small stands at its least prediction error, up to chance: whether they are is a
test of the likelihood ratio, :math:`N (\ln\det\Sigma - \ln\det\Sigma_{ARX})` against :math:`\chi^2` with as many
degrees of freedom as the ARX model has coefficients more (Wilks 1938, "The large-sample distribution of the likelihood
ratio for testing composite hypotheses"). Further starts cannot gain more than chance then, and need not be tried.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from sysid.estimation.linear.subspace.projections import regress
from sysid.estimation.linear.subspace.windows import Windows

Array = NDArray[np.float64]

CHANCE = 0.05
"""How often errors that are as small are nevertheless called larger; it costs further starts."""


@dataclass(frozen=True, kw_only=True)
class Yardstick:
    """What a long ARX model leaves of some records.

    Args:
        size: Logarithm of the determinant of the covariance of its errors.
        n_parameters: Its coefficients.
        n_rows: Samples that it was fitted to.
    """

    size: float
    n_parameters: int
    n_rows: int

    @classmethod
    def of(cls, windows: Windows, order: int, *, feedthrough: bool) -> Yardstick:
        """From windows that are at least as long.

        Args:
            windows: The records.
            order: Lags.
            feedthrough: Whether outputs depend on inputs of the same sample.

        Returns:
            What is left.
        """
        parts = [windows.constant, windows.at(-order, 0), *([windows.inputs(0, 1)] if feedthrough else [])]
        columns, target = np.concatenate(parts, axis=1), windows.outputs(0, 1)
        left = target - columns @ regress(columns, target)
        sign, size = np.linalg.slogdet(left.T @ left / max(windows.n_rows, 1))
        return cls(
            size=float(size) if sign > 0 else -np.inf,
            n_parameters=columns.shape[1] * windows.n_outputs,
            n_rows=windows.n_rows,
        )

    def reached(self, covariance: Array, n_parameters: int) -> bool:
        """Whether one-step errors are as small as these, but for chance.

        Args:
            covariance: Of a model's one-step errors.
            n_parameters: Its coefficients.

        Returns:
            Whether they are; never where the ARX model is no longer than the model, or explains all.
        """
        more, size = self.n_parameters - n_parameters, np.linalg.slogdet(covariance)[1]
        if more < 1 or not np.isfinite(self.size) or not np.isfinite(size):
            return False
        return bool(self.n_rows * (size - self.size) <= scipy.special.chdtri(more, CHANCE))


def beyond_chance(size: float, than: float, *, n_rows: int, n_parameters: int) -> float:
    """How much more a model with fewer coefficients leaves than chance would take away with the others.

    Args:
        size: Logarithm of the determinant of the covariance of its errors.
        than: That of the model which contains it.
        n_rows: Samples that both were fitted to.
        n_parameters: How many coefficients it has less.

    Returns:
        What is left of the difference of the logarithms, by the test of the likelihood ratio; the model is clearly
        worse where it is positive.
    """
    return float(size - than - scipy.special.chdtri(max(n_parameters, 1), CHANCE) / n_rows)
