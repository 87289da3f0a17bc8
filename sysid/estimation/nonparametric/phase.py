"""The phase of a response with all of its turns, at any frequencies.

From one far frequency to the next a dead time turns more than half a circle, and no unwrapping between them can tell.
So it is unwrapped over a grid that shows every lag, with the dead time taken out that the response itself shows, and
at the frequencies that are asked for it is the phase nearest to that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def unwrapped(values: Complex, frequency: Array, every: Complex, known: NDArray[np.bool_], sample_time: float) -> Array:
    """The phase of one response.

    Args:
        values: Where it is asked for, shape ``(n_points,)``.
        frequency: There, in rad/s.
        every: On an even grid from 0 to the Nyquist frequency, both with it, shape ``(n_grid,)``.
        known: Where on the grid it is known: a frequency that is not in the input has any phase. Shape ``(n_grid,)``.
        sample_time: Seconds.

    Returns:
        In radians, shape ``(n_points,)``; NaN where the response is.

    Example:
        >>> w = np.linspace(0.0, np.pi, 201)
        >>> far = np.array([0.5, 1.5, 3.0])
        >>> late = unwrapped(np.exp(-40j * far), far, np.exp(-40j * w), np.ones(201, dtype=bool), 1.0)
        >>> np.round(-late / far, 6).tolist()
        [40.0, 40.0, 40.0]
    """
    angle, n = np.angle(values), len(every) - 1
    if np.count_nonzero(known) < 2:
        return _between(angle)
    grid = np.pi * np.arange(n + 1) / n  # in rad per sample
    pulse = np.abs(np.fft.irfft(np.where(known, every, 0.0), 2 * n))[:n]
    turning = float(np.argmax(pulse)) * grid
    slow = np.unwrap(np.angle(every[known] * np.exp(1j * turning[known])))
    asked = np.abs(frequency) * sample_time
    shown = np.interp(asked, grid[known], slow)
    if abs(slow[0]) > 0.5 * np.pi:  # a gain below zero is half a turn ahead, or behind: as the first point has it
        first = float(shown[np.argmin(asked)])
        shown = shown - 2.0 * np.pi * np.round(first / (2.0 * np.pi))
    expected = np.sign(frequency) * (shown - np.argmax(pulse) * asked)
    return np.asarray(angle + 2.0 * np.pi * np.round((expected - angle) / (2.0 * np.pi)))


def _between(angle: Array) -> Array:
    """Unwrapped from one point to the next."""
    seen = np.isfinite(angle)
    found = np.full(len(angle), np.nan)
    found[seen] = np.unwrap(angle[seen])
    return found
