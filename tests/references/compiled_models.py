"""The slow models compiled: the same numbers, so fast that 1,000 of their runs can be had."""

from __future__ import annotations

from collections.abc import Mapping

import compiled_thermal
import loop_models
import numpy as np
import slow_models
from numba import njit
from slow_models import Array

_cylinder, _spindle, _basin = map(njit, (slow_models.cylinder_run, slow_models.spindle_run, slow_models.basin_run))
_block, _valve = map(njit, (slow_models.block_run, slow_models.valve_run))


def thermal(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``slow_models:thermal``, but for what its integration is off."""
    return compiled_thermal.thermal_run(float(time[1] - time[0]), inputs, parameters.get("conductivity", 1.0))


def cylinder(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``slow_models:cylinder``."""
    return _cylinder(time[1] - time[0], np.ascontiguousarray(inputs), parameters.get("mass", 200.0))


def spindle(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``slow_models:spindle``."""
    return _spindle(time[1] - time[0], np.ascontiguousarray(inputs))


def basin(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``slow_models:basin``."""
    return _basin(time[1] - time[0], np.ascontiguousarray(inputs))


def block(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``slow_models:block``."""
    return _block(time[1] - time[0], np.ascontiguousarray(inputs))


def valve(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``slow_models:valve``."""
    return _valve(time[1] - time[0], np.ascontiguousarray(inputs))


_gear, _heater, _thermostat = map(njit, (loop_models.gear_run, loop_models.heater_run, loop_models.thermostat_run))


def gear(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:gear``."""
    return _gear(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.GEARS[0])[:, :1]


def gear_place(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:gear_place``."""
    return _gear(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.GEARS[1])[:, 1:]


def gear_kept(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:gear_kept``."""
    return _gear(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.GEARS[2])[:, :2]


def heater(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:heater``."""
    return _heater(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.HEATERS[0])


def heater_waits(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:heater_waits``."""
    return _heater(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.HEATERS[1])


def heater_kept(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:heater_kept``."""
    return _heater(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.HEATERS[2])


def thermostat(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:thermostat``."""
    return _thermostat(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.THERMOSTATS[0])


def thermostat_wall(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:thermostat_wall``."""
    return _thermostat(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.THERMOSTATS[1])


def thermostat_kept(time: Array, inputs: Array, parameters: Mapping[str, float]) -> Array:
    """As ``loop_models:thermostat_kept``."""
    return _thermostat(time[1] - time[0], np.ascontiguousarray(inputs), loop_models.THERMOSTATS[2])
