r"""What is known of an impulse response beforehand: it decays, and it is smooth.

The two priors of Chen, Ohlsson and Ljung (2012), "On the estimation of transfer functions, regularizations and Gaussian
processes: revisited", Automatica 48:

* **DC** (diagonal and correlated): :math:`P_{ij} = c\,\lambda^{(i+j)/2}\rho^{|i-j|}`;
* **TC** (tuned and correlated): :math:`P_{ij} = c\,\lambda^{\max(i,j)}`, which is DC with :math:`\rho=\sqrt\lambda`.

Either is a decaying autoregression of order one, so that its Cholesky factor is known in closed form and needs no
factorisation, which would be singular to rounding for a long response.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Kernel(enum.Enum):
    """Which prior; the value is its name."""

    TC = "TC"
    """Decay and smoothness go together: two hyperparameters an input."""
    DC = "DC"
    """Decay and correlation apart: three hyperparameters an input."""

    @property
    def size(self) -> int:
        """Hyperparameters of an input."""
        return 2 if self is Kernel.TC else 3


@dataclass(frozen=True, kw_only=True)
class Hyperparameters:
    """The prior of one input's response.

    Args:
        scale: Its variance at the first lag, in output units squared by input unit squared.
        decay: By which factor the variance falls with each sample, 0 to 1.
        correlation: Of neighbouring samples, 0 to 1.
    """

    scale: float
    decay: float
    correlation: float

    def factor(self, n: int) -> NDArray[np.float64]:
        """The lower Cholesky factor of its covariance.

        Args:
            n: Lags.

        Returns:
            Shape ``(n, n)``.

        Example:
            >>> prior = Hyperparameters(scale=2.0, decay=0.64, correlation=0.8)
            >>> L = prior.factor(3)
            >>> np.allclose(L @ L.T, [[2 * 0.64 ** max(i, j) for i in range(3)] for j in range(3)])
            True
        """
        k = np.arange(n, dtype=np.float64)
        # rho ** (i - j) in the lower triangle: every row is a stretch of the same powers, after nothing.
        powers = np.zeros(2 * n)
        powers[:n] = self.correlation ** np.arange(n - 1, -1, -1, dtype=np.float64)
        size = powers.itemsize
        rows = np.ndarray((n, n), buffer=powers, offset=max(n - 1, 0) * size, strides=(-size, size))
        L = (np.sqrt(self.scale) * self.decay ** (0.5 * k))[:, None] * rows
        L[:, 1:] *= np.sqrt(max(1.0 - self.correlation**2, 0.0))
        return np.asarray(L)

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {"scale": self.scale, "decay": self.decay, "correlation": self.correlation}
