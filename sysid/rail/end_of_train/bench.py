"""A test bench for the end of a train: its self-test on a volume with leaks, and an application from both ends.

What a person at the device does: the valves are closed, then one is opened, and a gauge is read. And what a train
does with it: when the order came, when the valve opened and for how long, what every cylinder got beside one end alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.consist import Consist
from sysid.errors import ConfigError
from sysid.rail.dynamics.brake import BrakeOutput, ReferenceBrake, Signal
from sysid.rail.end_of_train.brake_computer import Message
from sysid.rail.end_of_train.tail_unit import AbstractTestBench, Answer, TwoEndedBrake, full_braking_times
from sysid.units import PSI_IN_PA

AFTER = 5.0
"""When the handle moves, in s."""
SETTLING, GROWS = 5.0, 0.02
"""Seconds at the end in which no cylinder grows by more than this share, if it has come to its pressure (ours)."""


@dataclass(kw_only=True)
class LeakingBench(AbstractTestBench):
    """A charged volume that leaks, and more so while a valve that does not hold is under pressure.

    Args:
        charged: Psi gauge at the beginning.
        leak: Of the volume with the valves closed, in psi a minute.
        valve_leak: What the supply valve loses beside that while it is open, in psi a minute.

    Raises:
        ConfigError: If a number is out of range.

    Example:
        >>> bench = LeakingBench(leak=6.0)
        >>> bench.wait(10.0), round(bench.pressure(), 3)
        (None, 89.0)
    """

    charged: float = 90.0
    leak: float = 0.0
    valve_leak: float = 0.0
    readings: list[tuple[float, str, float]] = field(default_factory=list)
    """Time in s, what was done, psi gauge after it."""

    def __post_init__(self) -> None:
        if not (0.0 < self.charged <= 150.0 and 0.0 <= self.leak <= 1e3 and 0.0 <= self.valve_leak <= 1e3):
            raise ConfigError(
                "not a test bench", where="end of train, self-test",
                expected="psi gauge up to 150, leaks from 0 to 1000 psi a minute",
                got=f"{self.charged:g} psi, leaks of {self.leak:g} and {self.valve_leak:g} psi a minute",
            )  # fmt: skip
        self._time, self._pressure, self._supply = 0.0, self.charged, False
        self._note("latched, valves closed")

    def _note(self, done: str) -> None:
        self.readings.append((self._time, done, self._pressure))

    def pressure(self) -> float:
        """See the base class."""
        return self._pressure

    def wait(self, seconds: float) -> None:
        """See the base class."""
        rate = self.leak + (self.valve_leak if self._supply else 0.0)
        self._time += seconds
        self._pressure = max(0.0, self._pressure - rate * seconds / 60.0)
        self._note(f"{seconds:g} s later")

    def release_valve(self, *, opened: bool) -> None:
        """See the base class."""
        self._note(f"release valve {'opened' if opened else 'closed'}")

    def supply_valve(self, *, opened: bool) -> None:
        """See the base class."""
        self._supply = opened
        self._note(f"supply valve {'opened' if opened else 'closed'}")


class _Watched(ReferenceBrake):
    """A brake that remembers what was open behind its last vehicle."""

    def __init__(self, consist: Consist) -> None:
        super().__init__(consist=consist)
        self.vents: list[float] = []

    def advance(self, command: NDArray[np.float64], *, speed: Signal = 1.0, tail_vent: Signal = 0.0) -> BrakeOutput:
        self.vents.append(float(np.max(tail_vent)))
        return super().advance(command, speed=speed, tail_vent=tail_vent)


@dataclass(frozen=True, kw_only=True, eq=False)
class BothEnds:
    """An application from both ends beside one from the head alone.

    Args:
        time: In s, shape ``(n_samples,)``.
        log: The orders, and what the tail unit did with them.
        opened: When its valve was open first, in s; NaN if never.
        open_for: For how long, in s.
        both: Cylinders in psi gauge from both ends, shape ``(n_samples, n_vehicles)``.
        one: The same from the head alone.
        braked: Seconds from the command until every cylinder has nine tenths of its pressure, both ends and one; NaN
            where none has any.
        rising: Whether a cylinder still rises at the end, so that this pressure is not its last, both ends and one.
        still_open: Whether the valve is open at the end.
    """

    time: NDArray[np.float64]
    log: tuple[tuple[Message, Answer], ...]
    opened: float
    open_for: float
    both: NDArray[np.float64]
    one: NDArray[np.float64]
    braked: tuple[float, float]
    rising: tuple[bool, bool]
    still_open: bool


def check_application(consist: Consist, handle: float, *, seconds: float, after: float = AFTER) -> None:
    """Refuse an application that cannot be made or looked at.

    Args:
        consist: The train.
        handle: Psi gauge; 0 is the emergency.
        seconds: How long it is looked at.
        after: When the handle moves, in s.

    Raises:
        ConfigError: If the handle or the time does not fit the train.
    """
    running = consist.running_pressure
    if not 0.0 <= handle < running or not 1.0 <= after < seconds <= 1000.0:
        raise ConfigError(
            "not an application", where="end of train",
            expected=f"a handle from 0 to below {running:g} psi, and {after:g} to 1000 s",
            got=f"{handle:g} psi, {seconds:g} s",
        )  # fmt: skip


def from_both_ends(consist: Consist, handle: float, *, seconds: float = 150.0, after: float = AFTER) -> BothEnds:
    """Move the handle once and look at the train.

    Args:
        consist: The train.
        handle: Psi gauge; 0 is the emergency.
        seconds: How long it is looked at.
        after: When the handle moves, in s.

    Returns:
        What came of it.

    Raises:
        ConfigError: If the handle or the time does not fit the train.
    """
    check_application(consist, handle, seconds=seconds, after=after)
    running = consist.running_pressure
    watched = _Watched(consist)
    step, moved = watched.sample_time, round(after / watched.sample_time)
    command = np.repeat([running, handle], [moved, round(seconds / step) - moved])
    brake = TwoEndedBrake(watched)
    both = brake.advance(command).cylinders
    one = ReferenceBrake(consist=consist).advance(command).cylinders
    vents = np.flatnonzero(np.array(watched.vents) > 0.0)
    return BothEnds(
        time=step * np.arange(len(command), dtype=np.float64),
        log=tuple(brake.log),
        opened=float(vents[0]) * step if len(vents) else float("nan"),
        open_for=len(vents) * step,
        both=both / PSI_IN_PA,
        one=one / PSI_IN_PA,
        braked=(_braked(both, step, moved), _braked(one, step, moved)),
        rising=(_rising(both, step), _rising(one, step)),
        still_open=len(vents) > 0 and int(vents[-1]) == len(watched.vents) - 1,
    )


def _braked(cylinders: NDArray[np.float64], step: float, moved: int) -> float:
    times = full_braking_times(cylinders, step, from_sample=moved)
    return float(np.nanmax(times)) if np.isfinite(times).any() else float("nan")


def _rising(cylinders: NDArray[np.float64], step: float) -> bool:
    """Whether one grows so fast that :data:`SETTLING` more would add to it what counts."""
    before = cylinders[max(0, len(cylinders) - 1 - round(SETTLING / step))]
    return bool((cylinders[-1] - before > GROWS * cylinders[-1]).any())
