"""Drive cycles: what a driver does with the brake handle on a hilly line, for training and for choosing models on.

A freight driver holds a descent by cycles: a small reduction, deeper if the train still gains speed, a release once it
has lost enough, and time for the train to recharge before the next. Direct-release brakes cannot be let off in part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.command import Command
from sysid.airbrake.consist import Consist
from sysid.airbrake.settings import check_numbers
from sysid.airbrake.variant import USUAL, Variant
from sysid.errors import ConfigError
from sysid.rail.constants import KMH
from sysid.rail.dynamics.brake import ReferenceBrake
from sysid.rail.dynamics.drive import AbstractDriver, Controls, Limits, Observation, Run, drive
from sysid.rail.dynamics.motion import MovingTrain
from sysid.rail.dynamics.track import STRAIGHT, TrackProfile
from sysid.rail.dynamics.train import Train
from sysid.rail.track.card import CardCode, CardRow, TrackCard
from sysid.rail.transit.ato import AtoSettings, CardDriver


@dataclass(frozen=True, kw_only=True)
class HabitSettings:
    """A driver's habits; all ours but the first reduction, which is the dissertation's minimum application.

    Args:
        target: Speed in m/s to hold.
        band: Speed in m/s above the target that calls for the brake, and below it that lets it off.
        running: Released handle in psi gauge.
        first: First reduction in psi.
        deepening: Further reductions in psi.
        deepest: Full service reduction in psi.
        patience: Time in s between an application and a deeper one.
        recharge: Shortest time in s between a release and the next application.
    """

    target: float = 50.0 * KMH
    band: float = 4.0 * KMH
    running: float = 90.0
    first: float = 5.8
    deepening: float = 4.0
    deepest: float = 25.8
    patience: float = 20.0
    recharge: float = 60.0

    def __post_init__(self) -> None:
        check_numbers(self, "the habits of a driver", from_zero=("recharge",))
        if not (self.first <= self.deepest < self.running and self.band < self.target):
            raise ConfigError(
                "not the habits of a driver", where="habits", got=self,
                expected="first at most deepest, deepest below running, band below target",
            )  # fmt: skip


class CycleBrakingDriver(AbstractDriver):
    """Holds a speed by notches uphill and by cycles of the air brake downhill.

    Args:
        settings: Habits.
        highest: The highest notch.
        seed: Makes the driver's steps differ a little from each other, as a hand's do.
    """

    def __init__(self, *, settings: HabitSettings | None = None, highest: int = 8, seed: int = 0) -> None:
        self.settings = settings or HabitSettings()
        self._highest, self._rng = highest, np.random.default_rng(seed)
        self._reduction, self._changed, self._released, self._notch = 0.0, -np.inf, -np.inf, 0

    def act(self, seen: Observation, most: int) -> Controls:  # noqa: ARG002 - one sample at a time
        """Notch and handle for one sample."""
        s = self.settings
        excess = seen.speed - s.target
        if self._reduction == 0.0:
            if excess > s.band and seen.acceleration > 0.0 and seen.time - self._released >= s.recharge:
                self._reduce(seen.time, s.first)
        elif excess < -s.band:
            self._reduction, self._released = 0.0, seen.time
        elif excess > 0.0 and seen.acceleration > 0.0 and seen.time - self._changed >= s.patience:
            self._reduce(seen.time, self._reduction + s.deepening)
        self._notch = self._chosen_notch(excess)
        return Controls.single(notch=self._notch, handle=round(s.running - self._reduction, 1))

    def _reduce(self, time: float, reduction: float) -> None:
        s = self.settings
        hand = 0.0 if reduction <= s.first else float(self._rng.uniform(-1.0, 1.0))
        self._reduction = min(s.deepest, max(s.first, reduction + hand))
        self._changed = time

    def _chosen_notch(self, excess: float) -> int:
        """Full power well below the target, none above it or while the brake is on."""
        s = self.settings
        if self._reduction > 0.0 or excess > 0.0:
            return 0
        return min(self._highest, int(np.ceil(-excess / s.band * self._highest)))


class NotchAndBrakeDriver(AbstractDriver):
    """Notches by the track card, dynamic brake among them; the air brake by cycles where that is not enough.

    Args:
        train: What it drives.
        track: The line; its card is what the driver knows of it.
        settings: Habits with the air brake; their target is the speed to hold.
        seed: Of the hand.

    Raises:
        ConfigError: If the train has no notches.
    """

    def __init__(
        self, *, train: Train, track: TrackProfile, settings: HabitSettings | None = None, seed: int = 0
    ) -> None:
        self.settings = settings or HabitSettings()
        margin = AtoSettings().margin
        card = card_of(track, limit=self.settings.target + margin)
        self._notches = CardDriver(train=train, card=card, section=LINE, stop=np.inf, point=np.inf)
        self._brake = CycleBrakingDriver(settings=self.settings, seed=seed)

    def act(self, seen: Observation, most: int) -> Controls:
        """Notch and handle for one sample: no power against the brake."""
        handle = float(self._brake.act(seen, most).handle[0])
        notch = int(self._notches.act(seen, most).notch[0])
        return Controls.single(notch=min(notch, 0) if handle < self.settings.running else notch, handle=handle)


LINE = "LINE"
"""Section code of a card made from a line."""


def card_of(track: TrackProfile, *, limit: float) -> TrackCard:
    """The track card of a line.

    Args:
        track: The line, from position 0 on.
        limit: Speed limit in m/s where the line has none.

    Returns:
        A card of one section.

    Example:
        >>> [row.value for row in card_of(TrackProfile.level(), limit=20.0).rows]
        [0.0, 99999.0, 72.0]
    """
    rows: dict[tuple[CardCode, float], CardRow] = {}
    for start, grade, curvature, allowed in zip(
        np.maximum(track.starts, 0.0), track.grades, track.curvatures, track.speed_limits, strict=True
    ):
        values = {
            CardCode.GRADE: 1000.0 * float(grade),
            CardCode.CURVE: STRAIGHT if curvature == 0.0 else 1.0 / abs(float(curvature)),
            CardCode.LIMIT: min(float(allowed), limit) / KMH,
        }
        for code, value in values.items():
            # Of what lies before position 0 the last counts.
            rows[code, float(start)] = CardRow(section=LINE, distance=float(start), code=code, value=value)
    return TrackCard(rows=tuple(rows.values()))


def rolling_line(seed: int) -> TrackProfile:
    """A line of 40 km down from the hills (ours): sections of 1 to 4 km, that fall by 4 to 12 per mille or are level.

    They fall and are nearly level in turn: one locomotive takes a loaded train up rises of 1.5 per mille at speed.

    Args:
        seed: Any integer of at least 0.

    Returns:
        The track.

    Example:
        >>> rolling_line(3).name
        'rolling line 3'
    """
    rng = np.random.default_rng(seed)
    rows: list[tuple[float, float]] = []
    x = 0.0
    while x < 40_000.0:
        grade = -rng.uniform(0.004, 0.012) if len(rows) % 2 == 0 else rng.uniform(0.0, 0.0015)
        rows.append((x, float(grade)))
        x += float(rng.uniform(1000.0, 4000.0))
    return TrackProfile.from_steps(f"rolling line {seed}", grade=[(-5000.0, 0.0), *rows])


def drive_cycle(
    train: Train,
    consist: Consist,
    *,
    seed: int,
    duration: float = 900.0,
    settings: HabitSettings | None = None,
    variant: Variant = USUAL,
) -> Run:
    """Drive a train over a hilly line with the reference brake.

    Args:
        train: The vehicles.
        consist: Their air brake.
        seed: Of line and driver.
        duration: In s.
        settings: Habits.
        variant: The reading of the brake.

    Returns:
        The run; its ``handle`` is the cycle.
    """
    settings = settings or HabitSettings(running=consist.running_pressure)
    driver = CycleBrakingDriver(settings=settings, seed=seed)
    brake = ReferenceBrake(consist=consist, variant=variant)
    return _driven(train, brake, driver, seed=seed, duration=duration, speed=settings.target)


def line_cycle(
    train: Train,
    consist: Consist,
    *,
    seed: int,
    duration: float = 900.0,
    settings: HabitSettings | None = None,
) -> Run:
    """Drive a train over a hilly line by the track card: notches first, the air brake where they are not enough.

    Args:
        train: The vehicles.
        consist: Their air brake.
        seed: Of line and driver.
        duration: In s.
        settings: Habits.

    Returns:
        The run; its ``handle`` is the cycle.
    """
    settings = settings or HabitSettings(running=consist.running_pressure)
    driver = NotchAndBrakeDriver(train=train, track=rolling_line(seed), settings=settings, seed=seed)
    brake = ReferenceBrake(consist=consist)
    return _driven(train, brake, driver, seed=seed, duration=duration, speed=settings.target)


def _driven(
    train: Train, brake: ReferenceBrake, driver: AbstractDriver, *, seed: int, duration: float, speed: float
) -> Run:
    moving = MovingTrain(train=train, track=rolling_line(seed), speed=speed)
    return drive(moving, brake, driver, Limits(duration=duration, until_still=False, block=1))


def command_of(handle: NDArray[np.float64], sample_time: float) -> Command:
    """The command vector of a handle: one row for each move, as data sets have it.

    Args:
        handle: Psi gauge at each sample, shape ``(n_samples,)``.
        sample_time: In s.

    Returns:
        The command.

    Example:
        >>> command_of(np.array([90.0, 90.0, 84.0, 84.0]), 0.5).times
        (0.0, 1.0)
    """
    moves = np.concatenate([[0], np.flatnonzero(np.diff(handle)) + 1])
    return Command(
        times=tuple(round(float(k * sample_time), 6) for k in moves),
        pressures=tuple(float(handle[k]) for k in moves),
        duration=float(len(handle) * sample_time),
    )
