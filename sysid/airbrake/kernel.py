"""The compiled explicit scheme: one step of every vehicle per millisecond, averaged to the output's samples.

The equations are those of the dissertation's Appendix C ("Freio_V02"), written as flows: all right-hand
sides use the pressures of the previous step. ``sysid.airbrake.reference`` is the same step written plainly;
tests hold the two together for every switch. Tables and areas arrive multiplied by 1 / sqrt(T).

State is a set of arrays changed in place, so that a caller may advance in chunks.
"""

from __future__ import annotations

from math import sqrt

import numba
import numpy as np

from sysid.airbrake.kernel_arrays import SMALLEST_DROP, Array, Constants, Drive, Integers, Layout, State, Table, Work
from sysid.own_folders import keep_kernels_where_it_is_allowed

keep_kernels_where_it_is_allowed()


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _coefficient(low, high, values, slopes):
    """Cq Cm / sqrt(T) at a ratio of pressures."""
    last = len(values) - 1
    position = sqrt(1.0 - low / high) * last
    if not position <= last:  # a pressure below a vacuum, or none any more: as an index it is outside of the table
        return np.nan
    index = np.uintp(int(position))  # unsigned: numba then leaves out the test for indices from the end
    return values[index] + (position - index) * slopes[index]


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _flow(area, p, q, values, slopes):
    """Mass flow in kg/s through an area from p to q, negative if q is the higher."""
    if p > q:
        return area * _coefficient(q, p, values, slopes) * p
    return -area * _coefficient(p, q, values, slopes) * q


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _charge(area, p, q, c, values, slopes):
    """Charging flow from p to the lower q; the print multiplies by the wrong one of the two."""
    return area * _coefficient(q, p, values, slopes) * (p if c.from_upstream else q)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _head_flow(head, local, emergency, c, values, slopes):
    """Flow from a head valve into the pipe beside it."""
    if c.relay:
        if emergency:
            return -_flow(2.0 * c.exhaust_area, local, c.atmosphere, values, slopes)
        if head > local:
            return _flow(c.feed_area, head, local, values, slopes)
        opening = min(1.0, (local - head) / c.relay_band)
        return -_flow(opening * c.exhaust_area, local, c.atmosphere, values, slopes)
    if head > local:
        return _flow(c.feed_area, head, local, values, slopes)
    return _flow(2.0 * c.exhaust_area if emergency else c.exhaust_area, head, local, values, slopes)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _head_pressure(head, sensed, command, moving, c):
    """Pressure that a head valve holds after this step."""
    if command > c.running or not moving:
        return c.running
    if c.relay:
        if command <= c.atmosphere:
            return c.atmosphere
        return max(command, head - c.equalising_step) if command < head else command
    return c.atmosphere if sensed > command else command


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _vent(p, pc, ps, emergency, command, moving, c, values, slopes):
    """Pipe to atmosphere at one valve: emergency vent or quick service."""
    if emergency:
        return _flow(c.emergency_vent, p, c.atmosphere, values, slopes) if moving else 0.0
    if c.quick_service == 2:
        if ps - p >= 2.0 * c.service_drop and (c.accelerated_application or pc < c.quick_service_pressure):
            return _flow(c.quick_service_area, p, c.atmosphere, values, slopes)
        return 0.0
    if p <= c.atmosphere and command < c.running and moving:
        return _flow(c.emergency_vent, p, c.atmosphere, values, slopes)
    if c.quick_service == 1 and p - command > c.command_drop and moving:
        return _flow(c.charge_action, p, c.atmosphere, values, slopes)
    return 0.0


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _service_opening(drop, releasing, c):
    """Share of the passage from auxiliary to cylinder that is open."""
    if not c.graduating_lap:
        return 1.0 if drop > c.apply_drop else 0.0
    if releasing or drop <= 0.0:
        return 0.0
    return min(1.0, drop / c.service_drop)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _cylinder_open(p, before, releasing, command, moving, c):
    """Whether the cylinder is open to the atmosphere."""
    if releasing or c.latched_release:
        return releasing
    if moving and p < before:
        return False
    return not (command - c.lap_band <= p <= command + 2.0 * c.lap_band or p <= c.empty_pipe)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _cylinder_pressure(content, c):
    """Pressure of a cylinder from its content P V."""
    if not c.piston or content >= c.stroke_pressure * c.cylinder_volume:
        return content / c.cylinder_volume
    if content < c.contact_pressure * c.contact_volume:
        # V = k (P - Patm): a quadratic in P.
        k = c.contact_volume / (c.contact_pressure - c.atmosphere)
        return 0.5 * (c.atmosphere + sqrt(c.atmosphere * c.atmosphere + 4.0 * content / k))
    k = (c.cylinder_volume - c.contact_volume) / (c.stroke_pressure - c.contact_pressure)
    b = c.contact_volume - k * c.contact_pressure
    return (sqrt(b * b + 4.0 * k * content) - b) / (2.0 * k)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _distributor(j, p, x, content, releasing, retained, nodes, valves, c, values, slopes):
    """Advance distributor j of graduated release; returns what a valve does."""
    at_a, at_c, at_s = nodes + j, nodes + 2 * valves + j, nodes + 3 * valves + j
    pa, pc, ps = x[at_a], x[at_c], x[at_s]
    fall = ps - p
    if fall > c.first_fall:
        releasing[j] = False
    elif fall < 0.5 * c.first_fall:
        releasing[j] = True
    wanted = c.atmosphere if releasing[j] else c.atmosphere + min(c.cylinder_limit, max(0.0, c.fall_gain * fall))
    to_s = _flow(c.charge_action, p, ps, values, slopes) if releasing[j] else 0.0
    to_a = _charge(c.charge_auxiliary, p, pa, c, values, slopes) if p > pa else 0.0
    vent = 0.0
    if not releasing[j] and pc < c.quick_service_pressure and p > c.atmosphere:
        vent = _flow(c.quick_service_area, p, c.atmosphere, values, slopes)
    opening = min(1.0, max(0.0, (wanted - pc) / c.opening_band))
    from_a = _flow(opening * c.apply, pa, pc, values, slopes)
    closing = min(1.0, max(0.0, (pc - wanted) / c.opening_band)) if pc > retained else 0.0
    exhaust = _flow(closing * c.release, pc, c.atmosphere, values, slopes)
    x[at_a] = pa + c.per_auxiliary * (to_a - from_a)
    x[at_s] = ps + c.per_action * to_s
    content[j] += c.gas_step * (from_a - exhaust)
    x[at_c] = _cylinder_pressure(content[j], c)
    return -to_a - to_s - vent, vent + exhaust


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _valve(j, p, before, command, moving, x, content, releasing, tripped, retained, nodes, valves, c, values, slopes):
    """Advance valve j; returns (flow into the pipe, flow to the atmosphere other than from the pipe vent)."""
    if c.graduated_release:
        return _distributor(j, p, x, content, releasing, retained, nodes, valves, c, values, slopes)
    at_a, at_e = nodes + j, nodes + valves + j
    at_c, at_s = at_e + valves, at_e + 2 * valves
    pa, pe, pc, ps = x[at_a], x[at_e], x[at_c], x[at_s]
    emergency = ps - p > c.emergency_drop
    accelerated = p - pa >= c.release_rise
    if accelerated:
        releasing[j] = True
    elif not c.latched_release or pa - p > c.apply_drop:
        releasing[j] = False
    if emergency:
        tripped[j] = True
    elif accelerated:
        tripped[j] = False
    feed = releasing[j] or not c.feed_closed_in_lap
    to_a = _charge(c.charge_auxiliary, p, pa, c, values, slopes) if feed and p > pa else 0.0
    to_e = 0.0
    if feed and pa > pe and (p > pe or not c.check_valve):
        to_e = _charge(c.charge_emergency, pa, pe, c, values, slopes)
    to_s = _charge(c.charge_action, p, ps, c, values, slopes) if p >= ps else 0.0
    bleed = 0.0
    if (emergency and moving) or (not emergency and ps - p >= c.service_drop):
        bleed = _flow(c.bleed_action, ps, c.atmosphere, values, slopes)
    vent = _vent(p, pc, ps, emergency, command, moving, c, values, slopes)
    opened = _cylinder_open(p, before, releasing[j], command, moving, c)
    exhaust = _flow(c.release, pc, c.atmosphere, values, slopes) if opened and pc > retained else 0.0
    if c.exhaust_as_printed:
        exhaust = abs(exhaust)
    back_to_pipe = 0.0
    if accelerated and pe >= p and c.accelerated_service:
        back_to_pipe = _flow(c.accelerate_service, pe, p, values, slopes)
    armed = (tripped[j] and not emergency) or not c.blowback_after_emergency
    blow = 0.0
    if armed and c.accelerated_emergency and pc > p and p > ps:
        blow = _flow(c.accelerate_emergency, pc, p, values, slopes)
    blocked = c.release_blocks_application and (opened or (tripped[j] and not emergency and p > ps))
    opening = _service_opening(pa - p, releasing[j], c)
    from_a = _flow(opening * c.apply, pa, pc, values, slopes) if opening > 0.0 and not blocked else 0.0
    from_e = _flow(c.apply, pe, pc, values, slopes) if emergency else 0.0
    x[at_a] = pa + c.per_auxiliary * (to_a - from_a)
    x[at_e] = pe + c.per_emergency * (to_e - from_e - back_to_pipe)
    x[at_s] = ps + c.per_action * (to_s - bleed)
    change = from_a + from_e - exhaust - blow
    if change != 0.0:
        content[j] += c.gas_step * change
        x[at_c] = _cylinder_pressure(content[j], c)
    return back_to_pipe + blow - to_a - to_e - to_s - vent, vent + bleed + exhaust


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _moved(flow, drop, low, high, c, values, slopes):
    """Flow between two nodes a step later: L/(gamma S) dm/dt = drop - m / conductance, implicit in the friction.

    The conductance is that of the orifice at this difference of pressure: at rest the flow is the print's.
    """
    share = max(1.0 - low / high, SMALLEST_DROP)
    conductance = c.pipe_area * _coefficient(1.0 - share, 1.0, values, slopes) / share
    return (flow + c.momentum_step * drop) / (1.0 + c.momentum_step / conductance)


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _pipe_flows(x, nodes, flows, c, values, slopes):
    """Flow from each node to the next, from the second on (the first is the head valve's)."""
    for i in range(1, nodes - 1):
        p, q = x[i], x[i + 1]
        high, low = max(p, q), min(p, q)
        if c.pipe_momentum:
            flows[i] = _moved(flows[i], p - q, low, high, c, values, slopes)
        else:
            flow = c.pipe_area * _coefficient(low, high, values, slopes) * high
            flows[i] = flow if p > q else -flow


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _ports(x, port, port_nodes, net, command, moving, c, values, slopes):
    """Feed or exhaust at the further locomotives; returns the flow into the pipe."""
    gained = 0.0
    for k in range(len(port_nodes)):
        at = port_nodes[k]
        flow = _head_flow(port[k], x[at], command <= c.atmosphere, c, values, slopes)
        sensed = x[at] if c.relay or at + 1 == len(net) else x[at + 1]
        port[k] = _head_pressure(port[k], sensed, command, moving, c)
        net[at] += flow
        gained += flow
    return gained


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _leaks(x, net, c, values, slopes):
    """What leaks from the pipe of every vehicle behind the head; returns the flow."""
    lost = 0.0
    for i in range(1, len(net)):
        if x[i] > c.atmosphere:
            flow = _flow(c.leak_area, x[i], c.atmosphere, values, slopes)
            net[i] -= flow
            lost += flow
    return lost


