"""The tail of a two-way end-of-train device: valve, refusals, self-test, telemetry; trains braked from both ends.

After EP 0 941 904 and 49 CFR 232.403 and 232.405.
"""

from __future__ import annotations

import enum
import math
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.settings import check_numbers
from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import AbstractBrake, BrakeOutput, Signal
from sysid.rail.end_of_train.brake_computer import BrakeComputer, ComputerSettings, Message, Order, Reading
from sysid.units import PSI_IN_PA


@dataclass(frozen=True, kw_only=True)
class TailSettings:
    """Numbers of the tail unit.

    Args:
        emergency_area: In m2: the hose of 5/8 in, narrower than the valve of 3/4 in (49 CFR 232.405).
        emergency_hold: Time in s that the emergency valve stays open: at least 15 s (49 CFR 232.405).
        emergency_delay: Time in s from the order to the open valve: at most 1 s (49 CFR 232.405).
        service_area: In m2 (ours: 5 mm across; a service rate at the end of a long train).
        service_band: Pipe above the target in psi from which the service valve is fully open, in proportion below
            (ours): a valve that is open or shut makes waves that apply the last cars deeper than was asked for, and so
            does one with a band of 3 psi at the end of a short train, whose air has mass.
        service_delay: Time in s from a service order to the valve (ours).
        minimum_reduction: Of a minimum application in psi (ours: the 26-L brake valve's is 6 to 8 psi by the
            description of the San Diego Railroad Museum).
        refusal: Fall of the tail's pipe in psi since an order's time stamp that makes the order void (ours: the
            reporting step of 49 CFR 232.403).

    Raises:
        ConfigError: If a number is out of range.
    """

    emergency_area: float = 1.98e-4
    emergency_hold: float = 15.0
    emergency_delay: float = 1.0
    service_area: float = 2.0e-5
    service_band: float = 12.0
    service_delay: float = 1.0
    minimum_reduction: float = 6.0
    refusal: float = 2.0

    def __post_init__(self) -> None:
        check_numbers(self, "the settings of a tail unit", from_zero=("emergency_delay", "service_delay"))
        if self.emergency_hold < 15.0 or self.emergency_delay > 1.0:
            raise ConfigError(
                "the emergency valve is not that of 49 CFR 232.405",
                where="tail settings",
                expected="open within 1 s, for at least 15 s",
                got=(self.emergency_delay, self.emergency_hold),
                remedy="keep the rule",
            )


class Answer(enum.Enum):
    """What the tail unit did with an order."""

    DONE = "carried out"
    REPEATED = "refused: a minimum application has been made already"
    OVERTAKEN = "refused: the pipe has already fallen since the order was given"
    UNKNOWN_PRESSURE = "refused: no operating pressure is known yet"


class TailUnit:
    """Valves at the end of the train, set by orders with time stamps.

    A target follows the reduction at the head: ``target = operating pressure at the tail - (ER operating - ER)``.

    Args:
        settings: Numbers.
        sample_time: In s.
        history: How far back in s pressures at time stamps are known.

    Example:
        >>> unit = TailUnit(sample_time=0.1)
        >>> unit.step(88.0), unit.receive(Message(order=Order.UPDATE, time=0.0)).name
        (0.0, 'DONE')
        >>> unit.receive(Message(order=Order.MINIMUM, time=0.0, reduction=2.0)).name, unit.target
        ('DONE', 82.0)
    """

    def __init__(self, *, sample_time: float, settings: TailSettings | None = None, history: float = 60.0) -> None:
        self.settings = settings or TailSettings()
        self.operating: float | None = None
        self.target: float | None = None
        self._minimum_made = False
        self._sample_time, self._count = sample_time, 0
        self._past: deque[float] = deque(maxlen=round(history / sample_time) + 1)
        self._emergency_left = 0

    @property
    def time(self) -> float:
        """Of the last sample in s."""
        return max(self._count - 1, 0) * self._sample_time

    def _pressure_at(self, time: float) -> float:
        back = round((self.time - time) / self._sample_time)
        return self._past[max(len(self._past) - 1 - max(back, 0), 0)]

    def receive(self, message: Message) -> Answer:
        """Take an order.

        Args:
            message: The order.

        Returns:
            Whether it is carried out, or why not.

        Raises:
            ConfigError: If no pressure has been seen yet.
        """
        if not self._past:
            raise ConfigError("the tail unit has seen no pressure yet", where="tail unit", remedy="step it first")
        if message.order is Order.EMERGENCY:
            self._emergency_left = math.ceil(self.settings.emergency_hold / self._sample_time - 1e-9)
            return Answer.DONE
        if message.order is Order.UPDATE:
            self.operating, self._minimum_made, self.target = self._past[-1], False, None
            return Answer.DONE
        if message.order is Order.RELEASE:
            self._minimum_made, self.target = False, None
            return Answer.DONE
        if self.operating is None:
            return Answer.UNKNOWN_PRESSURE
        if message.order is Order.MINIMUM:
            if self._minimum_made:
                return Answer.REPEATED
            # Claims 30 to 32; the wording of 31 is muddled: refuse when the fall has happened already.
            if self._pressure_at(message.time) - self._past[-1] >= self.settings.refusal:
                return Answer.OVERTAKEN
            self._minimum_made = True
            self.target = self.operating - max(message.reduction, self.settings.minimum_reduction)
            return Answer.DONE
        # What the driver holds by now, which may be less than the minimum of the tail's own settings.
        self.target = self.operating - message.reduction
        return Answer.DONE

    def step(self, pressure: float) -> float:
        """One sample.

        Args:
            pressure: Of the pipe at the tail in psi gauge.

        Returns:
            Area open to the atmosphere in m2, until the next sample.
        """
        self.see(pressure)
        return self.opening()

    def see(self, pressure: float) -> None:
        """The first half of a step, before the orders that arrive with it: take the pipe's pressure in psi gauge."""
        self._count += 1
        self._past.append(pressure)

    def opening(self) -> float:
        """The other half: the area in m2 that is open until the next sample."""
        if self._emergency_left > 0:
            self._emergency_left -= 1
            return self.settings.emergency_area
        if self.target is None:
            return 0.0
        above = (self._past[-1] - self.target) / self.settings.service_band
        return self.settings.service_area * min(1.0, max(0.0, above))


