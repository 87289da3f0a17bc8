"""Track profile: grade, curvature, superelevation and speed limit over distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from sysid.errors import ConfigError
from sysid.field_checks import check
from sysid.rail.constants import KMH
from sysid.yaml_files import read_yaml

Steps = Sequence[tuple[float, float]]
"""Rows of position in m and the value that holds from there on."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackProfile:
    """Piecewise constant properties of a line; the first segment reaches back, the last one on, without end.

    Args:
        name: Of the line.
        starts: Where each segment begins, in m, increasing, shape ``(k,)``.
        grades: Rise over run, positive uphill in the direction of increasing distance, shape ``(k,)``.
        curvatures: One over the radius in 1/m, from 0 on, shape ``(k,)``.
        superelevations: Of the outer rail in m, shape ``(k,)``.
        speed_limits: In m/s, infinite for none, shape ``(k,)``.

    Raises:
        ConfigError: If the arrays do not fit or a value is impossible.

    Example:
        >>> crest = TrackProfile.from_steps("crest", grade=[(-3000.0, 0.01), (0.0, -0.01)])
        >>> crest.grade(np.array([-1.0, 1.0])).tolist(), float(crest.elevation(-100.0) - crest.elevation(0.0))
        ([0.01, -0.01], -1.0)
    """

    name: str
    starts: NDArray[np.float64]
    grades: NDArray[np.float64]
    curvatures: NDArray[np.float64]
    superelevations: NDArray[np.float64]
    speed_limits: NDArray[np.float64]

    def __post_init__(self) -> None:
        for field in ("starts", "grades", "curvatures", "superelevations", "speed_limits"):
            values = np.array(getattr(self, field), dtype=np.float64)
            values.setflags(write=False)
            object.__setattr__(self, field, values)
            if values.shape != self.starts.shape or values.ndim != 1 or len(values) == 0 or np.isnan(values).any():
                raise self._error(f"{field} do not fit the segments", f"{len(self.starts)} numbers", values.shape)
        if np.any(np.diff(self.starts) <= 0.0) or not np.isfinite(self.starts).all():
            raise self._error("the segments do not follow each other", "increasing positions in m", self.starts)
        if np.abs(self.grades).max() > 0.2:
            steepest = float(self.grades[np.argmax(np.abs(self.grades))])
            raise self._error(
                "a grade is too steep for a railway", "at most 200 per mille", f"{1000.0 * steepest:g} per mille"
            )
        if self.curvatures.min() < 0.0 or self.curvatures.max() > 1.0 / 20.0:
            raise self._error("a curve is not possible", "1/m from 0 to 0.05, a radius of 20 m", self.curvatures)
        if np.abs(self.superelevations).max() > 0.3:
            largest = float(self.superelevations[np.argmax(np.abs(self.superelevations))])
            raise self._error("a cant is not possible", "at most 300 mm", f"{1000.0 * largest:g} mm")
        if self.speed_limits.min() <= 0.0:
            raise self._error("a speed limit is not positive", "m/s above 0", self.speed_limits)

    def _error(self, what: str, expected: str, got: object) -> ConfigError:
        return ConfigError(
            what, where=f"track {self.name}", expected=expected, got=got, remedy="correct the track's rows"
        )

    @classmethod
    def from_steps(
        cls,
        name: str,
        *,
        grade: Steps = ((0.0, 0.0),),
        curvature: Steps = (),
        superelevation: Steps = (),
        speed_limit: Steps = (),
    ) -> TrackProfile:
        """A profile from rows for each property; before its first row a property is 0 (or has no limit).

        Args:
            name: Of the line.
            grade: Positions in m and rise over run.
            curvature: Positions in m and 1/m.
            superelevation: Positions in m and m.
            speed_limit: Positions in m and m/s.

        Returns:
            The profile. The first grade holds before its row too.
        """
        tables = {
            "grades": (grade, grade[0][1] if grade else 0.0),
            "curvatures": (curvature, 0.0),
            "superelevations": (superelevation, 0.0),
            "speed_limits": (speed_limit, np.inf),
        }
        starts = np.unique([float(x) for steps, _ in tables.values() for x, _ in steps] or [0.0])
        # One segment before the first row, for the properties that are 0 there.
        starts = np.concatenate([[starts[0] - 1.0], starts])
        columns = {field: _held(steps, before, starts) for field, (steps, before) in tables.items()}
        return cls(name=name, starts=starts, **columns)

    @classmethod
    def level(cls, name: str = "level") -> TrackProfile:
        """Level straight track without a limit."""
        return cls.from_steps(name)

    @property
    def elevations(self) -> NDArray[np.float64]:
        """Height at the start of each segment in m, 0 at the first, shape ``(k,)``."""
        return np.concatenate([[0.0], np.cumsum(self.grades[:-1] * np.diff(self.starts))])

    def _segment(self, x: NDArray[np.float64] | float) -> NDArray[np.int64]:
        return np.maximum(np.searchsorted(self.starts, x, side="right") - 1, 0)

    def grade(self, x: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Rise over run at positions in m."""
        return self.grades[self._segment(x)]

    def curvature(self, x: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """1/m at positions in m."""
        return self.curvatures[self._segment(x)]

    def superelevation(self, x: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Superelevation in m at positions in m."""
        return self.superelevations[self._segment(x)]

    def speed_limit(self, x: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Limit in m/s at positions in m."""
        return self.speed_limits[self._segment(x)]

    def elevation(self, x: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Height in m at positions in m: the integral of the grade."""
        segment = self._segment(x)
        return np.asarray(self.elevations[segment] + self.grades[segment] * (np.asarray(x) - self.starts[segment]))

    def integral(self, values: NDArray[np.float64], x: NDArray[np.float64] | float) -> NDArray[np.float64]:
        """Integral of a piecewise constant property from the first segment's start to positions in m.

        Args:
            values: One per segment, such as ``curvatures``.
            x: Positions in m.

        Returns:
            The integral, in the property's unit times m.
        """
        at_start = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(self.starts))])
        segment = self._segment(x)
        return np.asarray(at_start[segment] + values[segment] * (np.asarray(x) - self.starts[segment]))

    def lowest_limit(self, start: float, stop: float) -> float:
        """The lowest limit in m/s between two positions in m."""
        first, last = (int(self._segment(x)) for x in (start, stop))
        return float(self.speed_limits[first : last + 1].min())


