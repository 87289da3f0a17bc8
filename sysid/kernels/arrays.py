"""Arrays for compiled functions, and copies inside them: what a kernel is compiled for, and how long that takes.

An assignment of one array to part of another compiles the message about shapes that do not fit along with it, with all
that writes numbers as text: seconds for each kernel, of code that never runs here. And a kernel is compiled once more
for every type of argument, of which an array that can be written and one that cannot are two.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


def read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """A view that cannot be written, as the parameters of a model cannot: training and models run one compiled kernel.

    Args:
        array: Of any shape; what it is itself does not change.

    Returns:
        The view.
    """
    view = array.view()
    view.setflags(write=False)
    return view


@njit(cache=True, nogil=True)
def copy_numbers(source, target):
    """Write all numbers of an array over the first of another, both of shape ``(n,)``."""
    for i in range(len(source)):
        target[i] = source[i]


@njit(cache=True, nogil=True)
def copy_rows(source, target):
    """Write all rows of an array over the first of another, which are as wide."""
    for i in range(len(source)):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]
