"""What both passes, of one record and of many in lockstep, do with an output at every sample: sum it up, hold it."""

from __future__ import annotations

from numba import njit

from sysid.kernels.arrays import FAST
from sysid.kernels.cascade_layout import FREE, LOST


@njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def weighted(total, theta, first, x, first_x, n_x):
    """A sum, and the linear part of a network behind it, from its regressors side by side."""
    for i in range(n_x):
        total += theta[first + i] * x[first_x + i]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def bounded(y, low, high):
    """An output within the network's bound, and whether that held it; NaN passes."""
    if y < low:
        return low, LOST
    if y > high:
        return high, LOST
    return y, FREE


@njit(cache=True, nogil=True, error_model="numpy")
def limited(value, code, low, high, low_code, high_code):
    """A value within its limits, and what held it; the lower limit comes last, so that it wins where the two cross."""
    if value > high:
        value, code = high, high_code
    if value < low:
        value, code = low, low_code
    return value, code
