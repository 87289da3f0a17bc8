"""What the compiled train is told and what it remembers: arrays in SI units, absolute pressures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

SMALLEST_DROP = 1e-6
"""Share of the pressure under which a conductance is that at this share: between equal pressures it has no value."""


class Constants(NamedTuple):
    """What the kernel needs to know; built by ``sysid.airbrake.simulate`` from consist and variant. SI, absolute."""

    atmosphere: float
    running: float
    pipe_area: float
    feed_area: float
    exhaust_area: float
    charge_auxiliary: float
    charge_emergency: float
    charge_action: float
    apply: float
    release: float
    accelerate_service: float
    accelerate_emergency: float
    bleed_action: float
    quick_service_area: float
    emergency_vent: float
    apply_drop: float
    release_rise: float
    service_drop: float
    emergency_drop: float
    lap_band: float
    command_drop: float
    empty_pipe: float
    per_pipe: float  # R T dt / V of each volume, in Pa per (kg/s)
    per_auxiliary: float
    per_emergency: float
    per_action: float
    gas_step: float  # R T dt, in J per (kg/s)
    cylinder_volume: float
    contact_volume: float
    contact_pressure: float
    stroke_pressure: float
    from_upstream: bool
    check_valve: bool
    quick_service: int  # 0 none, 1 command, 2 local
    quick_service_pressure: float
    latched_release: bool
    feed_closed_in_lap: bool
    graduating_lap: bool
    blowback_after_emergency: bool
    release_blocks_application: bool
    piston: bool
    relay: bool
    relay_band: float
    equalising_step: float
    exhaust_as_printed: bool
    pipe_momentum: bool
    momentum_step: float  # gamma dt S / L of the pipe of one vehicle, in kg/s per Pa
    leak_area: float  # m2 to the atmosphere in the pipe of every vehicle
    speed_gates: bool
    accelerated_service: bool
    accelerated_emergency: bool
    accelerated_application: bool
    graduated_release: bool
    first_fall: float  # of a distributor: pipe under the control reservoir that applies
    fall_gain: float  # cylinder Pa per Pa of fall
    cylinder_limit: float  # Pa gauge
    opening_band: float  # cylinder off what is wanted that opens the choke fully


class Table(NamedTuple):
    """Flow coefficient over sqrt(T), uniform in ``sqrt(1 - r)``; see ``sysid.airbrake.flow``."""

    values: Array
    slopes: Array


class State(NamedTuple):
    """Everything that has a memory. Arrays of length nodes, valves or ports, in place.

    ``pressures`` holds node pressures, then auxiliary, emergency, cylinder and action chamber of each valve.
    """

    pressures: Array
    content: Array  # P V of the cylinder in J
    port: Array  # head pressure of each further locomotive
    releasing: NDArray[np.bool_]
    tripped: NDArray[np.bool_]
    history: Array  # (delay steps, valves): pipe pressures of the past
    cursor: Integers  # (1,): row of the oldest
    flows: Array  # kg/s out of each node; remembered where the air has momentum


class Layout(NamedTuple):
    """Where the valves and the further locomotives sit: node indices from 0; what each valve's retainer holds."""

    valve_nodes: Integers
    port_nodes: Integers
    retained: Array  # Pa absolute under which no cylinder is emptied; 0 without a retainer


class Work(NamedTuple):
    """Scratch space: net flow into each node, sums of the watched pressures."""

    net: Array
    sums: Array


class Drive(NamedTuple):
    """What is done to the train, one value per output sample."""

    command: Array  # Pa absolute
    remote: Array  # the same as the further locomotives have it
    speed: Array  # m/s
    tail_area: Array  # m2 open to the atmosphere behind the last vehicle
