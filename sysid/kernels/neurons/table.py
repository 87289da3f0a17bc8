"""The kinds of neurons, and the compiled calls that find them by their place in the table.

A new kind is a file beside this one, a row of ``NEURONS``, and a branch of both functions below.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sysid.kernels.arrays import FAST
from sysid.kernels.neurons import cubic, tanh
from sysid.kernels.neurons.neuron import Neuron

NEURONS: dict[str, Neuron] = {neuron.name: neuron for neuron in (tanh.TANH, cubic.CUBIC)}
"""By the word in ``activation``; a kind's place is its code."""


def code_of(activation: str) -> int:
    """What the compiled functions call a kind.

    Args:
        activation: Its name.

    Returns:
        Its place in the table.
    """
    return list(NEURONS).index(activation)


@njit(cache=True, nogil=True, fastmath=FAST)
def activate(kind, a, first, n):
    """Replace ``n`` sums from ``first`` on by what neurons of a kind make of them; of an unknown kind NaN."""
    if kind == 0:
        tanh.values(a, first, n)
    elif kind == 1:
        cubic.values(a, first, n)
    else:
        a[first : first + n] = np.nan


@njit(cache=True, nogil=True, fastmath=FAST)
def activate_with_slopes(kind, a, slope):
    """Replace all sums by what neurons of a kind make of them, and write the derivatives; of an unknown kind NaN."""
    if kind == 0:
        tanh.with_slopes(a, slope)
    elif kind == 1:
        cubic.with_slopes(a, slope)
    else:
        a[:], slope[:] = np.nan, np.nan


@njit(cache=True, nogil=True, fastmath=FAST)
def slopes_of_values(kind, h, n, slope):
    """Write the derivatives of neurons by their values alone, and say whether this can be done: of tanh it can.

    Args:
        kind: Code of the kind.
        h: Values of the neurons, from the first number on.
        n: Number of neurons.
        slope: Written, shape ``(n,)`` or more.
    """
    if kind != 0:
        return False
    for k in range(n):
        slope[k] = 1.0 - h[k] * h[k]
    return True


@njit(cache=True, nogil=True, fastmath=FAST)
def slopes_of_sums(kind, theta, first, n, x, n_x, a, slope):
    """Write the derivatives of neurons of any kind by their sums, which are formed anew.

    Args:
        kind: Code of the kind.
        theta: Parameters; from ``first`` on the weights by neuron, then the constants.
        first: Where the neurons' parameters begin.
        n: Number of neurons.
        x: Regressors, from the first number on.
        n_x: How many.
        a: Room for the sums, shape ``(n,)`` or more.
        slope: Written, shape ``(n,)`` or more.
    """
    for k in range(n):
        total = theta[first + n * n_x + k]
        for i in range(n_x):
            total += theta[first + k * n_x + i] * x[i]
        a[k] = total
    activate_with_slopes(kind, a[:n], slope[:n])