@numba.njit(error_model="numpy", forceinline=True, _nrt=False)
def _step(
    command, remote, moving, tail_area, x, content, port, releasing, tripped, history, cursor,
    valve_nodes, port_nodes, retained, flows, net, c, values, slopes,
):  # fmt: skip
    """Advance everything by one step; returns the mass flow into the train in kg/s."""
    nodes, valves = len(flows), len(valve_nodes)
    _pipe_flows(x, nodes, flows, c, values, slopes)
    flows[0] = _head_flow(x[0], x[1], command <= c.atmosphere, c, values, slopes)
    flows[nodes - 1] = 0.0
    if tail_area > 0.0:
        flows[nodes - 1] = _flow(tail_area, x[nodes - 1], c.atmosphere, values, slopes)
    gained = flows[0] - flows[nodes - 1]
    for i in range(1, nodes):
        net[i] = flows[i - 1] - flows[i]
    if c.leak_area > 0.0:
        gained -= _leaks(x, net, c, values, slopes)
    gained += _ports(x, port, port_nodes, net, remote, moving, c, values, slopes)
    row = cursor[0]
    for j in range(valves):
        at = valve_nodes[j]
        p = x[at]
        before = p
        if not c.latched_release:
            before = history[row, j]
            history[row, j] = p
        inflow, lost = _valve(
            j, p, before, command, moving, x, content, releasing, tripped, retained[j], nodes, valves, c, values, slopes
        )
        net[at] += inflow
        gained -= lost
    cursor[0] = row + 1 if row + 1 < len(history) else 0
    head = _head_pressure(x[0], x[1], command, moving, c)
    for i in range(1, nodes):
        x[i] += c.per_pipe * net[i]
    x[0] = head
    return gained


