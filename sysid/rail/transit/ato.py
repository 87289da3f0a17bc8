"""Automatic train operation: constant speed and automatic stop, by the track card, the lower notch winning.

After "A train operation control apparatus", with the conventional full-notch driver beside it for comparison.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sysid.airbrake.settings import check_numbers
from sysid.rail.constants import KMH
from sysid.rail.dynamics.drive import AbstractDriver, Controls, Observation
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train
from sysid.rail.track.card import CardReader, TrackCard
from sysid.rail.transit.notch import (
    CALM,
    POSITION_CLOSENESS,
    SPEED_CLOSENESS,
    Calm,
    Closeness,
    Predictor,
    choose,
    predicted_speed,
    true_acceleration,
)


@dataclass(frozen=True, kw_only=True)
class AtoSettings:
    """Numbers that the source leaves open; all are ours.

    Args:
        margin: Target speed below the limit in m/s (the source: several kilometres per hour).
        horizon: Time T of the speed prediction in s.
        offset: How far the card is read ahead in m.
        planned: Deceleration in m/s2 with which a lower limit ahead is approached.
        stop_notch: Share of the deepest braking notch that the automatic stop plans with.
        speed: ES of speed differences.
        position: ES of stop position differences.
        calm: ENC.
        memory: Time constant in s with which the prediction learns from the measured acceleration.

    Raises:
        ConfigError: If a number is not finite or not above 0; margin and offset may be 0.
    """

    margin: float = 3.0 * KMH
    horizon: float = 8.0
    offset: float = 400.0
    planned: float = 0.5
    stop_notch: float = 0.75
    speed: Closeness = SPEED_CLOSENESS
    position: Closeness = POSITION_CLOSENESS
    calm: Calm = CALM
    memory: float = 3.0

    def __post_init__(self) -> None:
        check_numbers(self, "the settings of an automatic operation", from_zero=("margin", "offset"))


def target_speed(track: TrackProfile, position: float, *, margin: float, planned: float, length: float) -> float:
    """Speed in m/s that a train may have: the limits under it less the margin, and those ahead by a braking curve.

    Args:
        track: As known.
        position: Of the first vehicle in m.
        margin: In m/s.
        planned: Deceleration of the braking curve in m/s2.
        length: Of the train in m: a limit holds until the last vehicle has left it.

    Returns:
        In m/s.
    """
    here = track.lowest_limit(position - length, position) - margin
    ahead = track.starts > position
    if not ahead.any():
        return here
    limits, gaps = track.speed_limits[ahead] - margin, track.starts[ahead] - position
    with np.errstate(invalid="ignore"):
        allowed = np.sqrt(limits**2 + 2.0 * planned * gaps)
    return float(min(here, allowed.min()))


class CardDriver(AbstractDriver):
    """The operation of the source: card, prediction, evaluation, selection.

    Args:
        train: What it drives.
        card: The track card.
        section: Where it departs from.
        stop: Where the first vehicle shall stop, in m from the section's station.
        point: Where the signal of the deceleration starting point stands, in m; the automatic stop works from there.
        settings: Numbers.

    Raises:
        ConfigError: If the card lacks the section or the train has no notches.
    """

    def __init__(
        self,
        *,
        train: Train,
        card: TrackCard,
        section: str,
        stop: float,
        point: float,
        settings: AtoSettings | None = None,
    ) -> None:
        self.settings = settings or AtoSettings()
        self.reader = CardReader(card, section, offset=self.settings.offset)
        self.predictor, self.stop, self.point = Predictor(train), stop, point
        self.notch, self._since, self._bias = 0, math.inf, 0.0
        self._last_time = 0.0

    def act(self, seen: Observation, most: int) -> Controls:  # noqa: ARG002 - one sample at a time
        """One notch for one sample."""
        elapsed = seen.time - self._last_time
        self._last_time = seen.time
        self._since += elapsed
        self.reader.read(seen.position)
        self._learn(seen, elapsed)
        wanted = self._constant_speed(seen)
        if seen.position >= self.point:
            wanted = min(wanted, self._automatic_stop(seen))
        if wanted != self.notch:
            self.notch, self._since = wanted, 0.0
        return Controls.single(notch=self.notch)

    def _learn(self, seen: Observation, elapsed: float) -> None:
        """What the notch truly does, less what it was predicted to do."""
        if elapsed <= 0.0 or self._since < 0.5:
            return  # The acceleration measured last still belongs to the notch before.
        grade, curve = self.predictor.by_track(self.reader.profile, seen.position)
        surplus = true_acceleration(seen.acceleration, grade, curve) - self.predictor.by_notch(self.notch, seen.speed)
        share = min(1.0, elapsed / self.settings.memory)
        self._bias += share * (float(np.clip(surplus, -0.2, 0.2)) - self._bias)

    def _constant_speed(self, seen: Observation) -> int:
        options, track, s = self.predictor.notches, self.reader.profile, self.settings
        way = seen.speed * s.horizon
        grades = [self.predictor.by_track(track, seen.position + share * way) for share in (0.0, 0.5, 1.0)]
        grade, curve = (float(np.mean(column)) for column in zip(*grades, strict=True))
        length = self.predictor.train.length
        target = target_speed(track, seen.position + way, margin=s.margin, planned=s.planned, length=length + way)
        outcome = [
            s.speed(
                predicted_speed(
                    seen.speed, self.predictor.by_notch(notch, seen.speed) + self._bias, grade, curve, s.horizon
                )
                - target
            )
            for notch in options
        ]
        return self._chosen(options, np.array(outcome), higher_if_lost=seen.speed < target)

    def _automatic_stop(self, seen: Observation) -> int:
        options, s = self.predictor.notches, self.settings
        planned = round(s.stop_notch * options[0])
        reaches = self._stop_position(seen, planned)
        if reaches < self.stop - s.position.band and self.notch >= 0:
            return options[-1]  # Braking can wait: the notch of the constant speed wins.
        braking = tuple(notch for notch in options if notch <= 0)
        outcome = [s.position(self._stop_position(seen, notch) - self.stop) for notch in braking]
        return self._chosen(braking, np.array(outcome), higher_if_lost=reaches < self.stop)

    def _stop_position(self, seen: Observation, notch: int) -> float:
        return self.predictor.stop_position(
            self.reader.profile, seen.position, seen.speed, notch, extra=self._bias, until=self.stop + 100.0
        )

    def _chosen(self, options: tuple[int, ...], outcome: np.ndarray, *, higher_if_lost: bool) -> int:
        if outcome.max() <= 0.0:
            # No notch comes near the target: take the end of the scale that goes towards it.
            outcome = np.zeros(len(options))
            outcome[-1 if higher_if_lost else 0] = 1.0
        present = int(np.clip(self.notch, options[0], options[-1]))
        return choose(options, outcome, present=present, since_change=self._since, calm=self.settings.calm).chosen


class FullNotchDriver(AbstractDriver):
    """The conventional operation that the source compares with: full notch up to the target, then brake above it.

    It does not know the track. A lower limit is seen when it is passed; the stop follows a pattern of a
    deceleration that suffices on the steepest descent, from the point signal on.

    Args:
        train: What it drives.
        limits: The line, of which it sees the limit under the train only.
        stop: Where to stop in m.
        point: Where the stopping pattern begins in m.
        margin: Target speed below the limit in m/s.
        hysteresis: Speed in m/s below the target at which the full notch comes back (ours).
        calm_time: Smallest time in s between two changes (ours).
    """

    def __init__(
        self,
        *,
        train: Train,
        limits: TrackProfile,
        stop: float,
        point: float,
        margin: float = 3.0 * KMH,
        hysteresis: float = 2.0 * KMH,
        calm_time: float = 1.0,
    ) -> None:
        self.predictor, self.limits, self.stop, self.point = Predictor(train), limits, stop, point
        self.margin, self.hysteresis, self.calm_time = margin, hysteresis, calm_time
        self.notch, self._changed = 0, -math.inf
        self._pattern: float | None = None

    def act(self, seen: Observation, most: int) -> Controls:  # noqa: ARG002 - one sample at a time
        """One notch for one sample."""
        options = self.predictor.notches
        target = self._target(seen)
        if seen.speed > target + 0.25 * self.hysteresis:
            wanted = options[0] if seen.speed > target + self.hysteresis else round(0.5 * options[0])
        elif seen.speed > target - self.hysteresis:
            wanted = self.notch if self.notch > 0 and seen.speed < target else 0
        else:
            wanted = options[-1] if self._pattern is None else 0
        if wanted != self.notch and seen.time - self._changed >= self.calm_time:
            self.notch, self._changed = wanted, seen.time
        return Controls.single(notch=self.notch)

    def _target(self, seen: Observation) -> float:
        length = self.predictor.train.length
        target = self.limits.lowest_limit(seen.position - length, seen.position) - self.margin
        if seen.position >= self.point:
            gap = self.stop - seen.position
            if self._pattern is None:
                self._pattern = seen.speed**2 / (2.0 * max(gap, 1.0))
            target = min(target, math.sqrt(2.0 * self._pattern * max(gap, 0.0)))
        return target
