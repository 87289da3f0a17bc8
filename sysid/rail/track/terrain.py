r"""Terrain as a train feels it: correlation of a track profile with patterns over the length of the train.

After "track features and train handling" (US 9,120,493). Its equations are missing from the text that we have; the
only pattern that fits its worked example (two opposite grades y, each longer than the train: 0, then linearly up to y
when the leading locomotive is at the apex, then linearly back to 0 one train length later) is +1 behind and -1 ahead
of the leading locomotive, over one train length L each:

.. math:: C(x) = \frac{1}{2L} \int_{-L}^{L} g(x + s + \delta)\, p(s)\, w(s)\, ds,

half the mean grade behind less half the mean grade ahead. Grades and correlations are rise over run; a crest is
positive, a sag negative. The profile is piecewise constant, so that the integral is an exact sum of rises.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.constants import GRAVITY
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape:
    """How length and weight lie behind the leading end of a train, a sub-train or a single car.

    Args:
        lengths: Of each vehicle in m, front first, shape ``(n,)``.
        masses: Of each vehicle in kg, shape ``(n,)``.
        offset: How far its leading end lies behind the leading end of the whole train, in m.

    Raises:
        ConfigError: If they are not the lengths and masses of vehicles.

    Example:
        >>> uniform(1000.0).weights.tolist()
        [1.0]
    """

    lengths: NDArray[np.float64]
    masses: NDArray[np.float64]
    offset: float = 0.0

    def __post_init__(self) -> None:
        lengths, masses = (np.array(v, dtype=np.float64) for v in (self.lengths, self.masses))
        fits = lengths.ndim == 1 and lengths.shape == masses.shape and len(lengths) > 0
        if not fits or not all(0.0 < value < np.inf for value in (*lengths, *masses)):
            raise ConfigError(
                "not the shape of a train",
                where="shape",
                expected="a length in m and a mass in kg, both above 0, for each vehicle",
                got=f"shapes {lengths.shape} and {masses.shape}",
            )
        object.__setattr__(self, "lengths", lengths)
        object.__setattr__(self, "masses", masses)

    @classmethod
    def of(cls, train: Train, first: int = 0, last: int | None = None) -> Shape:
        """The shape of a train, or of its vehicles ``first`` to ``last`` (indices from 0, the last included)."""
        stop = len(train.vehicles) if last is None else last + 1
        return cls(
            lengths=train.lengths[first:stop],
            masses=train.masses[first:stop],
            offset=float(train.lengths[:first].sum()),
        )

    @property
    def length(self) -> float:
        """In m."""
        return float(self.lengths.sum())

    @property
    def mass(self) -> float:
        """In kg."""
        return float(self.masses.sum())

    @property
    def edges(self) -> NDArray[np.float64]:
        """Ends of the vehicles behind the leading end in m, from 0 to the length, shape ``(n + 1,)``."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    @property
    def weights(self) -> NDArray[np.float64]:
        """Load density of each vehicle over the mean one, shape ``(n,)``; its mean over the length is 1."""
        return np.asarray(self.masses / self.lengths * (self.length / self.mass))

    def mass_ahead(self, distance: float) -> float:
        """Mass in kg of what lies less than ``distance`` m behind the leading end."""
        return float(np.interp(distance, self.edges, np.concatenate([[0.0], np.cumsum(self.masses)])))


def uniform(length: float, mass: float = 1.0) -> Shape:
    """A train whose weight is spread evenly.

    Args:
        length: In m.
        mass: In kg.

    Returns:
        The shape.
    """
    return Shape(lengths=np.array([length]), masses=np.array([mass]))


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """A piecewise constant pattern, in train lengths ahead of the leading end (negative: behind it).

    Args:
        name: For people.
        edges: Increasing, one more than values.
        values: Between them. The correlation is divided by the integral of their sizes.

    Raises:
        ConfigError: If the two do not fit.
    """

    name: str
    edges: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        good = len(self.edges) == len(self.values) + 1 and bool(np.all(np.diff(self.edges) > 0.0))
        if not good or not np.isfinite([*self.edges, *self.values]).all() or not any(self.values):
            raise ConfigError(
                "not a pattern",
                where=f"pattern {self.name}",
                expected="increasing edges, one more than values, and a value that is not 0",
                got=f"{self.edges} and {self.values}",
            )

    @property
    def size(self) -> float:
        """Integral of the values' sizes, in train lengths."""
        return float(np.abs(self.values) @ np.diff(self.edges))

    def inverted(self, name: str) -> Pattern:
        """The opposite pattern: a sag is the inverse of a crest."""
        return Pattern(name=name, edges=self.edges, values=tuple(-value for value in self.values))


