"""A transit vehicle and its deceleration controller, open loop first, closed loop after, learning from stop to stop.

After "Transit vehicle deceleration control system and method" (figures 17 and 18). Where the source gives no number,
the default is ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.settings import check_numbers
from sysid.errors import ConfigError
from sysid.models import AbstractModel
from sysid.rail.constants import GRAVITY, MPH
from sysid.rail.dynamics.surrogate import ModelBank, Stage
from sysid.rail.transit.deceleration import (
    COAST,
    COAST_RATE,
    CRUISE,
    FULL_SERVICE,
    FULL_TRACTION,
    JERK,
    OPEN_LOOP,
    RATE,
    Characteristic,
    JerkProfile,
    grade_acceleration,
)
from sysid.traces import Channel, Trace
from sysid.units import Reference


def commanded_pressure(signal: float) -> float:
    """Cylinder pressure in psi that a signal asks for: the source's 32 mA for 17 psi and 28 mA for 21 psi, extended."""
    return max(0.0, 17.0 + (32.0 - signal))


def braking(pressure: float) -> float:
    """Deceleration by the shoes in m/s2 at nominal friction and a pressure in psi.

    A power law (ours) through the source's points less the 0.7 mph/s of friction alone: 2 mph/s at 43 mA and 5 mph/s
    at 20 mA.
    """
    exponent = np.log(4.3 / 1.3) / np.log(29.0 / 6.0)
    return float(1.3 * MPH * (max(pressure, 0.0) / 6.0) ** exponent)


INTERLOCK = 0.03
"""Cylinder pressure in psi above which there is no traction (ours)."""

TRACTION_JERK = 0.9 * JERK
"""Jerk in m/s3 of the traction (ours): what is left of the source's limit is the brake's last release."""


class TransitVehicle:
    """A vehicle that answers to the signal: cylinder pressure by a fitted model, shoes with their friction, traction.

    Args:
        model: From the commanded pressure (psi) to the cylinder pressure (psi): the brake surrogate.
        friction: Of the shoes, 1 being nominal.
        speed: In m/s.
        grade: Rise over run.

    Raises:
        ConfigError: If the friction is not positive or the model has more than one input.
    """

    def __init__(self, *, model: AbstractModel, friction: float = 1.0, speed: float = 0.0, grade: float = 0.0) -> None:
        if (
            not (0.0 < friction < np.inf and 0.0 <= speed < np.inf and abs(grade) < 0.2)
            or len(model.mapping.inputs) != 1
        ):
            raise ConfigError(
                "the brake of the vehicle cannot be used", where="transit vehicle",
                expected="friction above 0, a speed from 0 on, a grade up to 20 %, a model with one input",
                got=f"{friction:g}, {speed:g} m/s, {grade:g}, {model.mapping}",
            )  # fmt: skip
        self.sample_time, self.friction, self.speed, self.grade = model.sample_time, friction, speed, grade
        self.acceleration, self.pressure, self._pull = 0.0, 0.0, COAST_RATE
        self._bank = ModelBank(stage=Stage(models=(model,)), cars=1, rest_inputs=(0.0,))

    @property
    def pendulum(self) -> float:
        """What the pendulum accelerometer shows in m/s2."""
        return self.acceleration + GRAVITY * self.grade

    def step(self, signal: float) -> None:
        """One sample.

        Args:
            signal: P in mA.
        """
        self.pressure = float(self._bank.advance(np.full((1, 1, 1), commanded_pressure(signal)))[0, 0])
        # Traction balances friction at the cruising signal (ours: linear in between). It waits until the cylinder is
        # empty, so that the two do not change the acceleration together, and limits its own jerk.
        free = signal > COAST and self.pressure < INTERLOCK
        wanted = COAST_RATE * (min(signal, FULL_TRACTION) - COAST) / (CRUISE - COAST) if free else 0.0
        most = TRACTION_JERK * self.sample_time
        self._pull += float(np.clip(wanted - self._pull, -most, most))
        effort = self._pull - COAST_RATE - self.friction * braking(self.pressure)
        before = self.speed
        self.speed = max(0.0, before + (effort - GRAVITY * self.grade) * self.sample_time)
        self.acceleration = (self.speed - before) / self.sample_time


