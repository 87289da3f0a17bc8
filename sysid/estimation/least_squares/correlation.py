"""How much of a residual is news: what is left of its samples when those that repeat each other count once."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray


def correlation_time(residual: NDArray[np.float64]) -> float:
    r"""Integrated autocorrelation time of a residual, in samples.

    :math:`\tau = 1 + 2\sum_k \rho_k`, summed until the window exceeds five times the sum (Sokal 1997, "Monte Carlo
    methods in statistical mechanics", section 3): ``len(residual) / tau`` independent samples would determine a mean
    as well as this residual does. The residuals of a free run are errors that persist, so it is far above 1.

    Args:
        residual: Shape ``(n_samples,)``.

    Returns:
        At least 1.

    Example:
        >>> noise = np.random.default_rng(0).standard_normal(20_000)
        >>> correlation_time(noise) < 1.2, correlation_time(np.repeat(noise, 10)) > 8.0
        (True, True)
    """
    n = len(residual)
    size = scipy.fft.next_fast_len(2 * n, real=True)
    spectrum = np.abs(scipy.fft.rfft(residual, size)) ** 2
    covariance = scipy.fft.irfft(spectrum, size)[:n]
    if not covariance[0] > 0.0 or not np.isfinite(covariance[0]):
        return 1.0
    tau = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
    inside = np.arange(n) >= 5.0 * tau
    return float(max(1.0, tau[int(np.argmax(inside))] if inside.any() else tau.max()))
