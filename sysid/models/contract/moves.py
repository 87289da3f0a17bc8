"""How an output moves with parameters, by central differences, where nobody has derived it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

APART = 1e-3
"""Step of a difference, in standard deviations."""


def moves_of(
    run: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    theta: NDArray[np.float64],
    factor: NDArray[np.float64],
    shape: tuple[int, ...],
    *,
    largest: float = np.inf,
) -> NDArray[np.float64]:
    """Derivatives of an output along directions of the parameters.

    Args:
        run: From parameters to the output.
        theta: The parameters, shape ``(n_parameters,)``.
        factor: The directions, one standard deviation each, shape ``(n_parameters, n_directions)``.
        shape: Of the output.
        largest: Step of any parameter that is not exceeded, for parameters whose standard deviations may be beyond
            where the output still follows a line.

    Returns:
        Shape ``(*shape, n_directions)``.

    Example:
        >>> moves_of(lambda theta: theta[:1] ** 2, np.array([3.0]), np.array([[0.1]]), (1,)).round(6).tolist()
        [[0.6]]
    """
    found = np.zeros((*shape, factor.shape[1]))
    for at, column in enumerate(factor.T):
        step = min(APART, largest / max(float(np.abs(column).max(initial=0.0)), np.finfo(np.float64).tiny))
        found[..., at] = (run(theta + step * column) - run(theta - step * column)) / (2.0 * step)
    return found
