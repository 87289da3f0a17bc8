"""How much of a residual is news: what is left of its samples when those that repeat each other count once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BLOCK, LAGS, LONGER = 2**17, 2**14, 8
"""Samples of a block of a long residual; lags that are looked at first, and how many times more of them then."""


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
    lags = n if n <= BLOCK else LAGS
    while True:
        tau = products(residual, residual, lags)
        if not tau[0] > 0.0 or not np.isfinite(tau[0]):
            return 1.0
        tau = 2.0 * np.cumsum(tau / tau[0]) - 1.0
        inside = np.arange(lags) >= 5.0 * tau
        if inside.any() or lags == n:
            return float(max(1.0, tau[int(np.argmax(inside))] if inside.any() else tau.max()))
        lags = min(LONGER * lags, n)


def products(ahead: NDArray[np.float64], here: NDArray[np.float64], lags: int) -> NDArray[np.float64]:
    """Sums of the products of the samples of one signal with those of another so far behind them.

    In blocks: of a million samples one transform has some 50 MB, and a fit takes one in every iteration.

    Args:
        ahead: Shape ``(n_samples,)``.
        here: The same shape.
        lags: How many, at most as many as samples.

    Returns:
        At lag ``k`` the sum of ``ahead[t + k] * here[t]``, shape ``(lags,)``.
    """
    total, block = np.zeros(lags), max(BLOCK, lags)
    for first in range(0, len(here), block):
        now, later = here[first : first + block], ahead[first : first + block + lags - 1]
        size = fast_length(len(now) + max(len(later), lags))
        spectrum = np.fft.rfft(later, size)
        alike = ahead is here and len(now) == len(later)
        spectrum *= np.conj(spectrum if alike else np.fft.rfft(now, size))
        total += np.fft.irfft(spectrum, size)[:lags]
    return total


def fast_length(least: int) -> int:
    """The least length from which on a transform has no prime factor above 5; scipy's own comes with 5 MB of modules.

    Args:
        least: Samples at least.

    Returns:
        The length.

    Example:
        >>> [fast_length(n) for n in (1, 7, 17, 1025)]
        [1, 8, 18, 1080]
    """
    found, fives = 1 << max(least - 1, 0).bit_length(), 1
    while fives < found:
        threes = fives
        while threes < found:
            twos = -(-least // threes)
            found = min(found, threes << max(twos - 1, 0).bit_length())
            threes *= 3
        fives *= 5
    return found
