"""Slow models with something in their loop that is not linear.

They are a gear with backlash, a heater whose controller is at its limits, and a thermostat that nobody sees.

Each is named in a configuration as ``loop_models:gear`` and so on; ``compiled_models`` has the same, compiled.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def gear(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A motor that moves a load through a gear with backlash; torque in Nm, output the load's speed in rad/s."""
    return gear_run(float(time[1] - time[0]), inputs, GEARS[0])[:, :1]


def gear_place(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Another, of which the load's angle in rad is seen, and the motor's speed."""
    return gear_run(float(time[1] - time[0]), inputs, GEARS[1])[:, 1:]


def gear_kept(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A third, of which the load's speed and angle are seen."""
    return gear_run(float(time[1] - time[0]), inputs, GEARS[2])[:, :2]


GEARS = (
    (0.010, 0.050, 0.020, 0.050, 20.0, 0.05, 0.050),
    (0.020, 0.030, 0.050, 0.100, 40.0, 0.10, 0.100),
    (0.004, 0.020, 0.010, 0.040, 12.0, 0.02, 0.150),
)
"""Inertia of motor and load in kg m2, viscous friction of both in Nm s, stiffness in Nm, damping where teeth touch in
Nm s, and half the backlash in rad."""


def gear_run(h: float, inputs: Array, numbers: tuple[float, ...]) -> Array:
    """Load's speed and angle, and motor's speed, of numbers alone."""
    motor, load, rubs, drags, stiff, damps, half = numbers
    steps, found = max(1, round(h / 1e-4)), np.empty((len(inputs), 3))
    dt, fast, slow, twist, angle = h / steps, 0.0, 0.0, 0.0, 0.0
    for k, torque in enumerate(inputs[:, 0]):
        for _ in range(steps):
            over = twist - min(max(twist, -half), half)
            passed = stiff * over + (damps * (fast - slow) if over != 0.0 else 0.0)
            fast += dt * (torque - rubs * fast - passed) / motor
            slow += dt * (passed - drags * slow) / load
            twist += dt * (fast - slow)
            angle += dt * slow
        found[k] = slow, angle, fast
    return found


def heater(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A room behind a heater, its PI controller's power from 0 to 2 kW, its integral taken back when at a limit.

    Inputs: setpoint and air outside in degC. Output: the room's temperature in degC.
    """
    return heater_run(float(time[1] - time[0]), inputs, HEATERS[0])


def heater_waits(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Another, whose integral waits while the power is at a limit."""
    return heater_run(float(time[1] - time[0]), inputs, HEATERS[1])


def heater_kept(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A third, of one mass and a sensor that lags; its integral is taken back."""
    return heater_run(float(time[1] - time[0]), inputs, HEATERS[2])


HEATERS = (
    (8e3, 4e5, 60.0, 80.0, 2000.0, 600.0, 900.0, 300.0, 1.0),
    (2e4, 6e5, 90.0, 60.0, 1500.0, 400.0, 1500.0, 0.0, 1.0),
    (5e3, 2e5, 40.0, 50.0, 1200.0, 300.0, 700.0, 500.0, 60.0),
)
"""Heat capacity of heater and room in J/K, what conducts from one to the other and to the air outside in W/K, most
power in W, gain in W/K, integral time in s, time in which it is taken back in s (0: it waits), and seconds from one
look of the controller to the next."""


def heater_run(h: float, inputs: Array, numbers: tuple[float, ...]) -> Array:
    """The same of numbers alone; they begin where nothing moves at the first inputs, or as near as the power allows."""
    body, room, gives, loses, most, gain, integral, back, looks = numbers
    asked, air = inputs[0, 0], inputs[0, 1]
    power = min(max((asked - air) * loses, 0.0), most)
    inside = air + power / loses
    hot = inside + power / gives
    summed, found, dt = power - gain * (asked - inside), np.empty((len(inputs), 1)), 1.0
    until = 0.0
    for k in range(len(inputs)):
        asked, air = inputs[k, 0], inputs[k, 1]
        for _ in range(round(h / dt)):
            if until <= 0.0:
                wanted = gain * (asked - inside) + summed
                power, until = min(max(wanted, 0.0), most), looks
                wind = gain * (asked - inside) / integral
                if back > 0.0:
                    summed += looks * (wind + (power - wanted) / back)
                elif not ((wanted > most and wind > 0.0) or (wanted < 0.0 and wind < 0.0)):
                    summed += looks * wind
            until -= dt
            flow = gives * (hot - inside)
            hot += dt * (power - flow) / body
            inside += dt * (flow - loses * (inside - air)) / room
        found[k, 0] = inside
    return found


def thermostat(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A room over a heated floor, whose relay switches by the floor's temperature, which nobody sees.

    Inputs: the floor's setpoint and the air outside in degC. Output: the room's temperature in degC.
    """
    return thermostat_run(float(time[1] - time[0]), inputs, THERMOSTATS[0])


def thermostat_wall(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Another, whose heat goes into the room, and whose sensor lags behind it."""
    return thermostat_run(float(time[1] - time[0]), inputs, THERMOSTATS[1])


def thermostat_kept(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A third: by the floor's temperature, and other numbers."""
    return thermostat_run(float(time[1] - time[0]), inputs, THERMOSTATS[2])


THERMOSTATS = (
    (2e5, 8e5, 150.0, 100.0, 4000.0, 1.0, 0.0, 1.0),
    (3e4, 4e5, 25.0, 90.0, 3000.0, 0.5, 1.0, 0.0),
    (1e5, 5e5, 120.0, 60.0, 2500.0, 1.5, 0.0, 1.0),
)
"""Heat capacity of floor (or sensor) and room in J/K, what conducts between both and from the room to the air outside
in W/K, power in W, half the width of the relay in K, and shares of the power that go into room and floor."""


def thermostat_run(h: float, inputs: Array, numbers: tuple[float, ...]) -> Array:
    """The same of numbers alone, looked at every second."""
    body, room, gives, loses, power, half, into_room, into_body = numbers
    inside, hidden, on, found, dt = 18.0, 18.0, 0.0, np.empty((len(inputs), 1)), 1.0
    for k in range(len(inputs)):
        asked, air = inputs[k, 0], inputs[k, 1]
        for _ in range(round(h / dt)):
            if hidden < asked - half:
                on = 1.0
            elif hidden > asked + half:
                on = 0.0
            flow = gives * (hidden - inside)
            hidden += dt * (into_body * on * power - flow) / body
            inside += dt * (into_room * on * power + flow - loses * (inside - air)) / room
        found[k, 0] = inside
    return found


_GEAR: dict[str, Any] = {
    "sample_time": 0.02,
    "inputs": {"torque": {"unit": "N*m", "range": [-2, 2], "start": 0}},
}
_AIR: dict[str, Any] = {"air": {"unit": "degC", "range": [-5, 10], "rate": 0.01, "start": 5}}
_HEATER: dict[str, Any] = {
    "sample_time": 60.0,
    "inputs": {"setpoint": {"unit": "degC", "range": [15, 25], "start": 18}, **_AIR},
    "outputs": {"room": {"unit": "degC"}},
}
_THERMOSTAT: dict[str, Any] = {
    "sample_time": 60.0,
    "inputs": {"setpoint": {"unit": "degC", "range": [20, 35], "start": 25}, **_AIR},
    "outputs": {"room": {"unit": "degC"}},
}
_SPEED, _ANGLE = {"load": {"unit": "rad/s"}}, {"angle": {"unit": "rad"}}
REFERENCES: dict[str, dict[str, Any]] = {
    "gear": {**_GEAR, "outputs": _SPEED},
    "gear_place": {**_GEAR, "outputs": {**_ANGLE, "motor": {"unit": "rad/s"}}},
    "gear_kept": {**_GEAR, "outputs": {**_SPEED, **_ANGLE}},
    "heater": _HEATER,
    "heater_waits": _HEATER,
    "heater_kept": _HEATER,
    "thermostat": _THERMOSTAT,
    "thermostat_wall": _THERMOSTAT | {"inputs": {"setpoint": {"unit": "degC", "range": [15, 25], "start": 20}, **_AIR}},
    "thermostat_kept": _THERMOSTAT,
}
"""Fields of the reference of each in a pipeline of experiments."""
DURATIONS = {"gear": 8.0, "heater": 18000.0, "thermostat": 18000.0}
"""Seconds of a run, by the first word of the name."""
