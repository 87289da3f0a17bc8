"""Choosing a notch: predict what each would do, judge the outcome and the comfort of the change, take the best.

After "A train operation control apparatus" (figure 4). Where the source only draws a curve, the numbers are ours.
"""

from __future__ import annotations

import bisect
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.constants import GRAVITY, KMH
from sysid.rail.dynamics.motion import CURVE_RESISTANCE
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train
from sysid.rail.dynamics.vehicle import NotchCurves


def predicted_speed(speed: float, notch: float, grade: float, curve: float, horizon: float) -> float:
    """Speed after a time under a notch: ``V0 + (alpha_N + alpha_G + alpha_C) T``.

    Args:
        speed: Now, in m/s.
        notch: Acceleration by the notch in m/s2.
        grade: Acceleration by the grade in m/s2 (a descent is positive).
        curve: Acceleration by the curve in m/s2 (negative).
        horizon: In s.

    Returns:
        In m/s.

    Example:
        >>> predicted_speed(10.0, 0.5, 0.2, -0.1, 2.0)
        11.2
    """
    return speed + (notch + grade + curve) * horizon


@dataclass(frozen=True, kw_only=True)
class Closeness:
    """Evaluation ES of a difference between what a notch leads to and the target.

    1 within ``band`` of 0, then falling linearly to 0; the fall is steeper above the target than below it.

    Args:
        band: Half width of the flat top.
        above: Width of the fall for positive differences.
        below: Width of the fall for negative differences, larger.

    Raises:
        ConfigError: If a width is not positive or the fall is not steeper above.

    Example:
        >>> es = Closeness(band=0.2, above=1.0, below=4.0)
        >>> [es(d) for d in (-4.2, -2.2, 0.1, 0.7, 1.2)]
        [0.0, 0.5, 1.0, 0.5, 0.0]
    """

    band: float
    above: float
    below: float

    def __post_init__(self) -> None:
        if not (self.band >= 0.0 and 0.0 < self.above <= self.below):
            raise ConfigError(
                "not an evaluation of closeness",
                where="closeness",
                expected="band from 0 on, 0 < above <= below",
                got=(self.band, self.above, self.below),
            )

    def __call__(self, difference: float) -> float:
        """The evaluation, 0 to 1, of a difference in m/s or m."""
        beyond = abs(difference) - self.band
        width = self.above if difference > 0.0 else self.below
        return float(np.clip(1.0 - max(beyond, 0.0) / width, 0.0, 1.0))


@dataclass(frozen=True, kw_only=True)
class Calm:
    """Evaluation ENC of the comfort of a change: it rises to 1 at t1 < t2 < t3 for changes by 1, 2, 3 and more notches.

    Args:
        times: t1, t2, t3 in s since the last change.

    Raises:
        ConfigError: If they do not rise.

    Example:
        >>> enc = Calm(times=(2.0, 4.0, 6.0))
        >>> enc(1.0, 0), enc(1.0, 1), enc(1.0, 2), enc(9.0, 5)
        (1.0, 0.5, 0.25, 1.0)
    """

    times: tuple[float, float, float] = (2.0, 4.0, 6.0)

    def __post_init__(self) -> None:
        t1, t2, t3 = self.times
        if not 0.0 < t1 < t2 < t3:
            raise ConfigError("not times of calm", where="calm", expected="0 < t1 < t2 < t3", got=self.times)

    def __call__(self, since_change: float, difference: int) -> float:
        """The evaluation, 0 to 1, of a change by so many notches, so many seconds after the last."""
        if difference == 0:
            return 1.0
        return min(1.0, since_change / self.times[min(abs(difference), 3) - 1])


@dataclass(frozen=True, kw_only=True, eq=False)
class Verdict:
    """Evaluation of every notch.

    Args:
        notches: From the deepest brake up.
        outcome: ES of each.
        comfort: ENC of each.
        chosen: The notch with the largest of ``min(ES, ENC)``; of equals the nearest to the present, then the lower.
    """

    notches: tuple[int, ...]
    outcome: NDArray[np.float64]
    comfort: NDArray[np.float64]
    chosen: int

    @property
    def total(self) -> NDArray[np.float64]:
        """ET, the smaller of the two."""
        return np.minimum(self.outcome, self.comfort)