@dataclass(frozen=True, kw_only=True)
class ControlSettings:
    """Numbers of the controller; gains are ours.

    Args:
        proportional: Of the speed regulator in 1/s.
        integral: In 1/s2.
        correction_jerk: Fastest change of the regulator's part in m/s3; its onset is a jerk of its own.
        learning: Share of the relative mean error that goes into the modifier at each stop.
        largest_modifier: Bound of the modifier.
        overspeed: Speed in m/s above the wanted one at which the full service brake is applied: above the command, or
            during a ramp above the ramp's speed, in its open-loop part too.

    Raises:
        ConfigError: If one of them is not a finite number, or below what it may be.
    """

    proportional: float = 0.5
    integral: float = 0.15
    correction_jerk: float = 0.25 * JERK
    learning: float = 0.8
    largest_modifier: float = 1.0
    overspeed: float = 2.0 * MPH

    def __post_init__(self) -> None:
        check_numbers(
            self,
            "control settings",
            from_zero=("proportional", "integral", "learning", "largest_modifier", "overspeed"),
        )


class DecelerationController:
    """From speed command and measurements to the signal.

    Args:
        characteristic: The inverse that turns a request into a signal.
        sample_time: In s.
        settings: Gains.
        learns: Whether the modifier is updated.
    """

    def __init__(
        self,
        *,
        characteristic: Characteristic,
        sample_time: float,
        settings: ControlSettings | None = None,
        learns: bool = True,
    ) -> None:
        self.characteristic, self.settings, self.learns = characteristic, settings or ControlSettings(), learns
        self._dt = sample_time
        self.modifier = 0.0
        self.mean_errors: list[float] = []
        self.request = 0.0
        self._command: float | None = None
        self._profile: JerkProfile | None = None
        self._clock, self._integral, self._error, self._correction = 0.0, 0.0, 0.0, 0.0
        self._since, self._before = 0.0, 0.0
        self._too_fast = False

    @property
    def ramp_active(self) -> bool:
        """Whether the vehicle is between two speed commands."""
        return self._profile is not None

    @property
    def open_loop(self) -> bool:
        """Whether the first seconds after a change of the command, without the regulator, are running."""
        return self.ramp_active and self._since < OPEN_LOOP

    def step(self, command: float, speed: float, tachometer: float, pendulum: float) -> float:
        """One sample.

        Args:
            command: Speed command in m/s.
            speed: Of the vehicle in m/s.
            tachometer: Acceleration from the wheels in m/s2.
            pendulum: Acceleration from the pendulum in m/s2.

        Returns:
            Signal P in mA.
        """
        if self._command is not None and command != self._command:
            if self._profile is not None:
                self._replan(self._profile, command)
            elif command < self._command and speed > command + 1e-6:
                self._begin(command, speed, tachometer)
        self._command = command
        if self._profile is None:
            return self._cruise(command, speed, tachometer, pendulum)
        grade = grade_acceleration(tachometer, pendulum)
        if self._clock > 0.0 and not self._too_fast:
            # What was asked of the brake, on this grade, less the deceleration that came of it; a full service that
            # the overspeed control asked for says nothing of the request.
            self._error += (self.request - grade + tachometer) * self._dt
        self.request = self._requested(self._profile, speed, grade)
        self._too_fast = speed > self._profile.speed(self._clock) + self.settings.overspeed
        self._clock += self._dt
        self._since += self._dt
        if self._clock >= self._profile.duration:
            self._finish(self._profile)
        return FULL_SERVICE if self._too_fast else self.characteristic.signal(self._modified(self.request))

    def _begin(self, command: float, speed: float, tachometer: float) -> None:
        """A ramp from the speed that a vehicle under traction has once that is off, within the limit of the jerk."""
        gaining = max(0.0, tachometer)
        self._profile = JerkProfile(start=speed + 0.5 * gaining**2 / JERK, stop=command)
        self._clock = self._since = -gaining / JERK
        self._integral, self._error, self._correction, self._before = 0.0, 0.0, 0.0, 0.0

    def _replan(self, ramp: JerkProfile, command: float) -> None:
        """Another command within a ramp: the ramp to it that has the speed and the deceleration of now.

        It ends at the command, or, where that is passed before the deceleration can be taken off, where that is.
        """
        rate, speed = ramp.deceleration(self._clock), ramp.speed(self._clock)
        spent = 0.5 * rate**2 / JERK
        start, stop = speed + spent, max(0.0, min(command, speed - spent))
        if start - stop < 1e-6:
            self._profile = None
            return
        gone = rate / JERK if self._clock > 0.0 else self._clock
        self._before += self._clock - gone
        self._profile, self._clock, self._since = JerkProfile(start=start, stop=stop), gone, min(gone, 0.0)

    def _modified(self, request: float) -> float:
        """The request with the modifier on what the brake adds to the friction of coasting."""
        coasting = self.characteristic.decelerations[0]
        return request + self.modifier * max(0.0, request - coasting)

    def _requested(self, profile: JerkProfile, speed: float, grade: float) -> float:
        """Deceleration of the brake, on the level: the profile's, the regulator's part, and what the grade takes."""
        leaving = self._clock > profile.duration - profile.corner
        if (
            not self.open_loop and not leaving
        ):  # The reverse forcing function: the regulator's part is held on the way out.
            s = self.settings
            excess = speed - profile.speed(self._clock)
            self._integral += s.integral * excess * self._dt
            most = s.correction_jerk * self._dt
            wanted = self._integral + s.proportional * excess
            self._correction += float(np.clip(wanted - self._correction, -most, most))
        return max(0.0, profile.deceleration(self._clock) + grade + self._correction)

    def _finish(self, profile: JerkProfile) -> None:
        mean = self._error / (self._before + profile.duration)
        self.mean_errors.append(mean)
        if self.learns:
            s = self.settings
            change = s.learning * mean / max(profile.reached - self.characteristic.decelerations[0], 0.1 * RATE)
            self.modifier = float(np.clip(self.modifier + change, -s.largest_modifier, s.largest_modifier))
        self._profile = None
        self._integral = 0.0

    def _cruise(self, command: float, speed: float, tachometer: float, pendulum: float) -> float:
        if speed > command + self.settings.overspeed:
            return FULL_SERVICE
        grade = grade_acceleration(tachometer, pendulum)
        wanted = self.settings.proportional * (command - speed) - grade
        signal = CRUISE + (CRUISE - COAST) * wanted / COAST_RATE
        return float(np.clip(signal, COAST, FULL_TRACTION))