class AbstractTestBench(ABC):
    """What a self-test works on: the pressure at the service brake, its valves, and time."""

    @abstractmethod
    def pressure(self) -> float:
        """Service brake pressure in psi gauge."""

    @abstractmethod
    def wait(self, seconds: float) -> None:
        """Let time pass."""

    @abstractmethod
    def release_valve(self, *, opened: bool) -> None:
        """Open or close the release service valve."""

    @abstractmethod
    def supply_valve(self, *, opened: bool) -> None:
        """Open or close the supply and exhaust service valve."""


class SelfTest(enum.Enum):
    """Outcome of a self-test."""

    HELD = "the pressure held in both parts"
    FAIL_FIRST = "the pressure fell while the valves were closed: a leak"
    FAIL_SECOND = "the pressure fell with the supply valve open: a valve does not hold"


def self_test(bench: AbstractTestBench, *, hold: float = 10.0, vent: float = 2.0, drop: float = 2.0) -> SelfTest:
    """The self-test of claims 21 to 23.

    Args:
        bench: What is tested.
        hold: T1 in s (ours).
        vent: T2 in s (ours).
        drop: Largest fall in psi (ours).

    Returns:
        The outcome.
    """
    latched = bench.pressure()
    bench.wait(hold)
    if latched - bench.pressure() >= drop:
        return SelfTest.FAIL_FIRST
    bench.release_valve(opened=True)
    bench.wait(vent)
    latched = bench.pressure()
    bench.release_valve(opened=False)
    bench.supply_valve(opened=True)
    bench.wait(hold)
    fallen = latched - bench.pressure() >= drop
    bench.supply_valve(opened=False)
    return SelfTest.FAIL_SECOND if fallen else SelfTest.HELD


@dataclass(frozen=True, kw_only=True)
class Telemetry:
    """What the head end is told of the pressure at the tail, as 49 CFR 232.403 describes it.

    Args:
        accuracy: Largest error of the gauge in psi: one draw per train (232.403: within 3 psig).
        step: Change in psi that is reported at once (232.403: 2 psig).
        interval: Longest time in s between two reports (232.403: not over 70 s).
        delay: From the pressure to the display in s (ours).
        loss: Probability that a report is lost (ours).

    Raises:
        ConfigError: If a number is out of range.
    """

    accuracy: float = 3.0
    step: float = 2.0
    interval: float = 70.0
    delay: float = 1.0
    loss: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, "a telemetry", from_zero=("accuracy", "delay", "loss"))
        if self.loss >= 1.0:
            raise ConfigError(
                "not a telemetry: every report is lost", where="telemetry, loss", expected="below 1", got=self.loss
            )

    def reported(self, pressure: NDArray[np.float64], sample_time: float, *, seed: int) -> NDArray[np.float64]:
        """The pressure as the head end knows it.

        Args:
            pressure: At the tail in psi gauge, shape ``(n_samples,)``.
            sample_time: In s.
            seed: Of the gauge's error and of the losses.

        Returns:
            Held between reports, same shape; the first report is there from the beginning.

        Example:
            >>> radio = Telemetry(accuracy=0.0, delay=0.0)
            >>> radio.reported(np.array([90.0, 89.0, 88.0, 87.0]), 1.0, seed=1).tolist()
            [90.0, 90.0, 88.0, 88.0]
        """
        rng = np.random.default_rng(seed)
        gauge = np.asarray(pressure, dtype=np.float64) + rng.uniform(-self.accuracy, self.accuracy)
        late = round(self.delay / sample_time)
        shown = np.full(len(gauge), gauge[0])
        last, at = gauge[0], 0
        for k, value in enumerate(gauge):
            if abs(value - last) >= self.step - 1e-9 or (k - at) * sample_time >= self.interval - 1e-9:
                # The unit believes its report has arrived, so that a lost one is made up for by the next.
                last, at = value, k
                if rng.random() >= self.loss:
                    shown[k + late :] = value
        return shown


