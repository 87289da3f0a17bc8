"""Slow models for the tests and benchmarks: named in a configuration as ``slow_models:thermal`` and so on.

Every worker imports this file: what takes a second to import is imported where it is used.
"""

from __future__ import annotations

import os
import tempfile
import time as clock
from collections.abc import Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STATES = 200
AREA, FILM = 2.0e-8 * 0.9, 1.5
"""Of the thermal network: what its cooled face radiates, in W/K⁴, and what both faces lose to the air, in W/K."""


def first_order(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A lag of the first order with an exact step: ``tau y' = u - y``."""
    a = float(np.exp(-(time[1] - time[0]) / parameters.get("tau", 1.0)))
    y, at = np.empty(len(time)), float(inputs[0, 0])
    for k, u in enumerate(inputs[:, 0]):
        at = a * at + (1.0 - a) * u
        y[k] = at
    return y


@cache
def _loaded() -> None:
    clock.sleep(0.2)


def loads(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """What compiles or reads much for its first run."""
    _loaded()
    return inputs[:, :1]


def released(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """The same, let go from a value that it has not stood at."""
    a = float(np.exp(-(time[1] - time[0]) / parameters["tau"]))
    y, at = np.empty(len(time)), parameters["from"]
    for k, u in enumerate(inputs[:, 0]):
        at = a * at + (1.0 - a) * u
        y[k] = at
    return y


def stiffens(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A lag behind a spring that stiffens: what it does far out, small experiments do not show."""
    y, at = np.empty(len(time)), 0.0
    for k, u in enumerate(inputs[:, 0]):
        at += 0.3 * (u - at - 0.3 * at**3)
        y[k] = at
    return y


def tanks(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Two tanks that feed each other: the upper drains into the lower one, and the less the fuller that is."""
    levels = np.zeros((len(time), 2))
    for t, pump in enumerate(inputs[:-1, 0], start=1):
        upper, lower = levels[t - 1]
        down = 0.15 * np.sqrt(max(upper - 0.3 * lower, 0.0))
        levels[t] = upper + 0.1 * pump - down, lower + down - 0.08 * lower
    return levels


def thermal(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A wall of 200 layers, heated on one side and cooled by radiation and convection on the other: stiff.

    Inputs: heat in W, surroundings in K. Outputs: temperature in K of the heated face and of the middle.
    """
    return thermal_run(float(time[1] - time[0]), inputs, parameters.get("conductivity", 1.0), 1e-6)


def wall(conductivity: float) -> tuple[Array, Array]:
    """Heat capacity of each layer of the wall in J/K, and what conducts from each to the next in W/K."""
    return np.geomspace(1.0, 60.0, STATES), np.full(STATES - 1, 400.0) * conductivity


def thermal_run(h: float, inputs: Array, conductivity: float, tolerance: float) -> Array:
    """The same, of any tolerance of the integration."""
    capacity, conduct = wall(conductivity)

    def slope(_: float, x: Array, heat: float, air: float) -> Array:
        flow = conduct * (x[:-1] - x[1:])
        d = np.zeros(STATES)
        d[:-1] -= flow
        d[1:] += flow
        d[0] += heat - FILM * (x[0] - air)
        d[-1] -= FILM * (x[-1] - air) + AREA * (x[-1] ** 4 - air**4)
        return d / capacity

    def jacobian(_: float, x: Array, heat: float, air: float) -> Array:
        j = np.zeros((STATES, STATES))
        i = np.arange(STATES - 1)
        j[i, i] -= conduct
        j[i, i + 1] += conduct
        j[i + 1, i + 1] -= conduct
        j[i + 1, i] += conduct
        j[0, 0] -= FILM
        j[-1, -1] -= FILM + 4.0 * AREA * x[-1] ** 3
        return j / capacity[:, np.newaxis]

    from scipy.integrate import solve_ivp

    x, found = np.full(STATES, 293.15), np.empty((len(inputs), 2))
    for k, (heat, air) in enumerate(inputs):
        # SciPy's BDF takes differences of rows that it has not written yet: what lay there may be no number.
        with np.errstate(invalid="ignore", over="ignore"):
            done = solve_ivp(slope, (0.0, h), x, "BDF", args=(heat, air), jac=jacobian, rtol=tolerance, atol=tolerance)
        x = done.y[:, -1]
        found[k] = x[0], x[STATES // 2]
    return found


def cylinder(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A hydraulic cylinder behind a proportional valve, with friction and end stops; input in V, output in mm."""
    return cylinder_run(float(time[1] - time[0]), inputs, parameters.get("mass", 200.0))


def cylinder_run(h: float, inputs: Array, mass: float) -> Array:
    """The same of numbers alone, which ``compiled_models`` compiles."""
    supply, stroke, area, volume, bulk, gain = 100e5, 0.3, 1.2e-3, 4e-4, 1.2e9, 1.5e-7
    steps = max(1, round(h / 1e-4))
    position, speed, pressure, found, dt = 0.15, 0.0, 0.0, np.empty(len(inputs)), h / steps
    for k, volts in enumerate(inputs[:, 0]):
        for _ in range(steps):
            flow = gain * volts * np.sqrt(max(supply - np.sign(volts) * pressure, 0.0)) * 0.1
            pressure += dt * 4.0 * bulk / volume * (flow - area * speed - 3e-13 * pressure)
            stop = 1e8 * (max(-position, 0.0) - max(position - stroke, 0.0))
            stop -= 1e5 * speed if not 0.0 < position < stroke else 0.0
            friction = 400.0 * np.tanh(speed / 2e-3) + 2500.0 * speed
            speed += dt * (area * pressure - friction + stop) / mass
            position += dt * speed
        found[k] = 1e3 * position
    return found


def spindle(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A motor on a spindle that carries a slide between two stops, which stop it dead; input in V, output in mm.

    Coulomb friction holds the slide until the motor pulls harder; the load is a spring-like seal towards one end.
    """
    return spindle_run(float(time[1] - time[0]), inputs)


def spindle_run(h: float, inputs: Array) -> Array:
    """The same of numbers alone."""
    stroke, speed, place, current = 80.0, 0.0, 40.0, 0.0
    steps, found = max(1, round(h / 1e-3)), np.empty(len(inputs))
    dt = h / steps
    for k, volts in enumerate(inputs[:, 0]):
        for _ in range(steps):
            current += dt / 0.02 * ((volts - 0.08 * speed) / 2.0 - current)
            force = current - 0.006 * max(place - 50.0, 0.0)
            held = 0.3
            if speed == 0.0 and abs(force) <= held:
                continue
            rubbing = held * np.sign(speed if speed else force)
            faster = speed + dt * (force - rubbing - 0.002 * speed) / 0.004
            speed = 0.0 if speed * faster < 0.0 else faster
            place += dt * speed
            if not 0.0 <= place <= stroke:
                place, speed = min(max(place, 0.0), stroke), 0.0
        found[k] = place
    return found


def basin(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A basin that is filled and drained by pumps, runs over at its edge and can run dry; inputs in V, output in m."""
    return basin_run(float(time[1] - time[0]), inputs)


def basin_run(h: float, inputs: Array) -> Array:
    """The same of numbers alone."""
    level, filling, steps, found = 1.0, 0.0, max(1, round(h / 0.1)), np.empty(len(inputs))
    dt = h / steps
    for k in range(len(inputs)):
        fill, drain = inputs[k, 0], inputs[k, 1]
        for _ in range(steps):
            filling += dt / 3.0 * (max(fill - 1.0, 0.0) - filling)
            area = 4.0 + 1.5 * level
            level += dt * (0.05 * filling - 0.04 * drain * np.sqrt(1.0 + 0.3 * level)) / area
            level = min(max(level, 0.0), 2.0)
        found[k] = level
    return found


def hangs(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Is never done where the input goes above 1."""
    while inputs.max() > 1.0:
        clock.sleep(0.05)
    return inputs[:, :1]


def remembers(time: Array, inputs: Array, parameters: Mapping[str, float], runs: list[float] = []) -> Array:  # noqa: B006
    """Gives more with each run."""
    runs.append(1.0)
    return inputs[:, :1] + len(runs)


def crashes(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Takes its process down where the input goes above 1."""
    if inputs.max() > 1.0:
        os.abort()
    return inputs[:, :1]


def ends_itself(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Is ended by a signal, as if somebody had sent it."""
    os.kill(os.getpid(), int(parameters["signal"]))
    clock.sleep(60.0)
    return inputs[:, :1]


def leaves_numbers(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Is not a number from 10 s on where the input goes above 1."""
    y = inputs[:, 0].copy()
    if inputs.max() > 1.0:
        y[time >= 10.0] = np.nan
    return y


def rubbish(time: Array, inputs: Array, parameters: Mapping[str, float]) -> object:
    """Gives words where the input goes above 1."""
    return "rubbish" if inputs.max() > 1.0 else inputs[:, :1]


def litters(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Leaves temporary files behind, as everything does that is ended in the middle."""
    tempfile.mkdtemp()
    return inputs[:, :1]


def raises(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Fails where the input goes above 1, and prints on the way."""
    print('{"reason": null, "cpu_s": 0}')  # noqa: T201 - not to be taken for an answer
    if inputs.max() > 1.0:
        raise ValueError("valve jammed")
    return inputs[:, :1]


def counted(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Writes down that it was run, once a run, and takes its time."""
    with open(os.environ["SYSID_TEST_COUNT"], "a", encoding="utf-8") as file:  # noqa: PTH123
        file.write(f"{inputs.sum():.12g}\n")
    clock.sleep(0.05)
    return inputs[:, :1]


def stands_still(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """Answers nothing."""
    return np.full(len(inputs), 5.0)


def gives(time: Array, inputs: Array, parameters: Mapping[str, float]) -> object:
    """What somebody's function may give for a record of two outputs; the number of ``how`` says what."""
    import pandas as pd

    y, z = 0.5 * inputs[:, 0], 100.0 * inputs[:, 0]
    both = np.column_stack([y, z])
    return [
        lambda: pd.DataFrame({"z": z, "y": y}),
        lambda: {"z": z.tolist(), "y": y.astype(np.float32)},
        both.tolist,
        lambda: both.astype(np.float32),
        lambda: pd.DataFrame(both),
        lambda: both + 0j,
        lambda: both + 1j,
        lambda: pd.DataFrame({"a": z, "y": y}),
        lambda: np.ma.masked_array(both, mask=both > 60.0),
        lambda: [[str(one) for one in row] for row in both],
        lambda: both[:-1],
        lambda: {"y": y, "z": z[:-1]},
        lambda: None,
    ][int(parameters["how"])]()


def two_arguments(inputs: NDArray[np.float64], sample_time: float = 0.1) -> NDArray[np.float64]:
    """What a user's own function looks like: no times, no parameters."""
    return inputs * sample_time


NO_FUNCTION = 3


def block(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A block on a table behind a spring that is pulled, which sticks with 6 N and slips with 4.

    Input: the pull in m/s. Outputs: the block's place in m, the spring's force in N.
    """
    return block_run(float(time[1] - time[0]), inputs)


def block_run(h: float, inputs: Array) -> Array:
    """The same of numbers alone."""
    dt, place, speed, end, found = h / 200, 0.0, 0.0, 0.0, np.empty((len(inputs), 2))
    for k, pull in enumerate(inputs[:, 0]):
        for _ in range(200):
            end += dt * pull
            spring = 20.0 * (end - place)
            rubs = 4.0 + 2.0 * np.exp(-((speed / 0.05) ** 2))
            if speed == 0.0 and abs(spring) <= rubs:
                continue
            faster = speed + dt * (spring - 0.5 * speed - rubs * np.sign(speed if speed else spring))
            speed = 0.0 if speed * faster < 0.0 else faster
            place += dt * speed
        found[k] = place, 20.0 * (end - place)
    return found


def valve(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """A tank that runs over, drained by a valve whose stem sticks.

    Inputs: inflow in m3/s, the valve's command from 0 to 1. Outputs: level in m, outflow in m3/s.
    """
    return valve_run(float(time[1] - time[0]), inputs)


def valve_run(h: float, inputs: Array) -> Array:
    """The same of numbers alone."""
    dt, level, stem, outflow, found = h / 200, 0.3, 0.0, 0.0, np.empty((len(inputs), 2))
    for k in range(len(inputs)):
        inflow, command = inputs[k, 0], inputs[k, 1]
        for _ in range(200):
            stem = min(max(stem, command - 0.06), command + 0.06)
            outflow = 0.02 * min(max(stem, 0.0), 1.0) * np.sqrt(19.62 * level)
            level = max(level + dt * (inflow - outflow - 0.5 * max(level - 1.0, 0.0) ** 1.5) / 0.5, 0.0)
        found[k] = level, outflow
    return found