def choose(
    notches: tuple[int, ...], outcome: NDArray[np.float64], *, present: int, since_change: float, calm: Calm
) -> Verdict:
    """Judge all notches and choose one.

    Args:
        notches: From the deepest brake up.
        outcome: ES of each.
        present: The notch that is set.
        since_change: Seconds since it was set.
        calm: ENC.

    Returns:
        The verdict.

    Example:
        >>> choose((-1, 0, 1), np.array([0.0, 0.4, 1.0]), present=0, since_change=1.0, calm=Calm()).chosen
        1
    """
    comfort = np.array([calm(since_change, notch - present) for notch in notches])
    total = np.minimum(outcome, comfort)
    best = [notch for notch, value in zip(notches, total, strict=True) if value >= total.max() - 1e-12]
    chosen = min(best, key=lambda notch: (abs(notch - present), notch))
    return Verdict(notches=notches, outcome=outcome, comfort=comfort, chosen=chosen)


class Predictor:
    """What a notch does to a train, as its driver knows it: a point mass on the grade under the train's middle.

    Args:
        train: The train.

    Raises:
        ConfigError: If it has no notches.
    """

    def __init__(self, train: Train) -> None:
        curves = [vehicle.notches for vehicle in train.vehicles if vehicle.notches is not None]
        if not curves:
            raise ConfigError("the train has no notches", where=f"train {train.name}", expected="a powered vehicle")
        self.train = train
        self.notches = tuple(range(max(c.lowest for c in curves), min(c.highest for c in curves) + 1))
        self._step = 0.1
        speeds = self._step * np.arange(600, dtype=np.float64)
        drag = np.array([sum(v.davis.force(float(speed)) for v in train.vehicles) for speed in speeds])
        self._rates = {
            notch: ((np.sum([_forces(c, notch, speeds) for c in curves], axis=0) - drag) / train.mass).tolist()
            for notch in self.notches
        }

    def by_notch(self, notch: int, speed: float) -> float:
        """Acceleration by a notch and the running resistance in m/s2."""
        rates, place = self._rates[notch], abs(speed) / self._step
        index = min(int(place), len(rates) - 2)
        low, high = rates[index], rates[index + 1]
        return float(low + min(place - index, 1.0) * (high - low))

    def by_track(self, track: TrackProfile, position: float) -> tuple[float, float]:
        """Accelerations by grade and by curve in m/s2, for the first vehicle at a position in m."""
        middle = position - 0.5 * self.train.length
        segment = max(bisect.bisect_right(track.starts, middle) - 1, 0)
        return -GRAVITY * float(track.grades[segment]), -CURVE_RESISTANCE * float(track.curvatures[segment])

    def stop_position(
        self,
        track: TrackProfile,
        position: float,
        speed: float,
        notch: int,
        *,
        extra: float = 0.0,
        until: float = np.inf,
    ) -> float:
        """Where the train would stop if a notch were held.

        Args:
            track: As known.
            position: Of the first vehicle in m.
            speed: In m/s.
            notch: Held all the way.
            extra: Acceleration in m/s2 to add: what the train was seen to do beside the prediction.
            until: A position in m beyond which it does not matter any more.

        Returns:
            In m; infinite if it would not stop before ``until`` or within ten minutes.
        """
        x, v, step = position, speed, 0.25
        for _ in range(2400):
            grade, curve = self.by_track(track, x)
            rate = self.by_notch(notch, v) + grade + curve + extra
            ending = v + rate * step
            if ending <= 0.0:
                return x + v * v / (-2.0 * rate) if v > 0.0 else x
            x, v = x + 0.5 * (v + ending) * step, ending
            if x > until:
                break
        return float("inf")


def _forces(curves: NotchCurves, notch: int, speeds: NDArray[np.float64]) -> NDArray[np.float64]:
    row = curves.table()[notch - curves.lowest]
    return np.asarray(np.interp(speeds, curves.speed_step * np.arange(len(row)), row), dtype=np.float64)


def true_acceleration(measured: float, grade: float, curve: float) -> float:
    """Acceleration by motors or brakes alone: what was measured less what grade and curve do, in m/s2.

    Example:
        >>> round(true_acceleration(0.3, 0.2, -0.05), 3)
        0.15
    """
    return measured - grade - curve


CALM = Calm()
"""ENC (ours)."""

SPEED_CLOSENESS = Closeness(band=0.5 * KMH, above=4.0 * KMH, below=16.0 * KMH)
"""ES of a difference of speed (ours)."""

POSITION_CLOSENESS = Closeness(band=0.3, above=15.0, below=40.0)
"""ES of a difference of stop position in m (ours)."""