class TwoEndedBrake(AbstractBrake):
    """Any brake with a tail vent, braked from both ends: the computer at its head orders the unit at its tail.

    Args:
        brake: The brake; it must give the pressures of the equalising reservoir and of both ends of the pipe.
        computer: Thresholds of the head end.
        tail: Numbers of the tail unit.

    Raises:
        ConfigError: If the brake gives no pipe pressures, or its samples are longer than the delay of an emergency.
    """

    def __init__(
        self,
        brake: AbstractBrake,
        *,
        computer: ComputerSettings | None = None,
        tail: TailSettings | None = None,
    ) -> None:
        self.sample_time, self.vehicles = brake.sample_time, brake.vehicles
        self._brake = brake
        self.computer = BrakeComputer(sample_time=brake.sample_time, settings=computer, charged=True)
        self.unit = TailUnit(sample_time=brake.sample_time, settings=tail)
        if brake.sample_time > self.unit.settings.emergency_delay + 1e-9:
            raise ConfigError(
                "an emergency order cannot open the valve of the tail in time",
                where="two-ended brake",
                expected=f"samples of at most {self.unit.settings.emergency_delay:g} s, the delay of the emergency",
                got=f"{brake.sample_time:g} s",
                remedy="advance the brake in shorter samples",
            )
        self.log: list[tuple[Message, Answer]] = []
        self._under_way: deque[tuple[int, Message]] = deque()
        self._area, self._count = 0.0, 0
        self._began = False

    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        """Advance; a ``tail_vent`` of the caller's adds to the unit's. See :meth:`AbstractBrake.advance`."""
        speeds = np.broadcast_to(np.asarray(speed, dtype=np.float64), (len(command),))
        vents = np.broadcast_to(np.asarray(tail_vent, dtype=np.float64), (len(command),))
        parts = []
        for k in range(len(command)):
            output = self._brake.advance(
                command[k : k + 1], speed=float(speeds[k]), tail_vent=float(vents[k]) + self._area
            )
            self._area = self._control(output)
            parts.append(output)
        return _joined(parts)

    def _control(self, output: BrakeOutput) -> float:
        if output.equalising is None or output.head_pipe is None or output.tail_pipe is None:
            raise ConfigError(
                "the brake gives no pipe pressures",
                where="two-ended brake",
                expected="equalising reservoir, head and tail of the pipe",
                got=type(self._brake).__name__,
            )
        head, tail = (float(v[-1]) / PSI_IN_PA for v in (output.head_pipe, output.tail_pipe))
        reading = Reading(equalising=float(output.equalising[-1]) / PSI_IN_PA, head=head, tail=tail)
        message = self.computer.step(reading).message
        self.unit.see(tail)
        if not self._began:
            self._began = True
            self.unit.receive(Message(order=Order.UPDATE, time=0.0))
        if message is not None:
            s, emergency = self.unit.settings, message.order is Order.EMERGENCY
            delay = s.emergency_delay if emergency else s.service_delay
            # What the unit opens at a sample is open from the next one on: at the latest after the delay, never later.
            samples = max(math.floor(delay / self.sample_time + 1e-9) - 1, 0)
            self._under_way.append((self._count + samples, message))
        for due, order in [entry for entry in self._under_way if entry[0] <= self._count]:
            self._under_way.remove((due, order))
            self.log.append((order, self.unit.receive(order)))
        self._count += 1
        return self.unit.opening()


def _joined(parts: list[BrakeOutput]) -> BrakeOutput:
    def column(name: str) -> NDArray[np.float64] | None:
        values = [getattr(part, name) for part in parts]
        return None if any(value is None for value in values) else np.concatenate(values)

    return BrakeOutput(
        cylinders=np.concatenate([part.cylinders for part in parts]),
        equalising=column("equalising"),
        head_pipe=column("head_pipe"),
        tail_pipe=column("tail_pipe"),
    )


def full_braking_times(
    cylinders: NDArray[np.float64], sample_time: float, *, share: float = 0.9, from_sample: int = 0
) -> NDArray[np.float64]:
    """When each vehicle reaches a share of its final cylinder pressure.

    Args:
        cylinders: Pa gauge, shape ``(n_samples, n_vehicles)``.
        sample_time: In s.
        share: Of the last sample's pressure.
        from_sample: Where time 0 is.

    Returns:
        In s, shape ``(n_vehicles,)``; NaN for a vehicle that is not braked.
    """
    final = cylinders[-1]
    reached = np.argmax(cylinders >= share * final, axis=0)
    times = (reached + 1 - from_sample) * sample_time
    return np.where(final > 0.0, times, np.nan)
