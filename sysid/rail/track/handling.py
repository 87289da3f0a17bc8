"""What to do about a crest or a sag: the handling that the source of the terrain features suggests."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.constants import GRAVITY, KMH
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train
from sysid.rail.track.features import Feature, Severity
from sysid.rail.track.terrain import MEAN, Shape, correlation, effective_grade, quasi_static_forces

SPEED_GAINS = {Severity.LOW: 8.0 * KMH, Severity.MEDIUM: 5.0 * KMH, Severity.HIGH: 3.0 * KMH, Severity.NONE: np.inf}
"""Largest gain of speed in m/s over a crest (the source: predetermined, falling with severity; values ours)."""

SAG_SHARE = 1.0
"""Share of the natural acceleration that the locomotives hold through a sag (the source: preferably near unity)."""


@dataclass(frozen=True, kw_only=True)
class CrestHandling:
    """Over a crest: cut power until at least half of the train is past the apex.

    Args:
        power_allowed: Whether half of the train's mass is past the apex.
        car_at_apex: Number from 1 of the vehicle on the apex; 0 before it, one more than the last behind it.
        mass_before: Mass in kg still on the way up.
        mass_past: Mass in kg on the way down.
    """

    power_allowed: bool
    car_at_apex: int
    mass_before: float
    mass_past: float


def crest_handling(feature: Feature, shape: Shape, x: float) -> CrestHandling:
    """What the source suggests at a crest, and what it shows the driver.

    Args:
        feature: The crest.
        shape: The train.
        x: Of its leading end in m.

    Returns:
        The handling.

    Raises:
        ConfigError: If the feature is not a crest.
    """
    if feature.kind != "crest":
        raise ConfigError("not a crest", where="feature", expected="a crest", got=feature.kind)
    past = shape.mass_ahead(max(0.0, x - feature.apex))
    return CrestHandling(
        power_allowed=past >= 0.5 * shape.mass,
        car_at_apex=int(np.searchsorted(shape.edges, x - feature.apex, side="left")),
        mass_before=shape.mass - past,
        mass_past=past,
    )


def sag_acceleration(track: TrackProfile, shape: Shape, x: float, *, share: float = SAG_SHARE) -> float:
    """Acceleration in m/s2 that the leading locomotives should hold through a sag.

    It is a share of the train's natural acceleration, which is that of the grade under the whole train.

    Args:
        track: The line.
        shape: The train.
        x: Of its leading end in m.
        share: Of the natural acceleration.

    Returns:
        In m/s2.
    """
    return float(-share * GRAVITY * effective_grade(track, shape, np.array([x]))[0])


@dataclass(frozen=True, kw_only=True)
class ForceEstimate:
    """The largest quasi-static coupler force at one place of the train.

    Args:
        force: In N, positive in draft.
        coupler: Number from 1, the one behind vehicle ``coupler``; 0 where a single vehicle has none.
        at: Where the first vehicle is, in m.
    """

    force: float
    coupler: int
    at: float


PASSAGE = 200
"""Places over a feature at which forces are looked at (ours)."""


def passage(feature: Feature, train: Train) -> NDArray[np.float64]:
    """Where the leading end is while a train goes over a feature, until the last vehicle is past the apex.

    With the leading end at the apex all of it may still be on one grade, and nothing pulls; half a train on, it does.

    Args:
        feature: The crest or sag.
        train: The train.

    Returns:
        Positions in m, increasing.
    """
    return np.linspace(feature.start, max(feature.end, feature.apex + train.length), PASSAGE)


def peak_force(track: TrackProfile, train: Train, x: NDArray[np.float64] | float) -> ForceEstimate:
    """The largest coupler force that grades alone make, as the display shows it.

    Args:
        track: The line.
        train: The train.
        x: Of the first vehicle in m, one place or several.

    Returns:
        The estimate, and at which place.
    """
    places = np.atleast_1d(np.asarray(x, dtype=np.float64))
    forces = np.stack([quasi_static_forces(track, train, float(place)) for place in places])
    if not forces.size:
        return ForceEstimate(force=0.0, coupler=0, at=float(places[0]))
    place, coupler = (int(one) for one in np.unravel_index(np.argmax(np.abs(forces)), forces.shape))
    return ForceEstimate(force=float(forces[place, coupler]), coupler=coupler + 1, at=float(places[place]))


CURVED = 1.0 / 1500.0
"""Mean curvature under the train in 1/m from which a feature counts as curved (the source: a threshold; value ours)."""

TREAD_DISTANCE = 1.5
"""Between the circles on which a pair of wheels of standard gauge rolls, in m."""


class Quadrant(enum.Enum):
    """A feature by grade and curvature together; the value is what is said."""

    STRAIGHT_CREST = "crest without curvature"
    CURVED_CREST = "crest with significant curvature"
    STRAIGHT_SAG = "sag without curvature"
    CURVED_SAG = "sag with significant curvature"


def quadrant(feature: Feature, track: TrackProfile, shape: Shape) -> Quadrant:
    """In which quadrant of grade and curvature a feature lies.

    Args:
        feature: The crest or sag.
        track: The line.
        shape: The train, whose leading end is at the apex.

    Returns:
        The quadrant.
    """
    bend = correlation(track, shape, np.array([feature.apex]), pattern=MEAN, values=np.abs(track.curvatures))[0]
    return Quadrant(f"{feature.kind} {'with significant' if bend >= CURVED else 'without'} curvature")


def lateral_ratio(track: TrackProfile, train: Train, x: float, *, speed: float = 0.0) -> NDArray[np.float64]:
    """L/V of each vehicle by the coupler forces that grades make, the curve's acceleration and the cant.

    Two couplers at an angle of ``curvature * length / 2`` each pull a vehicle sideways with the sum of their forces
    times that angle; draft pulls to the inside of the curve, buff pushes outside. No slack, no yaw of the vehicle:
    geometry and statics, where the source gives no equation.

    Args:
        track: The line.
        train: The train.
        x: Of the first vehicle's centre in m.
        speed: In m/s.

    Returns:
        Lateral over vertical force, positive to the inside, shape ``(n,)``.
    """
    forces = np.concatenate([[0.0], quasi_static_forces(track, train, x), [0.0]])
    bend, cant = (of(x - train.offsets) for of in (track.curvature, track.superelevation))
    pulled = (forces[:-1] + forces[1:]) * 0.5 * train.lengths * np.abs(bend)
    carried = train.masses * (GRAVITY * np.abs(cant) / TREAD_DISTANCE - speed**2 * np.abs(bend))
    return np.asarray((pulled + carried) / (train.masses * GRAVITY))


def sub_trains(train: Train) -> tuple[Shape, ...]:
    """The parts of a distributed-power train, one for each group of locomotives.

    The wagons between two groups are shared so that every group has mass in proportion to its locomotives; a node
    never lies inside a group.

    Args:
        train: The train.

    Returns:
        One shape per group, front first; the whole train if there is one group or none.
    """
    groups: list[list[int]] = []
    for index in train.powered:
        if groups and groups[-1][-1] == index - 1:
            groups[-1].append(index)
        else:
            groups.append([index])
    if len(groups) < 2:
        return (Shape.of(train),)
    shares = np.cumsum([len(group) for group in groups]) / sum(len(group) for group in groups)
    masses = np.cumsum(train.masses)
    shapes, first = [], 0
    for k, group in enumerate(groups[:-1]):
        wanted = int(np.searchsorted(masses, shares[k] * train.mass, side="left"))
        last = int(np.clip(wanted, group[-1], groups[k + 1][0] - 1))
        shapes.append(Shape.of(train, first, last))
        first = last + 1
    return (*shapes, Shape.of(train, first))
