"""Driving a train: a driver sees where it is and sets notch and brake handle; train and brake follow."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import AbstractBrake
from sysid.rail.dynamics.motion import Motion, MovingTrain, Peak

STILL = 0.01
"""Speed in m/s below which a train counts as stopped (ours)."""


STARTS = 1e-5
"""Gain of speed in m/s over a look by which a train at rest counts as about to start (ours)."""


@dataclass(frozen=True, kw_only=True)
class Observation:
    """What the driver of the first vehicle sees.

    Args:
        time: In s.
        position: Of the first vehicle in m.
        speed: Of the first vehicle in m/s.
        acceleration: Over the last sample in m/s2.
    """

    time: float
    position: float
    speed: float
    acceleration: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Controls:
    """What the driver does, for one sample or several.

    Args:
        notch: Whole numbers, shape ``(k,)``.
        handle: Brake handle in psi gauge, shape ``(k,)``.
        tail_vent: Area in m2 open behind the last vehicle, shape ``(k,)``.
    """

    notch: NDArray[np.int64]
    handle: NDArray[np.float64]
    tail_vent: NDArray[np.float64]

    @staticmethod
    def single(*, notch: int = 0, handle: float = 90.0, tail_vent: float = 0.0) -> Controls:
        """Controls for one sample."""
        return Controls(
            notch=np.array([notch], dtype=np.int64), handle=np.array([handle]), tail_vent=np.array([tail_vent])
        )


class AbstractDriver(ABC):
    """Whoever sets the controls."""

    @abstractmethod
    def act(self, seen: Observation, most: int) -> Controls:
        """Controls for the next samples.

        Args:
            seen: What there is to see now.
            most: Largest number of samples that may be decided at once.

        Returns:
            Controls for 1 to ``most`` samples.
        """


@dataclass(frozen=True, kw_only=True, eq=False)
class Schedule(AbstractDriver):
    """Controls that were decided before; the last ones are held.

    Args:
        handle: Psi gauge at each sample, shape ``(n,)``.
        notch: One for each sample, or one for all.
        tail_vent: In m2, one for each sample, or one for all.
        sample_time: In s.

    Raises:
        ConfigError: If the lengths differ.
    """

    handle: NDArray[np.float64]
    sample_time: float
    notch: NDArray[np.int64] | int = 0
    tail_vent: NDArray[np.float64] | float = 0.0

    def __post_init__(self) -> None:
        count = len(self.handle)
        for name in ("notch", "tail_vent"):
            values = np.asarray(getattr(self, name))
            if values.shape not in {(), (count,)} or count == 0:
                raise ConfigError(
                    f"{name} does not fit the handle",
                    where="schedule",
                    expected=f"one value, or {count} of them",
                    got=f"shape {values.shape}",
                )
            object.__setattr__(self, name, np.array(np.broadcast_to(values, (count,))))

    def act(self, seen: Observation, most: int) -> Controls:
        """The next rows of the schedule."""
        first = round(seen.time / self.sample_time)
        rows = np.minimum(np.arange(first, first + most), len(self.handle) - 1)
        notch, vent = np.asarray(self.notch), np.asarray(self.tail_vent)
        return Controls(notch=notch[rows], handle=self.handle[rows], tail_vent=vent[rows])


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """What came of a drive.

    Args:
        motion: Of every vehicle, one row per sample.
        notch: Set in each sample.
        handle: Psi gauge in each sample.
        cylinders: Pa gauge, shape ``(n_samples, n_vehicles)``.
        draft: Largest draft force.
        buff: Largest buff force (negative).
        traction_work: Of all locomotives in J.
    """

    motion: Motion
    notch: NDArray[np.int64]
    handle: NDArray[np.float64]
    cylinders: NDArray[np.float64]
    draft: Peak
    buff: Peak
    traction_work: float

    @property
    def speed(self) -> NDArray[np.float64]:
        """Of the first vehicle in m/s, shape ``(n_samples,)``."""
        return self.motion.speeds[:, 0]

    @property
    def position(self) -> NDArray[np.float64]:
        """Of the first vehicle in m, shape ``(n_samples,)``."""
        return self.motion.positions[:, 0]

    @property
    def notch_changes(self) -> int:
        """How often the notch was changed."""
        return int(np.count_nonzero(np.diff(self.notch)))


@dataclass(frozen=True, kw_only=True)
class Limits:
    """When a drive ends.

    Args:
        duration: Longest time in s.
        until_still: Whether it ends when every vehicle stands still, and is not about to start.
        block: Largest number of samples between two looks.
        back: How far in m the first vehicle may roll back from where it began.
    """

    duration: float
    until_still: bool = True
    block: int = 50
    back: float = np.inf


@dataclass(kw_only=True, eq=False)
class _Log:
    motions: list[Motion] = field(default_factory=list)
    controls: list[Controls] = field(default_factory=list)
    cylinders: list[NDArray[np.float64]] = field(default_factory=list)


def drive(moving: MovingTrain, brake: AbstractBrake, driver: AbstractDriver, limits: Limits) -> Run:
    """Drive a train with a brake.

    In each block the brake goes first, with the train's speed at the block's beginning, then the train with the
    cylinder pressures that came of it.

    Args:
        moving: The train.
        brake: Its brake, at the same sample time and for the same vehicles.
        driver: Who sets the controls.
        limits: When it ends.

    Returns:
        The run.

    Raises:
        ConfigError: If the brake does not fit the train.
    """
    _check_fit(moving, brake)
    log, start = _Log(), float(moving.state.position[0])
    total = round(limits.duration / moving.sample_time)
    done, acceleration, seen_speed = 0, 0.0, float(moving.state.speed[0])
    fastest = float(np.abs(moving.state.speed).max())
    while done < total:
        seen = Observation(
            time=done * moving.sample_time,
            position=float(moving.state.position[0]),
            speed=seen_speed,
            acceleration=acceleration,
        )
        controls = driver.act(seen, min(limits.block, total - done))
        output = brake.advance(controls.handle, speed=max(moving.speed, 0.0), tail_vent=controls.tail_vent)
        motion = moving.advance(output.cylinders, notch=controls.notch)
        log.motions.append(motion)
        log.controls.append(controls)
        log.cylinders.append(output.cylinders)
        done += len(motion)
        before = seen_speed if len(motion) == 1 else float(motion.speeds[-2, 0])
        seen_speed = float(motion.speeds[-1, 0])
        acceleration = (seen_speed - before) / moving.sample_time
        # A heavy train that starts is slow at first: it gains speed, and one that cannot start does not.
        now = float(np.abs(motion.speeds[-1]).max())
        still = done > 1 and now < STILL and (fastest >= STILL or now <= fastest + STARTS)
        fastest = max(fastest, now)
        if (limits.until_still and still) or float(motion.positions[-1, 0]) < start - limits.back:
            break
    return _run(moving, log)


def _check_fit(moving: MovingTrain, brake: AbstractBrake) -> None:
    ours, theirs = (len(moving.train.vehicles), moving.sample_time), (brake.vehicles, brake.sample_time)
    if ours[0] != theirs[0] or not np.isclose(ours[1], theirs[1], rtol=1e-9, atol=0.0):
        raise ConfigError(
            "the brake does not fit the train",
            where="drive",
            expected=f"{ours[0]} vehicles every {ours[1]:g} s",
            got=f"{theirs[0]} vehicles every {theirs[1]:g} s",
            remedy="make both from the same consist and sample time",
        )


def _run(moving: MovingTrain, log: _Log) -> Run:
    return Run(
        motion=Motion.joined(log.motions),
        notch=np.concatenate([controls.notch for controls in log.controls]),
        handle=np.concatenate([controls.handle for controls in log.controls]),
        cylinders=np.concatenate(log.cylinders),
        draft=moving.peak(draft=True),
        buff=moving.peak(draft=False),
        traction_work=moving.works["traction"],
    )
