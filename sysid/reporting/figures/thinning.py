"""Fewer points for the same picture."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray


def thin(x: NDArray[np.float64], y: NDArray[np.float64], columns: int) -> tuple[NDArray[np.float64], ...]:
    """The points of a line that can be seen when it is drawn a number of columns wide.

    Of each column the first, the smallest, the largest and the last value are kept, in their order: what
    remains draws the same pixels (Jugel and others, "M4", VLDB 2014), spikes of a single sample included.

    Args:
        x: Shape ``(n_samples,)``, increasing.
        y: Shape ``(n_samples,)``; values that are not finite are kept as gaps.
        columns: Number of columns.

    Returns:
        Two arrays; a line without gaps becomes at most ``4 columns`` long.

    Example:
        >>> x = np.arange(1000.0)
        >>> y = np.where(x == 517, 9.0, 0.0)
        >>> thinned = thin(x, y, 10)
        >>> len(thinned[0]) <= 40, thinned[1].max()
        (True, np.float64(9.0))
    """
    if len(x) <= 4 * columns:
        return x, y
    edges = np.linspace(0, len(x), columns + 1).astype(np.intp)
    kept: set[int] = set()
    for begin, end in pairwise(edges):
        part = y[begin:end]
        finite = np.isfinite(part)
        kept.update((int(begin), int(end) - 1))
        if finite.any():
            kept.add(int(begin) + int(np.argmin(np.where(finite, part, np.inf))))
            kept.add(int(begin) + int(np.argmax(np.where(finite, part, -np.inf))))
        if not finite.all():
            kept.add(int(begin) + int(np.argmin(finite)))
    index = np.array(sorted(kept))
    return x[index], y[index]


def distinct_points(
    x: NDArray[np.float64], y: NDArray[np.float64], cells: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The points of a scatter that can be told apart on a square grid.

    Args:
        x: Shape ``(n_samples,)``.
        y: Shape ``(n_samples,)``.
        cells: Number of cells along each axis.

    Returns:
        The centres of the cells that hold a point, two arrays of equal length; points that are not finite are
        left out.
    """
    finite = np.isfinite(x) & np.isfinite(y)
    points = np.column_stack([x[finite], y[finite]])
    if not len(points):
        return np.empty(0), np.empty(0)
    low = points.min(axis=0)
    step = np.maximum((points.max(axis=0) - low) / cells, np.finfo(np.float64).tiny)
    cell = np.unique(np.minimum(np.floor((points - low) / step), cells - 1), axis=0)
    centres = low + (cell + 0.5) * step
    return centres[:, 0], centres[:, 1]
