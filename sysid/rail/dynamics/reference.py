"""The same step of a train as the compiled kernel, written plainly, to test the kernel by.

One residual per vehicle, solved by SciPy's general root finder. Forces come from the formulas of the components
(:class:`Coupler`, :class:`Davis`, :class:`Rigging`, :class:`TrackProfile`); no code is shared with the kernel.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from sysid.errors import StabilityError
from sysid.rail.constants import GRAVITY
from sysid.rail.dynamics.coupler import Coupler
from sysid.rail.dynamics.motion import CURVE_RESISTANCE, TURN_SPEED
from sysid.rail.dynamics.track import TrackProfile
from sysid.rail.dynamics.train import Train


def _sign(speed: float, width: float) -> float:
    return speed / math.sqrt(width * width + speed * speed)


class PlainTrain:
    """Positions and speeds of a train, one step at a time.

    Args:
        train: The vehicles.
        track: The line.
        speed: At the beginning in m/s, one per vehicle.
        position: Of the first vehicle in m.
        time_step: In s.
    """

    def __init__(
        self, *, train: Train, track: TrackProfile, speed: NDArray[np.float64], position: float, time_step: float
    ) -> None:
        self.train, self.track, self.time_step = train, track, time_step
        self.positions = position - train.offsets
        self.speeds = np.array(speed, dtype=np.float64)

    def step(self, pressures: NDArray[np.float64], notches: NDArray[np.int64]) -> None:
        """One step.

        Args:
            pressures: Of the cylinders in Pa gauge, one per vehicle.
            notches: One per vehicle.

        Raises:
            StabilityError: If SciPy finds no solution.
        """
        scale = self.train.masses

        def residual(end: NDArray[np.float64]) -> NDArray[np.float64]:
            forces = self._outside(end, pressures, notches) + self._inside(end)
            return np.asarray(end - self.speeds - self.time_step * forces / scale)

        found = root(residual, self.speeds, tol=1e-13)
        if np.abs(residual(found.x)).max() > 1e-10:
            raise StabilityError("the plain step has no solution", where="reference", got=found.message)
        self.positions = self.positions + 0.5 * self.time_step * (self.speeds + found.x)
        self.speeds = found.x

    def _outside(
        self, end: NDArray[np.float64], pressures: NDArray[np.float64], notches: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        forces = np.zeros(len(end))
        for i, vehicle in enumerate(self.train.vehicles):
            mid = 0.5 * (self.speeds[i] + end[i])
            before, after = self.positions[i], self.positions[i] + self.time_step * mid
            rise = float(self.track.elevation(after) - self.track.elevation(before))
            slope = rise / (after - before) if abs(after - before) > 1e-9 else float(self.track.grade(after))
            against = vehicle.davis.force(mid)
            against += CURVE_RESISTANCE * vehicle.mass * float(self.track.curvature(after))
            if vehicle.rigging is not None:
                against += vehicle.rigging.shoe_force(float(pressures[i])) * vehicle.rigging.shoe.friction(mid)
            if vehicle.notches is not None:
                force = vehicle.notches.force(int(notches[i]), mid)
                forces[i] += max(force, 0.0)
                against += max(-force, 0.0)
            forces[i] -= against * _sign(end[i], TURN_SPEED) + vehicle.mass * GRAVITY * slope
        return forces

    def _inside(self, end: NDArray[np.float64]) -> NDArray[np.float64]:
        forces = np.zeros(len(end))
        after = self.positions + 0.5 * self.time_step * (self.speeds + end)
        for j, spacing in enumerate(self.train.spacings):
            d0 = self.positions[j] - self.positions[j + 1] - spacing
            d1 = after[j] - after[j + 1] - spacing
            pull = _pull(self.train.coupler(j), d0, d1, end[j] - end[j + 1])
            forces[j] -= pull
            forces[j + 1] += pull
        return forces


def _pull(coupler: Coupler, d0: float, d1: float, relative_speed: float) -> float:
    if abs(d1 - d0) < 1e-12:
        elastic = coupler.force(0.5 * (d0 + d1))
    else:
        elastic = (coupler.energy(d1) - coupler.energy(d0)) / (d1 - d0)
    return elastic + coupler.friction_force(0.5 * (d0 + d1)) * _sign(relative_speed, coupler.friction_speed)
