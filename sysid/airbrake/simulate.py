"""One way in: a command, a consist and a variant make a record of pressures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake import kernel
from sysid.airbrake.command import Command
from sysid.airbrake.consist import TEMPERATURE, Consist
from sysid.airbrake.flow import GAS_CONSTANT, FlowTable, flow_table
from sysid.airbrake.variant import PHYSICAL, QuickService, Variant
from sysid.errors import ConfigError, StabilityError
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA

QUANTITIES = ("pipe", "auxiliary", "emergency", "cylinder", "action")
"""What can be recorded: the pipe at any node, the others at a node with a valve."""

_QUICK_SERVICE = {QuickService.NONE: 0, QuickService.COMMAND: 1, QuickService.LOCAL: 2}


@dataclass(frozen=True, kw_only=True)
class Probe:
    """A pressure to record.

    Args:
        quantity: One of :data:`QUANTITIES`.
        node: Node number from 1 (the leading locomotive).
    """

    quantity: str
    node: int


@dataclass(frozen=True, kw_only=True, eq=False)
class AirBrakeRecord:
    """Pressures over time, averaged over each sample.

    Args:
        sample_time: Seconds between samples.
        probes: What the columns are.
        pressures: Pa absolute, shape ``(n_samples, n_probes)``.
        command: Psi gauge at the handle, shape ``(n_samples,)``.
        gained: Air that entered the train, as P V in J.
        stored: Air in the train, as P V in J, before and after.
    """

    sample_time: float
    probes: tuple[Probe, ...]
    pressures: NDArray[np.float64]
    command: NDArray[np.float64]
    gained: float
    stored: tuple[float, float]

    def __getitem__(self, probe: tuple[str, int]) -> NDArray[np.float64]:
        wanted = Probe(quantity=probe[0], node=probe[1])
        if wanted not in self.probes:
            raise ConfigError(
                f"{wanted.quantity} at node {wanted.node} was not recorded",
                expected=", ".join(f"{p.quantity} {p.node}" for p in self.probes),
                got=probe,
            )
        return self.pressures[:, self.probes.index(wanted)]

    def gauge_psi(self, quantity: str, node: int) -> NDArray[np.float64]:
        """One column in psi gauge, shape ``(n_samples,)``.

        Args:
            quantity: One of :data:`QUANTITIES`.
            node: Node number from 1.

        Returns:
            The pressure.

        Raises:
            ConfigError: If it was not recorded.
        """
        return (self[quantity, node] - STANDARD_ATMOSPHERE_PA) / PSI_IN_PA


def all_probes(consist: Consist) -> tuple[Probe, ...]:
    """Every pressure of a train.

    Args:
        consist: The train.

    Returns:
        The pipe at every node, then the other quantities at every valve.
    """
    pipe = [Probe(quantity="pipe", node=node) for node in range(1, consist.vehicles + 1)]
    rest = [Probe(quantity=quantity, node=node) for quantity in QUANTITIES[1:] for node in consist.valve_nodes]
    return (*pipe, *rest)


def largest_stable_step(consist: Consist, variant: Variant, table: FlowTable) -> float:
    """The largest time step in s for which a simulation can be trusted.

    With a laminar branch the pipe is a chain of linear exchanges near rest, and the explicit scheme is stable up to
    a diffusion number of one half. Without one no step is stable: neighbours swing with an amplitude that grows with
    the square of the step. It may reach a quarter of the pressure difference that applies the brakes; at 2 ms it
    opens valves by itself.

    Args:
        consist: The train.
        variant: The variant.
        table: Its flow table.

    Returns:
        Seconds.
    """
    per_second = GAS_CONSTANT * TEMPERATURE / consist.pipe.volume * consist.pipe.area / math.sqrt(TEMPERATURE)
    if variant.laminar_ratio is not None:
        return 0.5 / (per_second * table.steepest)
    edge = 1e-4
    root = float(table(np.array(1.0 - edge))) / math.sqrt(edge)  # kappa ~ root * sqrt(1 - r)
    amplitude = 0.25 * consist.valve.apply_drop / consist.charged
    return 0.5 * math.sqrt(amplitude) / (per_second * root)


def _check_step(time_step: float, sample_time: float, consist: Consist, variant: Variant, table: FlowTable) -> int:
    largest = largest_stable_step(consist, variant, table)
    if not 0.0 < time_step <= largest:
        raise StabilityError(
            "the time step is too large for this train",
            where="time_step",
            expected=f"at most {largest * 1e3:.3g} ms",
            got=f"{time_step * 1e3:g} ms",
            remedy="use 1 ms or less",
        )
    steps = round(sample_time / time_step)
    if steps < 1 or not math.isclose(steps * time_step, sample_time, rel_tol=1e-9):
        raise StabilityError(
            "a sample does not hold a whole number of time steps",
            where="sample_time",
            expected=f"a multiple of {time_step:g} s",
            got=f"{sample_time:g} s",
            remedy="choose a time_step that divides the sample time",
        )
    return steps


def _constants(consist: Consist, variant: Variant, dt: float) -> kernel.Constants:
    valve, cylinder, atmosphere = consist.valve, consist.cylinder, STANDARD_ATMOSPHERE_PA
    gas_step = GAS_CONSTANT * TEMPERATURE * dt
    rate = math.inf if variant.equalising_rate is None else variant.equalising_rate
    return kernel.Constants(
        atmosphere=atmosphere,
        running=consist.charged,
        pipe_area=consist.pipe.area,
        feed_area=consist.head.feed_area,
        exhaust_area=consist.head.exhaust_area,
        charge_auxiliary=valve.charge_auxiliary,
        charge_emergency=valve.charge_emergency,
        charge_action=valve.charge_action,
        apply=valve.apply,
        release=valve.release,
        accelerate_service=valve.accelerate_service,
        accelerate_emergency=valve.accelerate_emergency,
        bleed_action=valve.bleed_action,
        quick_service_area=valve.quick_service,
        emergency_vent=valve.emergency_vent,
        apply_drop=valve.apply_drop,
        release_rise=valve.release_rise,
        service_drop=valve.service_drop,
        emergency_drop=valve.emergency_drop,
        lap_band=valve.lap_band,
        command_drop=valve.command_drop,
        empty_pipe=valve.empty_pipe,
        per_pipe=gas_step / consist.pipe.volume,
        per_auxiliary=gas_step / valve.auxiliary_volume,
        per_emergency=gas_step / valve.emergency_volume,
        per_action=gas_step / valve.action_volume,
        gas_step=gas_step,
        cylinder_volume=cylinder.volume,
        contact_volume=cylinder.contact_volume,
        contact_pressure=cylinder.contact_pressure + atmosphere,
        stroke_pressure=cylinder.stroke_pressure + atmosphere,
        from_upstream=variant.charge_from_upstream,
        check_valve=variant.emergency_check_valve,
        quick_service=_QUICK_SERVICE[variant.quick_service],
        quick_service_pressure=variant.quick_service_limit + atmosphere,
        latched_release=variant.latched_release,
        feed_closed_in_lap=variant.feed_closed_in_lap,
        graduating_lap=variant.graduating_lap,
        blowback_after_emergency=variant.blowback_after_emergency,
        release_blocks_application=variant.release_blocks_application,
        piston=variant.piston,
        relay=variant.relay_band is not None,
        relay_band=variant.relay_band or 1.0,
        equalising_step=rate * dt,
        speed_gates=variant.speed_gates,
        accelerated_service=variant.accelerated_service,
        accelerated_emergency=variant.accelerated_emergency,
    )


def _charged_state(consist: Consist, variant: Variant, dt: float) -> kernel.State:
    nodes, valves = consist.vehicles, consist.pairs
    pressures = np.full(nodes + 4 * valves, consist.charged)
    pressures[nodes + 2 * valves : nodes + 3 * valves] = STANDARD_ATMOSPHERE_PA
    content = 0.0 if variant.piston else STANDARD_ATMOSPHERE_PA * consist.cylinder.volume
    delay = max(1, round(variant.rising_delay / dt))
    return kernel.State(
        pressures=pressures,
        content=np.full(valves, content),
        port=np.full(len(consist.port_nodes), consist.charged),
        releasing=np.full(valves, variant.latched_release),
        tripped=np.zeros(valves, dtype=np.bool_),
        history=np.full((delay, valves), consist.charged),
        cursor=np.zeros(1, dtype=np.int64),
    )


def _stored(state: kernel.State, consist: Consist) -> float:
    nodes, valves = consist.vehicles, consist.pairs
    x, valve = state.pressures, consist.valve
    reservoirs = x[nodes:].reshape(4, valves).sum(axis=1)
    return float(
        consist.pipe.volume * x[1:nodes].sum()
        + valve.auxiliary_volume * reservoirs[0]
        + valve.emergency_volume * reservoirs[1]
        + valve.action_volume * reservoirs[3]
        + state.content.sum()
    )


def _watch(probes: tuple[Probe, ...], consist: Consist) -> NDArray[np.int64]:
    nodes, valves = consist.vehicles, consist.pairs
    indices = []
    for probe in probes:
        places = range(1, nodes + 1) if probe.quantity == "pipe" else consist.valve_nodes
        if probe.quantity not in QUANTITIES or probe.node not in places:
            raise ConfigError(
                f"there is no {probe.quantity} pressure at node {probe.node}",
                where="probes",
                expected=f"pipe at 1 to {nodes}; {', '.join(QUANTITIES[1:])} at a valve's node 3, 5, ...",
                got=f"{probe.quantity} at {probe.node}",
                remedy="the first valve sits at node 3",
            )
        block = QUANTITIES.index(probe.quantity)
        offset = probe.node - 1 if block == 0 else nodes + (block - 1) * valves + places.index(probe.node)
        indices.append(offset)
    return np.array(indices, dtype=np.int64)


def _per_sample(values: NDArray[np.float64] | float, count: int, name: str) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.shape not in ((), (count,)) or not np.isfinite(array).all() or np.any(array < 0.0):
        raise ConfigError(
            f"{name} does not fit the record",
            where=name,
            expected=f"one number, or {count} of them, none negative",
            got=f"shape {array.shape}",
        )
    return np.ascontiguousarray(np.broadcast_to(array, (count,)))


def simulate(
    command: Command,
    *,
    consist: Consist | None = None,
    variant: Variant = PHYSICAL,
    probes: tuple[Probe, ...] | None = None,
    time_step: float = 1e-3,
    sample_time: float = 0.1,
    speed: NDArray[np.float64] | float = 1.0,
    tail_vent: NDArray[np.float64] | float = 0.0,
    table: FlowTable | None = None,
) -> AirBrakeRecord:
    """Simulate the air brake of a train that starts charged, with empty cylinders.

    Args:
        command: The driver's handle.
        consist: The train; 50 wagon pairs if not given.
        variant: The reading of the model.
        probes: Pressures to record; all of them if not given.
        time_step: Step of the explicit scheme in s.
        sample_time: Output step in s; each sample is the mean over its steps.
        speed: Speed of the train in m/s, one number or one per sample; matters to ``speed_gates`` only.
        tail_vent: Area in m2 open to the atmosphere behind the last vehicle (an end-of-train valve), one number
            or one per sample.
        table: Flow table in place of the formula's.

    Returns:
        The record.

    Raises:
        ConfigError: If the command exceeds the running pressure or a probe is not there.
        StabilityError: If the time step is too large, with the largest one that is not.

    Example:
        >>> minimum = Command.from_rows([[0, 90], [1, 84.2], [20, 84.2]])
        >>> record = simulate(minimum, consist=Consist(pairs=1), probes=(Probe(quantity="cylinder", node=3),))
        >>> bool(record.gauge_psi("cylinder", 3)[-1] > 8.0)
        True
    """
    consist = Consist() if consist is None else consist
    table = flow_table(laminar_ratio=variant.laminar_ratio) if table is None else table
    steps = _check_step(time_step, sample_time, consist, variant, table)
    if max(command.pressures) > consist.running_pressure:
        raise ConfigError(
            "the command exceeds the running pressure",
            where="command",
            expected=f"at most {consist.running_pressure:g} psi gauge",
            got=f"{max(command.pressures):g} psi",
            remedy="raise running_pressure or lower the command",
        )
    probes = all_probes(consist) if probes is None else tuple(probes)
    handle = command.sampled(sample_time=sample_time)
    drive = kernel.Drive(
        command=handle * PSI_IN_PA + STANDARD_ATMOSPHERE_PA,
        speed=_per_sample(speed, len(handle), "speed"),
        tail_area=_per_sample(tail_vent, len(handle), "tail_vent"),
    )
    layout = kernel.Layout(
        valve_nodes=np.array(consist.valve_nodes, dtype=np.int64) - 1,
        port_nodes=np.array(consist.port_nodes, dtype=np.int64) - 1,
    )
    root = math.sqrt(TEMPERATURE)
    compiled_table = kernel.Table(values=table.values / root, slopes=table.slopes / root)
    state = _charged_state(consist, variant, time_step)
    watch = _watch(probes, consist)
    output = np.empty((len(handle), len(watch)))
    before = _stored(state, consist)
    constants = _constants(consist, variant, time_step)
    work = kernel.Work(flows=np.zeros(consist.vehicles), net=np.zeros(consist.vehicles), sums=np.zeros(len(watch)))
    gained = kernel.advance(state, layout, drive, steps, watch, output, constants, compiled_table, work)
    return AirBrakeRecord(
        sample_time=sample_time,
        probes=probes,
        pressures=output,
        command=handle,
        gained=float(gained),
        stored=(before, _stored(state, consist)),
    )
