"""Uneven samples onto a uniform time grid: between neighbours, the last value, or the mean of an interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Method = Literal["linear", "hold", "average"]
_FUZZ = 1e-6  # of a sample time: stamps this close to a grid point count as on it


@dataclass(frozen=True, kw_only=True, eq=False)
class Gridded:
    """Samples on a uniform grid.

    Args:
        start: Time of the first grid point in seconds.
        values: Shape ``(n_grid, n_channels)``; NaN where ``empty``.
        empty: Shape ``(n_grid,)``: grid points that lie in a gap.
        tainted: Shape ``(n_grid, n_channels)``: values to which a marked one contributed.
    """

    start: float
    values: NDArray[np.float64]
    empty: NDArray[np.bool_]
    tainted: NDArray[np.bool_]


def grid_places(
    stamps: NDArray[np.float64], sample_time: float, *, start: float, tolerance: float
) -> NDArray[np.intp] | None:
    """The place of each stamp on a grid, if all of them lie on it.

    Args:
        stamps: Shape ``(n,)``, rising, seconds.
        sample_time: Seconds between grid points.
        start: Time of grid point 0.
        tolerance: How far off a stamp may lie, as a fraction of the sample time.

    Returns:
        Shape ``(n,)``, rising; or ``None`` if a stamp lies off the grid or two share a place.

    Example:
        >>> grid_places(np.array([0.0, 0.1001, 0.3]), 0.1, start=0.0, tolerance=0.01).tolist()
        [0, 1, 3]
    """
    # In place wherever it can be: a record may have tens of millions of stamps.
    off = stamps - start
    off /= sample_time
    places = np.rint(off)
    off -= places
    # Stamps far from zero are themselves rounded: 1.7e9 s is stored to 2.4e-7 s.
    rounding = 4.0 * np.spacing(max(abs(stamps.max()), abs(stamps.min()))) / sample_time
    if max(off.max(), -off.min()) > tolerance + rounding or (places[1:] <= places[:-1]).any():
        return None
    del off
    return places.astype(np.intp)


def place(
    stamps: NDArray[np.float64], values: NDArray[np.float64], places: NDArray[np.intp], marked: NDArray[np.bool_]
) -> Gridded:
    """Samples that lie on the grid, put there unchanged.

    Args:
        stamps: Shape ``(n,)``, seconds.
        values: Shape ``(n, n_channels)``.
        places: Shape ``(n,)``: their places, from :func:`grid_places`.
        marked: Shape ``(n, n_channels)``: values that must not count.

    Returns:
        The samples; places that no stamp has are empty.
    """
    count = int(places[-1]) + 1
    if count == len(values):  # one at each place
        return Gridded(
            start=float(stamps[0]), values=values, empty=np.zeros(count, dtype=np.bool_), tainted=marked.copy()
        )
    out = np.full((count, values.shape[1]), np.nan)
    out[places] = values
    empty = np.ones(count, dtype=np.bool_)
    empty[places] = False
    tainted = np.zeros((count, values.shape[1]), dtype=np.bool_)
    tainted[places] = marked
    return Gridded(start=float(stamps[0]), values=out, empty=empty, tainted=tainted)


def resample(
    stamps: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    sample_time: float,
    method: Method,
    start: float,
    longest_step: float,
    marked: NDArray[np.bool_],
) -> Gridded:
    """Samples brought onto the grid ``start + k * sample_time``.

    ``average`` takes the mean of the samples in ``[t, t + sample_time)`` as the value at ``t``, each
    sample standing for half a median step to either side; a last interval that the record does not
    fill is left out. ``linear`` and ``hold`` do not filter: a fast recording is better averaged.

    Args:
        stamps: Shape ``(n,)``, rising, seconds.
        values: Shape ``(n, n_channels)``, finite.
        sample_time: Seconds between grid points.
        method: How.
        start: Time of the first grid point, at or after the first stamp.
        longest_step: Seconds above which a step is a gap.
        marked: Shape ``(n, n_channels)``: values that must not count.

    Returns:
        The samples on the grid.
    """
    if method == "average":
        return _average(stamps, values, sample_time=sample_time, start=start, marked=marked)
    fuzz = _FUZZ * sample_time
    count = max(int(np.floor((stamps[-1] - start) / sample_time + _FUZZ)) + 1, 0)
    grid = start + sample_time * np.arange(count)
    before = np.clip(np.searchsorted(stamps, grid + fuzz, side="right") - 1, 0, len(stamps) - 1)
    after = np.minimum(before + 1, len(stamps) - 1)
    on_stamp = np.abs(grid - stamps[before]) <= fuzz
    empty = (stamps[after] - stamps[before] > longest_step * (1.0 + 1e-9)) & ~on_stamp
    if method == "hold":
        out, tainted = values[before], marked[before].copy()
    else:
        out = np.column_stack([np.interp(grid, stamps, column) for column in values.T])
        tainted = marked[before] | (marked[after] & ~on_stamp[:, None])
    out = np.where(empty[:, None], np.nan, out)
    return Gridded(start=start, values=out, empty=empty, tainted=tainted)


def _average(
    stamps: NDArray[np.float64],
    values: NDArray[np.float64],
    *,
    sample_time: float,
    start: float,
    marked: NDArray[np.bool_],
) -> Gridded:
    half = 0.5 * float(np.median(np.diff(stamps)))
    count = max(int(np.floor((stamps[-1] + 2.0 * half - start) / sample_time + _FUZZ)), 0)
    interval = np.floor((stamps + half - start) / sample_time + _FUZZ).astype(np.intp)
    inside = (interval >= 0) & (interval < count)
    interval = interval[inside]
    counts = np.bincount(interval, minlength=count)
    empty = counts == 0
    out, tainted = np.full((count, values.shape[1]), np.nan), np.zeros((count, values.shape[1]), dtype=np.bool_)
    for column in range(values.shape[1]):
        sums = np.bincount(interval, weights=values[inside, column], minlength=count)
        tainted[:, column] = np.bincount(interval, weights=marked[inside, column], minlength=count) > 0
        out[~empty, column] = sums[~empty] / counts[~empty]
    return Gridded(start=start, values=out, empty=empty, tainted=tainted)


def fill(gridded: Gridded, method: Literal["linear", "hold"]) -> NDArray[np.float64]:
    """The values with empty grid points filled.

    Args:
        gridded: Samples on a grid; the first grid point is not empty.
        method: ``linear`` between neighbours, or ``hold`` the last value.

    Returns:
        Shape ``(n_grid, n_channels)``, finite.
    """
    known = np.flatnonzero(~gridded.empty)
    filled = gridded.values.copy()
    wanted = np.flatnonzero(gridded.empty)
    if method == "hold":
        filled[wanted] = filled[known[np.searchsorted(known, wanted) - 1]]
        return filled
    for column in range(filled.shape[1]):
        filled[wanted, column] = np.interp(wanted, known, gridded.values[known, column])
    return filled
