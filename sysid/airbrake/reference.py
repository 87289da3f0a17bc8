"""The same step as the compiled kernel, written plainly after Appendix C, to test the kernel by.

Slow and meant to be read beside the listing: one dictionary of pressures per wagon pair, one line per flow.
It shares no code with the kernel; only the flow table's formula of interpolation is the same.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from sysid.airbrake.consist import TEMPERATURE, Consist
from sysid.airbrake.flow import GAS_CONSTANT, HEAT_RATIO, FlowTable
from sysid.airbrake.variant import QuickService, Variant
from sysid.units import PSI_IN_PA
from sysid.units import STANDARD_ATMOSPHERE_PA as PATM


class PlainPair:
    """One brake valve: its pressures in Pa absolute and what it remembers."""

    def __init__(self, consist: Consist, variant: Variant, time_step: float) -> None:
        self.auxiliary = self.emergency = self.action = consist.charged
        self.cylinder = PATM
        self.content = 0.0 if variant.piston else PATM * consist.cylinder.volume
        self.releasing = variant.latched_release
        self.tripped = False
        self.retained = 0.0
        self.past = [consist.charged] * max(1, round(variant.rising_delay / time_step))


class PlainTrain:
    """A train advanced one step at a time.

    Args:
        consist: The train.
        variant: The reading of the model.
        time_step: Step in s.
        table: Flow table.
    """

    def __init__(self, *, consist: Consist, variant: Variant, time_step: float, table: FlowTable) -> None:
        self.consist, self.variant, self.time_step = consist, variant, time_step
        self._values = [float(value) for value in table.values]
        self.pipe = [consist.charged] * consist.vehicles
        self.between = [0.0] * (consist.vehicles - 2)
        self.port = [consist.charged] * len(consist.port_nodes)
        self.pairs = [PlainPair(consist, variant, time_step) for _ in range(consist.pairs)]
        for pair, psi in zip(self.pairs, consist.retained_by_pairs, strict=True):
            pair.retained = psi * PSI_IN_PA + PATM if psi else 0.0

    def _coefficient(self, low: float, high: float) -> float:
        position = math.sqrt(1.0 - low / high) * (len(self._values) - 1)
        index = min(int(position), len(self._values) - 2)
        share = position - index
        return (1.0 - share) * self._values[index] + share * self._values[index + 1]

    def _flow(self, area: float, p: float, q: float) -> float:
        high, low = max(p, q), min(p, q)
        size = area * self._coefficient(low, high) * high / math.sqrt(TEMPERATURE)
        return size if p > q else -size

    def _between(self, moving: float, p: float, q: float) -> float:
        """Flow in the pipe from one vehicle to the next; ``moving`` is what it was."""
        pipe = self.consist.pipe
        if not self.variant.pipe_momentum:
            return self._flow(pipe.area, p, q)
        high = max(p, q)
        share = max(1.0 - min(p, q) / high, 1e-6)
        friction = share * high / self._flow(pipe.area, high, high * (1.0 - share))  # Pa per kg/s
        inertia = pipe.length**2 / (HEAT_RATIO * pipe.volume)  # Pa per kg/s2; fronts run at the speed of sound
        return (inertia * moving + (p - q) * self.time_step) / (inertia + friction * self.time_step)

    def _charging(self, area: float, p: float, q: float) -> float:
        factor = p if self.variant.charge_from_upstream else q
        return area * self._coefficient(q, p) * factor / math.sqrt(TEMPERATURE)

    def _head(self, held: float, local: float, command: float) -> float:
        """Flow from a locomotive's brake valve into the pipe."""
        head, emergency = self.consist.head, command <= PATM
        exhaust = 2.0 * head.exhaust_area if emergency else head.exhaust_area
        if self.variant.relay_band is None or (held > local and not emergency):
            return self._flow(head.feed_area if held > local else exhaust, held, local)
        opening = 1.0 if emergency else min(1.0, (local - held) / self.variant.relay_band)
        return -self._flow(opening * exhaust, local, PATM)

    def _leak(self, p: float) -> float:
        """Flow to the atmosphere through a hole that would let the charged pipe of a vehicle fall at the given rate."""
        charged, rate = self.consist.charged, self.variant.leakage
        at_charge = rate * self.consist.pipe.volume / (GAS_CONSTANT * TEMPERATURE)
        return at_charge * self._flow(1.0, p, PATM) / self._flow(1.0, charged, PATM) if p > PATM else 0.0

    def _held(self, held: float, sensed: float, command: float, moving: bool) -> float:
        """What a locomotive's brake valve holds next."""
        if not moving:
            return self.consist.charged
        if self.variant.relay_band is None:
            return PATM if sensed > command else command
        rate = self.variant.equalising_rate
        if command <= PATM or command >= held or rate is None:
            return command
        return max(command, held - rate * self.time_step)

    def step(self, command: float, *, speed: float = 1.0, tail_area: float = 0.0, remote: float | None = None) -> None:
        """Advance by one step.

        Args:
            command: Handle in Pa absolute.
            speed: Speed in m/s.
            tail_area: Area in m2 open behind the last vehicle.
            remote: The handle as the further locomotives have it; the same by default.
        """
        consist, pipe = self.consist, list(self.pipe)
        heard = command if remote is None else remote
        moving = speed > 0.01 or not self.variant.speed_gates
        self.between = [
            self._between(m, p, q) for m, (p, q) in zip(self.between, itertools.pairwise(pipe[1:]), strict=True)
        ]
        flows = [self._head(pipe[0], pipe[1], command), *self.between, self._flow(tail_area, pipe[-1], PATM)]
        net = [0.0, *(into - out for into, out in itertools.pairwise(flows))]
        net = [net[0], *(n - self._leak(p) for n, p in zip(net[1:], pipe[1:], strict=True))]
        for index, node in enumerate(consist.port_nodes):
            local = pipe[node - 1]
            net[node - 1] += self._head(self.port[index], local, heard)
            behind = pipe[node] if node < len(pipe) and self.variant.relay_band is None else local
            self.port[index] = self._held(self.port[index], behind, heard, moving)
        for pair, node in zip(self.pairs, consist.valve_nodes, strict=True):
            if self.variant.graduated_release:
                net[node - 1] += self._distributor(pair, pipe[node - 1])
            else:
                net[node - 1] += self._pair(pair, pipe[node - 1], command, moving)
        per_pipe = GAS_CONSTANT * TEMPERATURE * self.time_step / consist.pipe.volume
        self.pipe = [p + per_pipe * n for p, n in zip(pipe, net, strict=True)]
        self.pipe[0] = self._held(pipe[0], pipe[1], command, moving)

    def _pair(self, pair: PlainPair, p3: float, command: float, moving: bool) -> float:
        """Advance one valve; returns the flow into the pipe."""
        v, q = self.variant, self.consist.valve
        pa, pe, pc, ps = pair.auxiliary, pair.emergency, pair.cylinder, pair.action
        emergency = ps - p3 > q.emergency_drop
        released = p3 - pa >= q.release_rise
        self._remember(pair, p3, emergency)
        feed = pair.releasing or not v.feed_closed_in_lap
        m_a = self._charging(q.charge_auxiliary, p3, pa) if p3 > pa and feed else 0.0
        charges = pa > pe and feed and (p3 > pe or not v.emergency_check_valve)
        m_e = self._charging(q.charge_emergency, pa, pe) if charges else 0.0
        m_s = self._charging(q.charge_action, p3, ps) if p3 >= ps else 0.0
        bleeds = q.service_drop <= ps - p3 <= q.emergency_drop or (emergency and moving)
        m_sa = self._flow(q.bleed_action, ps, PATM) if bleeds else 0.0
        m_v = self._vent(pair, p3, command, moving, emergency)
        opened = self._opened(pair, p3, command, moving)
        m_x = self._flow(q.release, pc, PATM) if opened and pc > pair.retained else 0.0
        m_x = abs(m_x) if v.exhaust_as_printed else m_x
        m_r = self._flow(q.accelerate_service, pe, p3) if released and pe >= p3 and v.accelerated_service else 0.0
        after = pair.tripped and not emergency
        blows = pc > p3 and p3 > ps and v.accelerated_emergency and (after or not v.blowback_after_emergency)
        m_cb = self._flow(q.accelerate_emergency, pc, p3) if blows else 0.0
        shut = v.release_blocks_application and (opened or (after and p3 > ps))
        m_ac = 0.0 if shut else self._flow(self._service(pair, pa - p3) * q.apply, pa, pc)
        m_ec = self._flow(q.apply, pe, pc) if emergency else 0.0
        rt = GAS_CONSTANT * TEMPERATURE * self.time_step
        pair.auxiliary += rt / q.auxiliary_volume * (m_a - m_ac)
        pair.emergency += rt / q.emergency_volume * (m_e - m_ec - m_r)
        pair.action += rt / q.action_volume * (m_s - m_sa)
        pair.content += rt * (m_ac + m_ec - m_x - m_cb)
        pair.cylinder = self._cylinder_pressure(pair.content)
        return m_r + m_cb - m_a - m_e - m_s - m_v

    def _distributor(self, pair: PlainPair, p3: float) -> float:
        """Advance one distributor of graduated release; returns the flow into the pipe."""
        q, control = self.consist.valve, pair.action
        fall = control - p3
        if fall > q.first_fall:
            pair.releasing = False
        elif fall < q.first_fall / 2:
            pair.releasing = True
        asked = 0.0 if pair.releasing else min(q.cylinder_limit, max(0.0, q.cylinder_limit * fall / q.full_fall))
        off = asked + PATM - pair.cylinder
        m_s = self._flow(q.charge_action, p3, control) if pair.releasing else 0.0
        m_a = self._charging(q.charge_auxiliary, p3, pair.auxiliary) if p3 > pair.auxiliary else 0.0
        first = not pair.releasing and pair.cylinder < PATM + self.variant.quick_service_limit
        m_v = self._flow(q.quick_service, p3, PATM) if first and p3 > PATM else 0.0
        m_ac = self._flow(q.apply * min(1.0, max(0.0, off / q.opening_band)), pair.auxiliary, pair.cylinder)
        m_x = 0.0
        if pair.cylinder > pair.retained:
            m_x = self._flow(q.release * min(1.0, max(0.0, -off / q.opening_band)), pair.cylinder, PATM)
        rt = GAS_CONSTANT * TEMPERATURE * self.time_step
        pair.auxiliary += rt / q.auxiliary_volume * (m_a - m_ac)
        pair.action += rt / q.action_volume * m_s
        pair.content += rt * (m_ac - m_x)
        pair.cylinder = self._cylinder_pressure(pair.content)
        return -m_a - m_s - m_v

    def _remember(self, pair: PlainPair, p3: float, emergency: bool) -> None:
        valve = self.consist.valve
        if p3 - pair.auxiliary >= valve.release_rise:
            pair.releasing = True
            pair.tripped = emergency
        else:
            if not self.variant.latched_release or pair.auxiliary - p3 > valve.apply_drop:
                pair.releasing = False
            pair.tripped = pair.tripped or emergency

    def _service(self, pair: PlainPair, drop: float) -> float:
        """Share of the service passage that is open."""
        valve = self.consist.valve
        if not self.variant.graduating_lap:
            return float(drop > valve.apply_drop)
        return 0.0 if pair.releasing else min(1.0, max(0.0, drop / valve.service_drop))

    def _vent(self, pair: PlainPair, p3: float, command: float, moving: bool, emergency: bool) -> float:
        v, valve, area = self.variant, self.consist.valve, 0.0
        if emergency:
            area = valve.emergency_vent if moving else 0.0
        elif v.quick_service is QuickService.LOCAL:
            falling = pair.action - p3 >= 2.0 * valve.service_drop
            limited = pair.cylinder >= PATM + v.quick_service_limit and not v.accelerated_application
            area = valve.quick_service if falling and not limited else 0.0
        elif p3 <= PATM and command < self.consist.charged and moving:
            area = valve.emergency_vent
        elif v.quick_service is QuickService.COMMAND and p3 - command > valve.command_drop and moving:
            area = valve.charge_action
        return self._flow(area, p3, PATM)

    def _opened(self, pair: PlainPair, p3: float, command: float, moving: bool) -> bool:
        """Whether the cylinder is open to the atmosphere."""
        v, valve = self.variant, self.consist.valve
        before = pair.past.pop(0)
        pair.past.append(p3)
        if v.latched_release:
            return pair.releasing
        if p3 - valve.release_rise >= pair.auxiliary:
            return True
        opened = not moving or p3 >= before
        if command - valve.lap_band <= p3 <= command + 2.0 * valve.lap_band or p3 <= valve.empty_pipe:
            opened = False
        return opened

    def _cylinder_pressure(self, content: float) -> float:
        """Pressure at which a cylinder of piston travel x(P) holds a content P V, by bisection."""
        cylinder = self.consist.cylinder
        if not self.variant.piston:
            return content / cylinder.volume
        low, high = PATM, 1e7
        for _ in range(200):
            middle = 0.5 * (low + high)
            if middle in (low, high):
                break
            low, high = (middle, high) if middle * self._cylinder_volume(middle) <= content else (low, middle)
        return low

    def _cylinder_volume(self, pressure: float) -> float:
        cylinder, gauge = self.consist.cylinder, pressure - PATM
        points: Sequence[tuple[float, float]] = (
            (0.0, 0.0),
            (cylinder.contact_pressure, cylinder.contact_volume),
            (cylinder.stroke_pressure, cylinder.volume),
        )
        for (p0, v0), (p1, v1) in itertools.pairwise(points):
            if gauge <= p1:
                return v0 + (v1 - v0) * (gauge - p0) / (p1 - p0)
        return cylinder.volume
