"""Whether outputs follow from inputs at the same time alone: a map without memory, as a table or a valve's curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Records = Sequence[tuple[Array, Array]]
"""Of each record the inputs, shape ``(n_samples, n_inputs)``, and the outputs, shape ``(n_samples, n_outputs)``."""

LEFT = 0.1
"""Share of an output's standard deviation up to which what is near in the inputs may leave it unexplained. What settles
within a sample is a map, too; what remembers is far off where an input has just moved. For each input of those that
move, where outputs stand but for their noise wherever inputs do: of more inputs fewer points are near."""
STILL = 1e-9
"""Share of an output's range by which it may move while it stands."""
MOST_OF, MORE = 95.0, 1.5
"""Percentage of the samples at which noise is looked at too, and times of what it moves an output by that are noise."""
MEANT = 75.0
"""Percentage of points that have to be explained so: a few lie at a corner of the map, or where none is near."""
FEWEST, MOST, PARTS = 40, 5_000, 6
"""Points of a half of the records at least and at most, and parts of a single record that take turns."""
CLOSE = 1e-9
"""Weight beside one of what holds the slope of a plane where its points lie on a line."""


def is_static(records: Records) -> bool:
    """Whether planes through what is near in the inputs give every output, at times that are far from each other.

    Each half of the records is explained by the other: local linear regression (Cleveland 1979). Samples at which
    inputs have just moved count alone: there what remembers has yet to follow.

    Args:
        records: The records, without samples that do not count.

    Returns:
        Whether outputs depend on inputs at their time; not where too few points tell.

    Example:
        >>> u = np.random.default_rng(0).uniform(-1.0, 1.0, (400, 2))
        >>> y = np.tanh(u[:, :1] * u[:, 1:])
        >>> is_static([(u, y)]), is_static([(u[1:], y[:-1])])
        (True, False)
    """
    halves = _halves(records)
    u, y = (np.concatenate(parts) if parts else np.empty((0, 0)) for parts in zip(*halves, strict=True))
    if min(len(one) for one, _ in halves) < FEWEST or not (np.ptp(u, axis=0) > 0.0).any():
        return False
    place = np.ptp(u, axis=0) > 0.0
    scaled = [(v[:, place] / np.ptp(u, axis=0)[place], z) for v, z in halves]
    left = np.concatenate([np.abs(z - _planes(*other, v)) for (v, z), other in zip(scaled, scaled[::-1], strict=True)])
    most = LEFT * (int(place.sum()) if _stand(records) else 1)
    return bool((np.percentile(left, MEANT, axis=0) < most * y.std(axis=0)).all())


def _stand(records: Records) -> bool:
    """Whether outputs move no more in the sample after inputs have than later, where inputs stay: by their noise."""
    span = np.ptp(np.concatenate([y for _, y in records]), axis=0)
    after, later = list[Array](), list[Array]()
    for u, y in records:
        moves = (np.diff(u, axis=0) != 0.0).any(axis=1)
        steps = np.abs(np.diff(y, axis=0))[1:]
        after.append(steps[moves[:-1] & ~moves[1:]])
        later.append(steps[~moves[:-1] & ~moves[1:]])
    first, noise = np.concatenate(after), np.concatenate(later)
    if min(len(first), len(noise)) < FEWEST:
        return False
    usual, most = (np.percentile(noise, rank, axis=0) for rank in (MEANT, MOST_OF))
    at = [np.percentile(first, rank, axis=0) for rank in (MEANT, MOST_OF)]
    return bool(((at[0] <= MORE * usual + STILL * span) & (at[1] <= MORE * most + STILL * span)).all())


def _halves(records: Records) -> list[tuple[Array, Array]]:
    """Samples at which an input has just moved, record by record in turn, or part by part of a single one."""
    halves: list[list[tuple[Array, Array]]] = [[], []]
    parts = 1 if len(records) > 1 else PARTS
    for k, (u, y) in enumerate(records):
        for j, rows in enumerate(np.array_split(np.arange(len(u)), parts)):
            moved = rows[1:][(np.diff(u[rows], axis=0) != 0.0).any(axis=1)]
            halves[(k + j) % 2].append((u[moved], y[moved]))
    whole = [tuple(np.concatenate(some) for some in zip(*half, strict=True)) for half in halves if half]
    return [(u[:: -(-len(u) // MOST) or 1], y[:: -(-len(u) // MOST) or 1]) for u, y in whole]


def _planes(points: Array, values: Array, asked: Array) -> Array:
    """At each place that is asked the value of a plane through its nearest points, shape ``(n_asked, n_outputs)``."""
    count = 2 * (points.shape[1] + 1)
    _, near = scipy.spatial.cKDTree(points).query(asked, k=count)
    off = points[near] - asked[:, None]
    rows = np.concatenate([np.ones((*off.shape[:2], 1)), off], axis=2)
    held = CLOSE * np.eye(rows.shape[2])
    held[0, 0] = 0.0
    normal = np.einsum("nki,nkj->nij", rows, rows) + held
    plane = np.linalg.solve(normal, np.einsum("nki,nko->nio", rows, values[near]))
    return np.asarray(plane[:, 0])