def stop_trace(vehicle: TransitVehicle, controller: DecelerationController, commands: NDArray[np.float64]) -> Trace:
    """Drive a vehicle by its controller through a sequence of speed commands.

    Args:
        vehicle: The plant.
        controller: The controller; it learns.
        commands: Speed in m/s at each sample, shape ``(n_samples,)``.

    Returns:
        A trace with the channels V_REF, V (m/s), A (deceleration, m/s2), REQ (m/s2), P (mA), BC (psi) and M (the
        modifier, 1).
    """
    rows = np.empty((len(commands), 7))
    for k, command in enumerate(commands):
        signal = controller.step(float(command), vehicle.speed, vehicle.acceleration, vehicle.pendulum)
        vehicle.step(signal)
        rows[k] = (
            command,
            vehicle.speed,
            -vehicle.acceleration,
            controller.request,
            signal,
            vehicle.pressure,
            controller.modifier,
        )
    units = {"V_REF": "m/s", "V": "m/s", "A": "m/s^2", "REQ": "m/s^2", "P": "mA", "BC": "psi", "M": "1"}
    channels = tuple(
        Channel(name=name, unit=unit, reference=Reference.GAUGE if unit == "psi" else Reference.NONE)
        for name, unit in units.items()
    )
    return Trace(name="stops", sample_time=vehicle.sample_time, channels=channels, values=rows)


def largest_jerk(deceleration: NDArray[np.float64], sample_time: float, *, window: float = 0.5) -> float:
    """Largest size of the jerk in m/s3: change of the deceleration over a window, as passengers feel it.

    Args:
        deceleration: In m/s2, shape ``(n_samples,)``.
        sample_time: In s.
        window: In s (ours).

    Returns:
        In m/s3.
    """
    back = max(1, round(window / sample_time))
    return float(np.abs(deceleration[back:] - deceleration[:-back]).max() / (back * sample_time))
