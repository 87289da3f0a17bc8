"""A train under way: state that may be advanced in chunks, guarded against unstable steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake import kernel
from sysid.airbrake.consist import TEMPERATURE, Consist
from sysid.airbrake.constants import kernel_constants
from sysid.airbrake.flow import GAS_CONSTANT, FlowTable, flow_table
from sysid.airbrake.kernel_arrays import Drive, Layout, State, Table, Work
from sysid.airbrake.variant import Variant
from sysid.errors import ConfigError, StabilityError
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA

QUANTITIES = ("pipe", "auxiliary", "emergency", "cylinder", "action")
"""What can be recorded: the pipe at any node, the others at a node with a valve."""


@dataclass(frozen=True, kw_only=True)
class Probe:
    """A pressure to record.

    Args:
        quantity: One of :data:`QUANTITIES`.
        node: Node number from 1 (the leading locomotive).
    """

    quantity: str
    node: int


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


def _stable_part(sample_time: float, largest: float) -> str:
    """A step in s that is stable and divides a sample, of two digits where there is one."""
    least = max(1, math.ceil(sample_time / largest))
    parts = [f"{sample_time / steps:.2g}" for steps in range(least, 3 * least)]
    whole = (part for steps, part in enumerate(parts, start=least) if math.isclose(float(part) * steps, sample_time))
    return next(whole, f"{sample_time / least:.12g}")


def _steps_per_sample(
    time_step: float, sample_time: float, consist: Consist, variant: Variant, table: FlowTable
) -> int:
    largest = largest_stable_step(consist, variant, table)
    if not 0.0 < time_step <= largest:
        raise StabilityError(
            "the time step is too large for this train",
            where="time_step",
            expected=f"at most {largest * 1e3:.3g} ms",
            got=f"{time_step * 1e3:g} ms",
            remedy=f"use time_step {_stable_part(sample_time, largest)} s, or a shorter one that divides the sample",
        )
    steps = round(sample_time / time_step) if math.isfinite(sample_time) else 0
    if steps < 1 or not math.isclose(steps * time_step, sample_time, rel_tol=1e-9):
        raise StabilityError(
            "a sample does not hold a whole number of time steps",
            where="sample_time",
            expected=f"a multiple of {time_step:g} s",
            got=f"{sample_time:g} s",
            remedy="choose a time_step that divides the sample time",
        )
    return steps


def _charged_state(consist: Consist, variant: Variant, dt: float) -> State:
    """State of a train that is charged throughout, with empty cylinders and the valves released."""
    nodes, valves = consist.vehicles, consist.pairs
    pressures = np.full(nodes + 4 * valves, consist.charged)
    pressures[nodes + 2 * valves : nodes + 3 * valves] = STANDARD_ATMOSPHERE_PA
    content = 0.0 if variant.piston else STANDARD_ATMOSPHERE_PA * consist.cylinder.volume
    delay = max(1, round(variant.rising_delay / dt))
    return State(
        pressures=pressures,
        content=np.full(valves, content),
        port=np.full(len(consist.port_nodes), consist.charged),
        releasing=np.full(valves, variant.latched_release),
        tripped=np.zeros(valves, dtype=np.bool_),
        history=np.full((delay, valves), consist.charged),
        cursor=np.zeros(1, dtype=np.int64),
        flows=np.zeros(nodes),
    )


def _stored_air(state: State, consist: Consist) -> float:
    """Air in the train behind the leading locomotive, as P V in J, the sum over all volumes."""
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
    # A copy: what cannot be written is another type of argument, for which the kernel would be compiled once more.
    return np.array(np.broadcast_to(array, (count,)), order="C")


class BrakedTrain:
    """The air brake of a train, advanced sample by sample or many samples at once.

    Args:
        consist: The train.
        variant: The reading of the model.
        time_step: Step of the explicit scheme in s.
        sample_time: Output step in s, a whole number of steps.
        probes: Pressures to record.
        table: Flow table in place of the formula's.

    Raises:
        ConfigError: If a probe is not there.
        StabilityError: If the time step is too large, naming the largest one that is not.
    """

    def __init__(
        self,
        *,
        consist: Consist,
        variant: Variant,
        probes: tuple[Probe, ...],
        time_step: float = 1e-3,
        sample_time: float = 0.1,
        table: FlowTable | None = None,
    ) -> None:
        table = flow_table(laminar_ratio=variant.laminar_ratio) if table is None else table
        self.consist = consist
        self._steps = _steps_per_sample(time_step, sample_time, consist, variant, table)
        self.state = _charged_state(consist, variant, time_step)
        self.gained = 0.0
        self._watch = _watch(probes, consist)
        self._constants = kernel_constants(consist, variant, time_step)
        root = math.sqrt(TEMPERATURE)
        self._table = Table(values=table.values / root, slopes=table.slopes / root)
        self._layout = Layout(
            valve_nodes=np.array(consist.valve_nodes, dtype=np.int64) - 1,
            port_nodes=np.array(consist.port_nodes, dtype=np.int64) - 1,
            retained=np.array(
                [psi * PSI_IN_PA + STANDARD_ATMOSPHERE_PA if psi else 0.0 for psi in consist.retained_by_pairs]
            ),
        )
        shares = [
            consist.load_of_pairs[consist.valve_nodes.index(p.node)] if p.quantity == "cylinder" else 1.0
            for p in probes
        ]
        self._shares = None if all(share == 1.0 for share in shares) else np.array(shares)
        nodes = consist.vehicles
        self._work = Work(net=np.zeros(nodes), sums=np.zeros(len(probes)))

    @property
    def stored(self) -> float:
        """Air in the train behind the leading locomotive, as P V in J."""
        return _stored_air(self.state, self.consist)

    def advance(
        self,
        command: NDArray[np.float64],
        *,
        speed: NDArray[np.float64] | float = 1.0,
        tail_vent: NDArray[np.float64] | float = 0.0,
        remote: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Advance by as many samples as there are commands.

        Args:
            command: Handle in psi gauge at each sample, shape ``(n,)``, not above the running pressure.
            speed: Speed in m/s, one number or one per sample.
            tail_vent: Area in m2 open behind the last vehicle, one number or one per sample.
            remote: What the further locomotives have heard of the handle, shape ``(n,)``; the handle itself by default.

        Returns:
            Pressures in Pa absolute, averaged over each sample, shape ``(n, n_probes)``.

        Raises:
            ConfigError: If the command exceeds the running pressure, or the shapes do not fit.
            StabilityError: If the step is too long for a choke, so that pressures are lost.
        """
        handle = _per_sample(command, len(command), "command")
        heard = handle if remote is None else _per_sample(remote, len(handle), "remote")
        if max(handle.max(initial=0.0), heard.max(initial=0.0)) > self.consist.running_pressure:
            raise ConfigError(
                "the command exceeds the running pressure",
                where="command",
                expected=f"at most {self.consist.running_pressure:g} psi gauge",
                got=f"{handle.max():g} psi",
                remedy="raise running_pressure or lower the command",
            )
        drive = Drive(
            command=handle * PSI_IN_PA + STANDARD_ATMOSPHERE_PA,
            remote=heard * PSI_IN_PA + STANDARD_ATMOSPHERE_PA,
            speed=_per_sample(speed, len(handle), "speed"),
            tail_area=_per_sample(tail_vent, len(handle), "tail_vent"),
        )
        output = np.empty((len(handle), len(self._watch)))
        self.gained += kernel.advance(
            self.state, self._layout, drive, self._steps, self._watch, output, self._constants, self._table, self._work
        )
        if not np.isfinite(output).all():
            raise StabilityError(
                "the simulation has lost its pressures", where="time_step",
                expected="chokes and volumes that a step resolves", got="pressures that are not finite",
                remedy="shorten time_step, or correct the areas and volumes of the train",
            )  # fmt: skip
        if self._shares is not None:
            output = STANDARD_ATMOSPHERE_PA + self._shares * (output - STANDARD_ATMOSPHERE_PA)
        return output