def _held(steps: Steps, before: float, starts: NDArray[np.float64]) -> NDArray[np.float64]:
    if not steps:
        return np.full(len(starts), before)
    positions = np.array([x for x, _ in steps], dtype=np.float64)
    if np.any(np.diff(positions) <= 0.0):
        raise ConfigError(
            "the rows of the track are not in order",
            where="track",
            expected="increasing positions in m",
            got=positions.tolist(),
            remedy="sort the rows by position, each position once",
        )
    values = np.array([before, *(value for _, value in steps)], dtype=np.float64)
    return values[np.searchsorted(positions, starts, side="right")]


STRAIGHT = 99_999.0
"""Radius in m that a track file writes for straight track (source of the track card)."""

SHORTEST_LINE = 10.0
"""In m: posts that lie closer together are read as kilometres, and refused."""

Row = tuple[Annotated[float, Field(allow_inf_nan=False)], Annotated[float, Field(allow_inf_nan=False)]]


class _TrackFile(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    name: str
    description: str = ""
    grade: tuple[Row, ...] = ()
    curve: tuple[Row, ...] = ()
    superelevation: tuple[Row, ...] = ()
    speed_limit: tuple[Row, ...] = ()


def read_track(path: Path) -> TrackProfile:
    """Read a track from YAML.

    Args:
        path: A file with rows ``[position in m, value]`` under ``grade`` (per mille), ``curve`` (radius in m, 99999
            for straight), ``superelevation`` (mm) and ``speed_limit`` (km/h).

    Returns:
        The profile.

    Raises:
        ConfigError: If the file cannot be read or a value cannot be used.
    """
    file = check(_TrackFile, read_yaml(path), where=path)
    posts = sorted({x for rows in (file.grade, file.curve, file.superelevation, file.speed_limit) for x, _ in rows})
    if len(posts) > 1 and posts[-1] - posts[0] < SHORTEST_LINE:
        raise ConfigError(
            "the line is no longer than a wagon", where=path, expected="positions in m",
            got=f"posts from {posts[0]:g} to {posts[-1]:g}", remedy="write kilometres times 1000",
        )  # fmt: skip
    for position, radius in file.curve:
        if radius < 20.0:
            raise ConfigError(
                "a curve has no radius",
                where=f"{path}, curve at {position:g} m",
                expected="a radius in m, from 20 on; 99999 for straight track",
                got=radius,
                remedy="correct the row",
            )
    return TrackProfile.from_steps(
        file.name,
        grade=[(x, value / 1000.0) for x, value in file.grade] or ((0.0, 0.0),),
        curvature=[(x, 0.0 if radius >= STRAIGHT else 1.0 / radius) for x, radius in file.curve],
        superelevation=[(x, value / 1000.0) for x, value in file.superelevation],
        speed_limit=[(x, value * KMH) for x, value in file.speed_limit],
    )
