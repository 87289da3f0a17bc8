"""Fifteen plants as engineers meet them, integrated in small steps.

Each is ``dx/dt = rates(x, u)`` with the output ``read(x)``; parameters are round numbers of a plausible size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = Sequence[float]


@dataclass(frozen=True, kw_only=True)
class Plant:
    """One plant.

    Args:
        rates: Derivatives of the states, by states and inputs.
        read: The output, by states.
        rest: States at the beginning.
        ranges: Lowest and highest value of each input.
        sample_time: In s.
        settles: Samples within which a step about settles, by which inputs are held.
        steps: Steps of integration within a sample.
        dead: Samples by which the inputs come late.
        bounds: Lowest and highest value of single states, by place: stops.
    """

    rates: Callable[[Numbers, Numbers], list[float]]
    read: Callable[[Numbers], float]
    rest: tuple[float, ...]
    ranges: tuple[tuple[float, float], ...]
    sample_time: float
    settles: int
    steps: int = 4
    dead: int = 0
    bounds: dict[int, tuple[float, float]] | None = None

    def run(self, u: Array) -> Array:
        """The output at the beginning of each sample.

        Args:
            u: Inputs, one row a sample, held over it.

        Returns:
            One value a sample.
        """
        x, y = np.array(self.rest), np.empty(len(u))
        step = self.sample_time / self.steps
        for k in range(len(u)):
            now = u[max(k - self.dead, 0)].tolist()
            y[k] = self.read(x.tolist())
            for _ in range(self.steps):
                x = self._stopped(x + step * self._slope(x, now, step))
        return y

    def _slope(self, x: Array, u: Numbers, step: float) -> Array:
        """The fourth-order Runge-Kutta mean of the derivatives."""
        first = np.array(self.rates(x.tolist(), u))
        second = np.array(self.rates((x + 0.5 * step * first).tolist(), u))
        third = np.array(self.rates((x + 0.5 * step * second).tolist(), u))
        last = np.array(self.rates((x + step * third).tolist(), u))
        return (first + 2.0 * second + 2.0 * third + last) / 6.0

    def _stopped(self, x: Array) -> Array:
        for place, (low, high) in (self.bounds or {}).items():
            x[place] = min(max(x[place], low), high)
        return x


def root(x: float) -> float:
    """The square root with a sign."""
    return math.copysign(math.sqrt(abs(x)), x)


def dead_band(x: float, half: float) -> float:
    """What is left beyond a band about nought."""
    return math.copysign(max(abs(x) - half, 0.0), x)


def _reactor(x: Numbers, u: Numbers) -> list[float]:
    """A stirred tank with an exothermic reaction, dimensionless; cooled (Uppal, Ray and Poore 1974)."""
    speed = 0.072 * (1.0 - x[0]) * math.exp(x[1] / (1.0 + x[1] / 20.0))
    return [-x[0] + speed, -x[1] + 8.0 * speed - 1.5 * (x[1] - u[0])]


def _motor(x: Numbers, u: Numbers) -> list[float]:
    """Voltage to current and speed; dry friction."""
    return [20.0 * (u[0] - x[0] - 0.5 * x[1]), 4.0 * x[0] - 0.3 * x[1] - 1.5 * math.tanh(x[1] / 0.05)]


def _play(x: Numbers, u: Numbers) -> list[float]:
    """A motor and a load, between them a spring with play."""
    torque = 60.0 * dead_band(x[0] - x[2], 0.05) + 1.0 * (x[1] - x[3]) * (abs(x[0] - x[2]) > 0.05)
    return [x[1], (u[0] - 0.8 * x[1] - torque) / 0.3, x[3], (torque - 0.5 * x[3]) / 0.6]


def _speaker(x: Numbers, u: Numbers) -> list[float]:
    """A loudspeaker: force factor and stiffness depend on where the cone is (mm, m/s)."""
    force = 5.0 * math.exp(-0.08 * x[0] ** 2)
    current = (u[0] - force * x[1]) / 6.0
    return [1000.0 * x[1], (force * current - 1.2 * x[0] * (1.0 + 0.15 * x[0] ** 2) - 1.0 * x[1]) / 0.012]


def _acid(x: Numbers, u: Numbers) -> list[float]:
    """Charge in a stirred tank; a strong acid and a strong base."""
    return [0.5 * (u[0] - 1.0) - 0.5 * x[0], 2.0 * (x[0] - x[1])]


PLANTS: dict[str, Plant] = {
    "linear, third order, dead time": Plant(
        rates=lambda x, u: [x[1], 4.0 * (u[0] - x[0]) - 1.2 * x[1], 1.0 * (x[0] - x[2])],
        read=lambda x: x[2], rest=(0.0, 0.0, 0.0), ranges=((-1.0, 1.0),), sample_time=0.1, settles=60, dead=7,
    ),
    "motor with dry friction": Plant(
        rates=_motor, read=lambda x: x[1], rest=(0.0, 0.0), ranges=((-6.0, 6.0),), sample_time=0.05, settles=25,
        steps=40,
    ),
    "two tanks, the upper overflows": Plant(
        rates=lambda x, u: [
            0.12 * u[0] - 0.1 * root(max(x[0], 0.0)), 0.1 * root(max(x[0], 0.0)) - 0.1 * root(max(x[1], 0.0)),
        ],
        read=lambda x: x[1], rest=(1.0, 1.0), ranges=((0.0, 1.6),), sample_time=1.0, settles=50,
        bounds={0: (0.0, 1.8), 1: (0.0, 9.0)},
    ),
    "pendulum": Plant(
        rates=lambda x, u: [x[1], -9.0 * math.sin(x[0]) - 1.0 * x[1] + u[0]],
        read=lambda x: x[0], rest=(0.0, 0.0), ranges=((-5.0, 5.0),), sample_time=0.05, settles=80,
    ),
    "heat exchanger, flow and temperature": Plant(
        rates=lambda x, u: [
            u[0] * (u[1] - x[0]) / 4.0 - 0.3 * u[0] ** 0.6 * (x[0] - x[1]),
            0.25 * (15.0 - x[1]) + 0.3 * u[0] ** 0.6 * (x[0] - x[1]),
        ],
        read=lambda x: x[1], rest=(25.0, 20.0), ranges=((0.3, 2.0), (30.0, 80.0)), sample_time=0.5, settles=30,
    ),
    "stirred tank reactor": Plant(
        rates=_reactor, read=lambda x: x[1], rest=(0.1, 0.3), ranges=((-0.5, 2.0),), sample_time=0.1, settles=40,
    ),
    "suspension with bump stops": Plant(
        rates=lambda x, u: [
            x[1],
            -60.0 * (x[0] - u[0]) - 600.0 * dead_band(x[0] - u[0], 0.4) - (6.0 if x[1] > 0.0 else 3.0) * x[1],
        ],
        read=lambda x: x[0], rest=(0.0, 0.0), ranges=((-1.0, 1.0),), sample_time=0.02, settles=60,
    ),
    "valve of equal percentage, dead time": Plant(
        rates=lambda x, u: [3.0 * (30.0 ** (u[0] - 1.0) - x[0]), 0.5 * (x[0] - x[1])],
        read=lambda x: x[1], rest=(0.2, 0.2), ranges=((0.1, 1.0),), sample_time=0.2, settles=35, dead=4,
    ),
    "loudspeaker": Plant(
        rates=_speaker, read=lambda x: x[0], rest=(0.0, 0.0), ranges=((-10.0, 10.0),), sample_time=2e-3, settles=12,
        steps=20,
    ),
    "room, heater and weather": Plant(
        rates=lambda x, u: [
            (1.0 * u[0] - 0.10 * (x[0] - u[1]) - 0.4 * (x[0] - x[1])) / 6.0, (0.4 * (x[0] - x[1])) / 40.0,
        ],
        read=lambda x: x[0], rest=(15.0, 15.0), ranges=((0.0, 3.0), (-5.0, 15.0)), sample_time=2.0, settles=120,
    ),
    "pressure vessel, two valves": Plant(
        rates=lambda x, u: [
            1.5 * u[0] * root(max(6.0 - x[0], 0.0)) - 0.8 * u[1] * (x[0] if x[0] > 1.9 else root(x[0] * (x[0] - 1.0)))
        ],
        read=lambda x: x[0], rest=(2.0,), ranges=((0.05, 1.0), (0.2, 1.0)), sample_time=0.05, settles=30,
        bounds={0: (1.0, 6.0)},
    ),
    "neutralisation": Plant(
        rates=_acid, read=lambda x: 7.0 + math.asinh(40.0 * x[1]), rest=(0.0, 0.0), ranges=((0.6, 1.4),),
        sample_time=0.2, settles=40,
    ),
    "two masses with play": Plant(
        rates=_play, read=lambda x: x[3], rest=(0.0, 0.0, 0.0, 0.0), ranges=((-4.0, 4.0),), sample_time=0.02,
        settles=50, steps=10,
    ),
    "vehicle, throttle and grade": Plant(
        rates=lambda x, u: [4.0 * u[0] / (1.0 + 0.05 * x[0]) - 0.004 * x[0] ** 2 - 0.1 - 9.8 * u[1]],
        read=lambda x: x[0], rest=(15.0,), ranges=((0.2, 1.0), (-0.04, 0.06)), sample_time=0.5, settles=60,
        bounds={0: (0.0, 60.0)},
    ),
    "fermenter": Plant(
        rates=lambda x, u: [
            x[0] * (0.5 * x[1] / (0.3 + x[1] + 0.5 * x[1] ** 2) - u[0]),
            u[0] * (4.0 - x[1]) - 2.0 * x[0] * 0.5 * x[1] / (0.3 + x[1] + 0.5 * x[1] ** 2),
        ],
        read=lambda x: x[0], rest=(1.7, 0.5), ranges=((0.05, 0.25),), sample_time=0.5, settles=60,
        bounds={0: (0.0, 9.0), 1: (0.0, 9.0)},
    ),
}  # fmt: skip