def _tapered(pieces: int) -> Pattern:
    edges = np.linspace(-1.0, 1.0, 2 * pieces + 1)
    middles = 0.5 * (edges[:-1] + edges[1:])
    return Pattern(
        name="tapered crest",
        edges=tuple(edges.tolist()),
        values=tuple(np.where(middles < 0.0, 1.0 + middles, middles - 1.0).tolist()),
    )


CREST = Pattern(name="crest", edges=(-1.0, 0.0, 1.0), values=(1.0, -1.0))
"""The pattern of the worked example."""
SAG = CREST.inverted("sag")
"""A sag is the inverse of a crest."""
SHORT_CREST = Pattern(name="short crest", edges=(-0.5, 0.0, 0.5), values=(1.0, -1.0))
"""Half a train length each way (ours): terrain that half a train is draped over."""
TAPERED_CREST = _tapered(8)
"""Falling from the leading end outwards (ours)."""
PATTERNS = (CREST, SHORT_CREST, TAPERED_CREST)
"""The candidates for a crest or sag, several of which may be combined."""
MEAN = Pattern(name="mean", edges=(-1.0, 0.0), values=(1.0,))
"""What lies under the train: for curvature and superelevation."""


def correlation(
    track: TrackProfile,
    shape: Shape,
    x: NDArray[np.float64],
    *,
    pattern: Pattern = CREST,
    look_ahead: float = 0.0,
    weighted: bool = True,
    values: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Correlation of the track with a pattern, for the leading end of the whole train at ``x``.

    The weights belong to the track under the train; ahead of it, where nothing stands yet, they are 1 (ours). They
    keep the balance of the pattern (ours): a constant grade is neither a crest nor a sag, whatever the loading.

    Args:
        track: The line. It goes on with its last values, so that one train length beyond what is read is enough.
        shape: The train, or a part of it.
        x: Positions in m, any shape.
        pattern: What to look for.
        look_ahead: How far ahead in m (delta).
        weighted: Whether the weight distribution counts.
        values: A property of the track's segments in place of its grades, such as ``track.curvatures``.

    Returns:
        The correlation in the property's unit, same shape as ``x``.

    Example:
        >>> crest = TrackProfile.from_steps("crest", grade=[(-5000.0, 0.01), (0.0, -0.01)])
        >>> correlation(crest, uniform(1000.0), np.array([-750.0, -500.0, 0.0, 500.0])).round(6).tolist()
        [0.0025, 0.005, 0.01, 0.005]
    """
    behind = -shape.edges[::-1]
    cuts = np.unique(np.concatenate([np.array(pattern.edges) * shape.length, behind]))
    cuts = cuts[(cuts >= pattern.edges[0] * shape.length) & (cuts <= pattern.edges[-1] * shape.length)]
    middles = 0.5 * (cuts[:-1] + cuts[1:])
    heights = np.array(pattern.values)[np.searchsorted(pattern.edges, middles / shape.length, side="right") - 1]
    if weighted:
        under = (middles < 0.0) & (middles > behind[0])
        place = np.clip(np.searchsorted(behind, middles, side="right") - 1, 0, len(shape.weights) - 1)
        heights = _weighted(heights, np.where(under, shape.weights[::-1][place], 1.0), np.diff(cuts), under)
    at = np.asarray(x, dtype=np.float64)[..., None] - shape.offset + look_ahead + cuts
    rises = np.diff(track.integral(track.grades if values is None else values, at), axis=-1)
    return np.asarray(rises @ heights / (pattern.size * shape.length))


def _weighted(
    heights: NDArray[np.float64], weights: NDArray[np.float64], widths: NDArray[np.float64], under: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """A pattern by the weight that stands on it, with as much above and below zero as it had without.

    A pattern that ends or tapers within the train meets weights whose mean is not 1: left so, a constant grade under
    a train that is not loaded evenly would be a crest or a sag.
    """
    weighted = heights * weights
    for part in (under & (heights > 0.0), under & (heights < 0.0)):
        if part.any():
            weighted[part] *= (heights[part] @ widths[part]) / (weighted[part] @ widths[part])
    return weighted


COMBINATIONS: dict[str, Callable[..., NDArray[np.float64]]] = {
    "max": np.max,
    "min": np.min,
    "median": np.median,
    "mean": np.mean,
}
"""How several patterns make one correlation."""


def combined(correlations: Sequence[NDArray[np.float64]], how: str) -> NDArray[np.float64]:
    """Several patterns' correlations as one.

    Args:
        correlations: One per pattern, of the same shape.
        how: ``max``, ``min``, ``median`` or ``mean``.

    Returns:
        The controlling correlation at each position.

    Raises:
        ConfigError: If the combination is unknown.

    Example:
        >>> combined([np.array([1.0]), np.array([2.0]), np.array([6.0])], "median").tolist()
        [2.0]
    """
    if how not in COMBINATIONS:
        raise ConfigError.unknown(
            "unknown combination of patterns", how, COMBINATIONS, "choose one of these", where="how"
        )
    return np.asarray(COMBINATIONS[how](np.stack(correlations), axis=0))


def effective_grade(
    track: TrackProfile, shape: Shape, x: NDArray[np.float64], *, weighted: bool = True
) -> NDArray[np.float64]:
    """The grade that the whole train feels: the mean under it, by weight.

    Args:
        track: The line.
        shape: The train.
        x: Positions of its leading end in m.
        weighted: Whether the weight distribution counts.

    Returns:
        Rise over run.
    """
    return correlation(track, shape, x, pattern=MEAN, weighted=weighted)


def equivalent_grade_change(correlations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Change of the mean grade over the next train length, from a correlation with the crest pattern: -2 C."""
    return -2.0 * correlations


CURVATURE_SCALE, SUPERELEVATION_SCALE, SPEED_SCALE = 1.0 / 300.0, 0.1, 10.0
"""Curvature in 1/m, superelevation in m and speed in m/s at which each counts 1 in the risk (ours)."""


def stringlining_risk(
    track: TrackProfile, shape: Shape, x: NDArray[np.float64], speed: NDArray[np.float64] | float
) -> NDArray[np.float64]:
    """Risk of stringlining or jackknifing: distance from tangent track, over the speed.

    The source says that it grows with the distance from zero correlation in curvature and superelevation and inversely
    with speed; its equation is missing.

    Args:
        track: The line.
        shape: The train.
        x: Positions in m.
        speed: In m/s, above 0.

    Returns:
        A pure number, 0 on tangent track.

    Raises:
        ConfigError: If the speed is not above 0.
    """
    if not np.all(np.asarray(speed) > 0.0):
        raise ConfigError("a train at rest has no such risk", where="speed", expected="m/s above 0", got=speed)
    bend = correlation(track, shape, x, pattern=MEAN, values=track.curvatures) / CURVATURE_SCALE
    tilt = correlation(track, shape, x, pattern=MEAN, values=track.superelevations) / SUPERELEVATION_SCALE
    return np.asarray(np.hypot(bend, tilt) * SPEED_SCALE / np.asarray(speed))


def quasi_static_forces(
    track: TrackProfile, train: Train, x: float, *, pulls: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Coupler forces of a train whose vehicles all accelerate alike: grades and pulls, no slack, no resistance.

    Args:
        track: The line.
        train: The train.
        x: Of the first vehicle's centre in m.
        pulls: Force of each vehicle's traction or brake in N, shape ``(n,)``; none if not given.

    Returns:
        Force behind each vehicle but the last in N, positive in draft, shape ``(n - 1,)``.
    """
    outside = -train.masses * GRAVITY * track.grade(x - train.offsets)
    outside = outside + (0.0 if pulls is None else pulls)
    common = outside.sum() / train.mass
    return np.asarray(np.cumsum(outside - train.masses * common)[:-1])
