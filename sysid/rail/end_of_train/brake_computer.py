"""The head end of a two-way end-of-train device: a state machine over equalising reservoir and brake pipe.

After EP 0 941 904 ("Computer control of railroad train brake system operation"). The patent gives one number, some
minute of history; what it calls predetermined is ours and stands in :class:`ComputerSettings`. Claim 13 lets a minimum
application be sent if the equalising reservoir has "increased"; decreased is meant.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from sysid.airbrake.settings import check_numbers
from sysid.errors import ConfigError
from sysid.rail.end_of_train.ring import Ring


class State(enum.Enum):
    """Where the brake is."""

    SETUP = "buffers fill, pressures are not yet known"
    STABILITY = "not applied, pressures still move"
    RELEASE = "released and stable"
    QUALIFY_MINIMUM = "the pipe falls; not yet known whether the driver applies"
    QUALIFY_SERVICE = "a service application is being made"
    QUALIFY_DEEPER = "applied and held; a deeper application may come"
    EMERGENCY = "the pipe falls or has fallen at an emergency rate"


APPLICATION = frozenset({State.QUALIFY_MINIMUM, State.QUALIFY_SERVICE, State.QUALIFY_DEEPER})
"""The states that make up Application."""


class Order(enum.Enum):
    """What the head end tells the end of the train."""

    UPDATE = "take the pressures of now as operating pressures"
    MINIMUM = "make a minimum application"
    SERVICE = "make a service application to the target"
    RELEASE = "let go of the pipe"
    EMERGENCY = "open the emergency valve"


@dataclass(frozen=True, kw_only=True)
class Message:
    """An order with its time stamp.

    Args:
        order: What to do.
        time: When it was given, in s.
        reduction: Of the equalising reservoir below its operating pressure in psi.
    """

    order: Order
    time: float
    reduction: float = 0.0


@dataclass(frozen=True, kw_only=True)
class ComputerSettings:
    """Thresholds in psi and s; all but ``history`` are ours.

    Args:
        history: Length of the buffers (the source: about one minute).
        setup_time: Time after which the setup may be complete.
        setup_pressure: Head pipe pressure from which it is.
        stable_swing: Largest swing of a stable pressure.
        stable_window: Over this time.
        drop: Fall of the head pipe that may be an application.
        drop_window: Within this time.
        confirm: Fall of the equalising reservoir that confirms it.
        confirm_time: Time within which it must.
        step: Fall of the equalising reservoir that is worth another order: the reporting step of 49 CFR 232.403.
        held_swing: Swing of the equalising reservoir within ``held_window`` under which it is held.
        held_window: Over this time.
        rise: Rise of the equalising reservoir that is a release.
        emergency_fall: Fall of the head pipe that is an emergency.
        emergency_window: Within this time.
        recovery: Rise of the head pipe above its lowest that ends one.
    """

    history: float = 60.0
    setup_time: float = 60.0
    setup_pressure: float = 45.0
    stable_swing: float = 1.0
    stable_window: float = 15.0
    drop: float = 1.5
    drop_window: float = 3.0
    confirm: float = 1.5
    confirm_time: float = 5.0
    step: float = 2.0
    held_swing: float = 0.1
    held_window: float = 0.5
    rise: float = 1.5
    emergency_fall: float = 5.0
    emergency_window: float = 1.0
    recovery: float = 1.0

    def __post_init__(self) -> None:
        check_numbers(self, "the settings of a brake computer")
        windows = (self.stable_window, self.drop_window + self.confirm_time, self.held_window, self.emergency_window)
        if max(windows) > self.history:
            raise ConfigError(
                "not the settings of a brake computer: it looks farther back than it remembers",
                where="computer settings",
                expected=f"windows of at most {self.history:g} s, the history", got=f"{max(windows):g} s",
            )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Pressures at one sample in psi gauge.

    Args:
        equalising: Equalising reservoir.
        head: Brake pipe at the head.
        tail: Brake pipe at the end of the train, as last reported.
    """

    equalising: float
    head: float
    tail: float


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """State after a sample, and what was sent.

    Args:
        state: The state.
        message: The order given in this sample, if any.
    """

    state: State
    message: Message | None = None


