"""Arrays for compiled functions, and copies inside them: what a kernel is compiled for, and how long that takes.

An assignment of one array to part of another compiles the message about shapes that do not fit along with it, with all
that writes numbers as text: seconds for each kernel, of code that never runs here. And a kernel is compiled once more
for every type of argument, of which an array that can be written and one that cannot are two.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

_Number = TypeVar("_Number", np.float64, np.uintp)

FAST = {"reassoc", "contract", "arcp", "nsz"}
"""Sums may be reordered, which is what lets the compiler vectorise them; NaN and infinity keep their meaning."""


def read_only(array: NDArray[_Number]) -> NDArray[_Number]:
    """A view that cannot be written, as the parameters of a model cannot: training and models run one compiled kernel.

    Args:
        array: Of any shape; what it is itself does not change.

    Returns:
        The view.
    """
    view = array.view()
    view.setflags(write=False)
    return view


GONE = 1e-150
"""Size below which a sensitivity is nothing: its square is the smallest that a processor takes in its stride."""


def forget_what_has_died_away(sensitivities: NDArray[np.float64]) -> None:
    """Set to zero what has all but gone, in place.

    What the first state of a record does dies away, but not to zero: rounded numbers near 1e-320 stay where they are,
    and processors take a hundred cycles for each. A pass over 100,000 samples was measured six times as long with them.

    Args:
        sensitivities: Of any shape.
    """
    sensitivities[np.abs(sensitivities) < GONE] = 0.0


@intrinsic
def stands_apart(_context: Any) -> Any:
    """Keep the function in which this stands out of those that call it: long ones are compiled again in each."""

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate


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
