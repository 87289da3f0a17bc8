"""Scenarios by which a brake is judged: the same train, line and handle, whatever brake is under it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.command import Command
from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import AbstractBrake
from sysid.rail.dynamics.drive import AbstractDriver, Limits, Run, Schedule, drive
from sysid.rail.dynamics.motion import MovingTrain, Peak
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train
from sysid.rail.end_of_train.tail_unit import TwoEndedBrake


@dataclass(frozen=True, kw_only=True, eq=False)
class Scenario:
    """One run to make with any brake.

    Args:
        name: Short.
        train: The vehicles.
        track: The line.
        command: The handle; where somebody drives, only its duration counts.
        speed: At the beginning in m/s.
        position: Of the first vehicle in m.
        notch: From a time in s on, rows of time and notch.
        driver: Makes the one who sets handle and notch instead, by what the train does.
        two_ended: Whether a two-way end-of-train device brakes the tail too.
        until_still: Whether the run ends when the train stands.
    """

    name: str
    train: Train
    track: TrackProfile
    command: Command
    speed: float
    position: float = 0.0
    notch: tuple[tuple[float, int], ...] = ((0.0, 0),)
    driver: Callable[[], AbstractDriver] | None = None
    two_ended: bool = False
    until_still: bool = True

    def run(self, brake: AbstractBrake) -> Run:
        """Make the run.

        Args:
            brake: A fresh one, charged and released.

        Returns:
            The run.

        Raises:
            ConfigError: If the brake does not fit the train.
        """
        moving = MovingTrain(
            train=self.train,
            track=self.track,
            speed=self.speed,
            position=self.position,
            sample_time=brake.sample_time,
        )
        driver = self._schedule(brake.sample_time) if self.driver is None else self.driver()
        limits = Limits(duration=self.command.duration, until_still=self.until_still)
        return drive(moving, TwoEndedBrake(brake) if self.two_ended else brake, driver, limits)

    def _schedule(self, sample_time: float) -> Schedule:
        handle = self.command.sampled(sample_time=sample_time)
        starts = [round(time / sample_time) for time, _ in self.notch]
        rows = np.searchsorted(starts, np.arange(len(handle)), side="right") - 1
        notches = np.array([notch for _, notch in self.notch], dtype=np.int64)[np.maximum(rows, 0)]
        return Schedule(handle=handle, notch=notches, sample_time=sample_time)


@dataclass(frozen=True, kw_only=True, eq=False)
class Consequence:
    """What a brake did to a train in one scenario.

    Args:
        scenario: Its name.
        stopped: Whether every vehicle stood at the end.
        distance: Of the first vehicle from the beginning to the end in m: the stopping distance if it stopped.
        time: To the end in s, or to the stop.
        draft: Largest draft force.
        buff: Largest buff force (negative).
        deceleration: Largest of the first vehicle in m/s2, over one second.
        jerk: Largest of the first vehicle in m/s3, over one second.
        clock: In s, shape ``(n_samples,)``.
        speed: Of the first vehicle in m/s, same shape.
    """

    scenario: str
    stopped: bool
    distance: float
    time: float
    draft: Peak
    buff: Peak
    deceleration: float
    jerk: float
    clock: NDArray[np.float64]
    speed: NDArray[np.float64]

    @property
    def largest_force(self) -> float:
        """Size of the largest coupler force in N."""
        return max(self.draft.force, -self.buff.force)

    def to_dict(self) -> dict[str, Any]:
        """Figures as JSON values, without the traces."""
        return {
            "scenario": self.scenario,
            "stopped": self.stopped,
            "distance_m": self.distance,
            "time_s": self.time,
            "peak_draft_kn": self.draft.force / 1e3,
            "peak_draft_coupler": self.draft.coupler,
            "peak_draft_time_s": self.draft.time,
            "peak_buff_kn": self.buff.force / 1e3,
            "peak_buff_coupler": self.buff.coupler,
            "peak_buff_time_s": self.buff.time,
            "deceleration_m_s2": self.deceleration,
            "jerk_m_s3": self.jerk,
        }


STANDING = 0.05
"""Speed in m/s of the centre of mass below which a train counts as stopped (ours); its vehicles may still rock."""


def consequence(scenario: Scenario, run: Run) -> Consequence:
    """Figures of a run.

    Args:
        scenario: That was run.
        run: What came of it.

    Returns:
        The consequence.
    """
    masses, motion = scenario.train.masses, run.motion
    mean_speed = motion.speeds @ masses / masses.sum()
    mean_position = motion.positions @ masses / masses.sum()
    start = scenario.position - float(scenario.train.offsets @ masses / masses.sum())
    below = np.flatnonzero(mean_speed < STANDING)
    stopped = len(below) > 0 and scenario.until_still
    end = int(below[0]) if stopped else len(motion) - 1
    step = float(motion.time[1] - motion.time[0]) if len(motion) > 1 else 1.0
    second = max(1, round(1.0 / step))
    rates = -(run.speed[second:] - run.speed[:-second]) / (second * step)
    jerks = (rates[second:] - rates[:-second]) / (second * step)
    return Consequence(
        scenario=scenario.name,
        stopped=stopped,
        distance=float(mean_position[end] - start),
        time=float(motion.time[end]),
        draft=run.draft,
        buff=run.buff,
        deceleration=float(rates.max(initial=0.0)),
        jerk=float(np.abs(jerks).max(initial=0.0)),
        clock=motion.time,
        speed=run.speed,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Difference:
    """A brake against the reference in one scenario.

    Args:
        reference: With the reference brake.
        other: With the brake that is judged.
        mse: Of its cylinder pressures against the reference's, in psi2, over vehicles with a brake and the common time.
    """

    reference: Consequence
    other: Consequence
    mse: float

    @property
    def distance(self) -> float:
        """Relative difference of the distance."""
        return self.other.distance / self.reference.distance - 1.0

    @property
    def time(self) -> float:
        """Relative difference of the time."""
        return self.other.time / self.reference.time - 1.0

    @property
    def force(self) -> float:
        """Relative difference of the largest coupler force."""
        return self.other.largest_force / self.reference.largest_force - 1.0

    @property
    def speed(self) -> float:
        """Largest difference of the speed in m/s over the common time."""
        common = min(len(self.reference.speed), len(self.other.speed))
        return float(np.abs(self.other.speed[:common] - self.reference.speed[:common]).max())

    def to_dict(self) -> dict[str, Any]:
        """Figures as JSON values."""
        return {
            "reference": self.reference.to_dict(),
            "other": self.other.to_dict(),
            "mse_psi2": self.mse,
            "distance_percent": 100.0 * self.distance,
            "time_percent": 100.0 * self.time,
            "force_percent": 100.0 * self.force,
            "speed_m_s": self.speed,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """A brake against the reference in several scenarios.

    Args:
        differences: By name of the scenario.
    """

    differences: Mapping[str, Difference] = field(default_factory=dict)

    def worst(self, figure: str) -> float:
        """Largest size of a relative difference: ``distance``, ``time`` or ``force``."""
        if figure not in {"distance", "time", "force"}:
            raise ConfigError("unknown figure", where="worst", expected="distance, time or force", got=figure)
        return max((abs(getattr(d, figure)) for d in self.differences.values()), default=float("nan"))

    def to_dict(self) -> dict[str, Any]:
        """Figures as JSON values, by scenario."""
        return {name: difference.to_dict() for name, difference in self.differences.items()}