class BrakeComputer:
    """The state machine, one sample at a time.

    Args:
        sample_time: In s.
        settings: Thresholds.
        charged: Whether the train is known to be charged and stable: begins in Release with its first reading as
            operating pressures instead of in Setup. For traces that begin so.

    Example:
        >>> computer = BrakeComputer(sample_time=0.1, charged=True)
        >>> charged = Reading(equalising=90.0, head=90.0, tail=88.0)
        >>> computer.step(charged).state.name
        'RELEASE'
    """

    def __init__(self, *, sample_time: float, settings: ComputerSettings | None = None, charged: bool = False) -> None:
        self.settings = settings or ComputerSettings()
        self._charged, self._setup_complete = charged, charged
        self.state = State.RELEASE if charged else State.SETUP
        self.operating: Reading | None = None
        self._er, self._head, self._tail = (
            Ring(seconds=self.settings.history, sample_time=sample_time) for _ in range(3)
        )
        self._sample_time, self._count = sample_time, 0
        self._entered = 0.0
        self._sent = 0.0
        self._lowest = 0.0

    @property
    def time(self) -> float:
        """Of the last sample in s."""
        return max(self._count - 1, 0) * self._sample_time

    def step(self, reading: Reading) -> Outcome:
        """One sample.

        Args:
            reading: The pressures.

        Returns:
            The state after it, and the order that it led to.
        """
        self._count += 1
        self._er.push(reading.equalising)
        self._head.push(reading.head)
        self._tail.push(reading.tail)
        if self.operating is None and self._charged:
            self.operating = reading
        if self.state is not State.EMERGENCY and self._emergency():
            self._lowest = reading.head
            return self._enter(State.EMERGENCY, self._message(Order.EMERGENCY))
        handler = {
            State.SETUP: self._in_setup,
            State.STABILITY: self._in_stability,
            State.RELEASE: self._in_release,
            State.QUALIFY_MINIMUM: self._in_minimum,
            State.QUALIFY_SERVICE: self._in_service,
            State.QUALIFY_DEEPER: self._in_deeper,
            State.EMERGENCY: self._in_emergency,
        }[self.state]
        return handler(reading)

    def _enter(self, state: State, message: Message | None = None) -> Outcome:
        if state is not self.state:
            self._entered = self.time
        self.state = state
        return Outcome(state=state, message=message)

    def _message(self, order: Order) -> Message:
        operating = self._er.newest if self.operating is None else self.operating.equalising
        return Message(order=order, time=self.time, reduction=max(0.0, operating - self._er.newest))

    # --- conditions

    def _emergency(self) -> bool:
        s = self.settings
        return -self._head.change(s.emergency_window) >= s.emergency_fall

    def _stable(self, *rings: Ring) -> bool:
        s = self.settings
        return all(ring.covers(s.stable_window) and ring.swing(s.stable_window) <= s.stable_swing for ring in rings)

    def _falling(self) -> bool:
        s = self.settings
        recent = self._head.recent(s.drop_window)
        return bool(recent.max() - recent[-1] >= s.drop) and self._head.change(s.held_window) < 0.0

    def _rising(self) -> bool:
        recent = self._er.recent(self.settings.drop_window)
        return (
            bool(recent[-1] - recent.min() >= self.settings.rise) and self._er.change(self.settings.held_window) > 0.0
        )

    # --- states

    def _in_setup(self, reading: Reading) -> Outcome:
        s = self.settings
        if self.time >= s.setup_time and reading.head >= s.setup_pressure and reading.equalising >= s.setup_pressure:
            self._setup_complete = True
            return self._enter(State.STABILITY)
        return self._enter(State.SETUP)

    def _in_stability(self, reading: Reading) -> Outcome:
        if self._falling():
            return self._enter(State.QUALIFY_MINIMUM)
        if self._stable(self._er, self._head, self._tail):
            self.operating = reading
            return self._enter(State.RELEASE, self._message(Order.UPDATE))
        return self._enter(State.STABILITY)

    def _in_release(self, reading: Reading) -> Outcome:  # noqa: ARG002 - the rings know
        if self._falling():
            return self._enter(State.QUALIFY_MINIMUM)
        waited = self.time - self._entered >= self.settings.stable_window
        if waited and not self._stable(self._head):
            return self._enter(State.STABILITY)
        return self._enter(State.RELEASE)

    def _in_minimum(self, reading: Reading) -> Outcome:
        s = self.settings
        if self._er.recent(s.drop_window + s.confirm_time).max() - reading.equalising >= s.confirm:
            self._sent = reading.equalising
            return self._enter(State.QUALIFY_SERVICE, self._message(Order.MINIMUM))
        if self.time - self._entered > s.confirm_time:
            return self._enter(State.STABILITY)
        return self._enter(State.QUALIFY_MINIMUM)

    def _in_service(self, reading: Reading) -> Outcome:
        s = self.settings
        if self._rising():
            return self._enter(State.STABILITY, self._message(Order.RELEASE))
        message = None
        held = self._er.swing(s.held_window) <= s.held_swing
        if self._sent - reading.equalising >= (s.held_swing if held else s.step):
            self._sent = reading.equalising
            message = self._message(Order.SERVICE)
        return self._enter(State.QUALIFY_DEEPER if held else State.QUALIFY_SERVICE, message)

    def _in_deeper(self, reading: Reading) -> Outcome:
        s = self.settings
        if self._rising():
            return self._enter(State.STABILITY, self._message(Order.RELEASE))
        if self._sent - reading.equalising >= s.step:
            self._sent = reading.equalising
            return self._enter(State.QUALIFY_SERVICE, self._message(Order.SERVICE))
        return self._enter(State.QUALIFY_DEEPER)

    def _in_emergency(self, reading: Reading) -> Outcome:
        self._lowest = min(self._lowest, reading.head)
        # The air of a short train swings below the atmosphere and back: no charge comes with that.
        rise = reading.head - max(self._lowest, 0.0)
        recovering = rise >= self.settings.recovery and not self._emergency()
        if recovering and self._er.newest >= reading.head:
            after = State.RELEASE if self._setup_complete else State.SETUP
            return self._enter(after, self._message(Order.RELEASE))
        return self._enter(State.EMERGENCY)