@numba.njit(cache=True, error_model="numpy", _nrt=False)
def advance(
    state: State,
    layout: Layout,
    drive: Drive,
    steps: int,
    watch: Integers,
    output: Array,
    c: Constants,
    table: Table,
    work: Work,
) -> float:
    """Advance the train over all samples of a drive.

    Args:
        state: Changed in place.
        layout: Where valves and locomotives sit.
        drive: Command, speed and tail vent, one value per sample, held within it.
        steps: Steps per sample.
        watch: Indices into ``state.pressures`` to record, shape ``(w,)``.
        output: Receives the mean of each over the steps of each sample, Pa, shape ``(n_samples, w)``.
        c: Constants, those with ``dt`` in them for the step of this call.
        table: Flow table over sqrt(T).
        work: Scratch space.

    Returns:
        Air gained by the train through head valves and vents, as P V in J.
    """
    # Arrays are taken out of their tuples once, and _nrt=False above: numba otherwise counts references at
    # every opening and call, which took nine tenths of the run time. Hence no array is made in here.
    x, content, port, history, cursor = state.pressures, state.content, state.port, state.history, state.cursor
    releasing, tripped = state.releasing, state.tripped
    valve_nodes, port_nodes, retained = layout.valve_nodes, layout.port_nodes, layout.retained
    values, slopes = table.values, table.slopes
    commands, remotes, speeds, tail_areas = drive.command, drive.remote, drive.speed, drive.tail_area
    flows, net, sums = state.flows, work.net, work.sums
    gained = 0.0
    for k in range(len(commands)):
        for w in range(len(watch)):
            sums[w] = 0.0
        moving = speeds[k] > 0.01 or not c.speed_gates
        for _ in range(steps):
            gained += _step(
                commands[k], remotes[k], moving, tail_areas[k], x, content, port, releasing, tripped, history, cursor,
                valve_nodes, port_nodes, retained, flows, net, c, values, slopes,
            )  # fmt: skip
            for w in range(len(watch)):
                sums[w] += x[watch[w]]
        for w in range(len(watch)):
            output[k, w] = sums[w] / steps
    return gained * c.gas_step
