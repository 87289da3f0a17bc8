"""Comfortable deceleration: the jerk-limited request, and the inverse of a brake characteristic, found from a trace.

After "Transit vehicle deceleration control system and method". Decelerations are positive; the source's units are
mph/s, ours m/s2. The signal P in mA asks for traction from 100 to 60 and for braking from 60 to 20.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sysid.errors import ConfigError, TraceError
from sysid.rail.constants import MPH
from sysid.traces import Trace
from sysid.units import convert

RATE, JERK = 2.0 * MPH, 1.0 * MPH
"""Deceleration in m/s2 and jerk in m/s3 of the source: 2 mph/s and 1 mph/s2."""

OPEN_LOOP = 2.0
"""Seconds of open loop after a change of the speed command."""

COAST, FULL_SERVICE, CRUISE, FULL_TRACTION = 60.0, 20.0, 70.0, 100.0
"""Signal in mA: no effort; full service brake; speed keeping; full traction."""

COAST_RATE = 0.7 * MPH
"""Deceleration in m/s2 that friction alone gives."""


@dataclass(frozen=True, kw_only=True)
class JerkProfile:
    """Speed that falls from one value to another with limited deceleration and jerk.

    With a limit on the jerk, acceleration is linear, speed quadratic and distance cubic in time at the corners; with a
    limit on the rate of the jerk too, one order higher (the source's figures 7A and 7B).

    Args:
        start: Speed in m/s.
        stop: Speed in m/s, lower.
        rate: Largest deceleration in m/s2; a small change does not reach it.
        jerk: Largest jerk in m/s3.
        jerk_rate: Largest rate of the jerk in m/s4; ``None`` for no limit.

    Raises:
        ConfigError: If the speed does not fall, or a limit is not positive.

    Example:
        >>> profile = JerkProfile(start=40 * MPH, stop=20 * MPH)
        >>> round(profile.duration, 9), round(profile.deceleration(5.0) / MPH, 9), round(profile.speed(12.0) / MPH, 6)
        (12.0, 2.0, 20.0)
    """

    start: float
    stop: float
    rate: float = RATE
    jerk: float = JERK
    jerk_rate: float | None = None

    def __post_init__(self) -> None:
        limits = (self.rate, self.jerk, self.jerk_rate if self.jerk_rate is not None else 1.0)
        if not (np.inf > self.start > self.stop >= 0.0 and all(0.0 < limit < np.inf for limit in limits)):
            raise ConfigError(
                "not a deceleration",
                where="jerk profile",
                expected="start above stop, stop from 0 on, positive limits",
                got=(self.start, self.stop, *limits),
            )

    def _corner(self, rate: float) -> float:
        """Time in s to reach a deceleration."""
        if self.jerk_rate is None:
            return rate / self.jerk
        turn = self.jerk / self.jerk_rate
        if rate >= self.jerk * turn:
            return rate / self.jerk + turn
        return 2.0 * math.sqrt(rate / self.jerk_rate)

    @cached_property
    def reached(self) -> float:
        """Deceleration in m/s2 that is reached."""
        change = self.start - self.stop
        if self.rate * self._corner(self.rate) <= change:
            return self.rate
        low, high = 0.0, self.rate
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if middle * self._corner(middle) <= change else (low, middle)
        return low

    @cached_property
    def corner(self) -> float:
        """Time in s of each corner."""
        return self._corner(self.reached)

    @cached_property
    def duration(self) -> float:
        """Time in s from one speed to the other."""
        return (self.start - self.stop) / self.reached + self.corner

    def _rise(self, t: float) -> tuple[float, float]:
        """Share of the deceleration, and its integral in s, after so long in a corner of shape 0 to 1."""
        length, reached = self.corner, self.reached
        t = min(max(t, 0.0), length)
        if self.jerk_rate is None:
            return t / length, 0.5 * t * t / length
        turn = min(self.jerk / self.jerk_rate, 0.5 * length)
        k = self.jerk_rate / reached
        if t <= turn:
            return 0.5 * k * t**2, k * t**3 / 6.0
        if t <= length - turn:
            s = t - turn
            return k * (0.5 * turn**2 + turn * s), k * (turn**3 / 6.0 + 0.5 * turn**2 * s + 0.5 * turn * s**2)
        s = length - t
        return 1.0 - 0.5 * k * s**2, 0.5 * length - s + k * s**3 / 6.0

    def deceleration(self, t: float) -> float:
        """Deceleration in m/s2 at a time in s after the beginning."""
        if t <= 0.0 or t >= self.duration:
            return 0.0
        return self.reached * min(self._rise(t)[0], self._rise(self.duration - t)[0])

    def speed(self, t: float) -> float:
        """Speed in m/s at a time in s after the beginning."""
        if t <= self.corner:
            return self.start - self.reached * self._rise(t)[1]
        if t <= self.duration - self.corner:
            return self.start - self.reached * (0.5 * self.corner + t - self.corner)
        return self.stop + self.reached * self._rise(self.duration - t)[1]


@dataclass(frozen=True, kw_only=True)
class Characteristic:
    """Deceleration over the signal, piecewise linear, and its inverse: the source's non-linear function generator.

    Args:
        signals: Knots in mA, falling from coasting to full service; one more than segments.
        decelerations: There in m/s2, not falling.

    Raises:
        ConfigError: If the knots are not such a characteristic.

    Example:
        >>> nominal = Characteristic(signals=(60.0, 49.0, 43.0, 32.0, 20.0), decelerations=(0.3, 0.3, 0.9, 1.5, 2.2))
        >>> [nominal.signal(a) for a in (0.1, 0.6, 0.9, 9.0)]
        [60.0, 46.0, 43.0, 20.0]
    """

    signals: tuple[float, ...]
    decelerations: tuple[float, ...]

    def __post_init__(self) -> None:
        p, a = np.array(self.signals), np.array(self.decelerations)
        fits = len(p) == len(a) >= 2 and bool(np.isfinite([p, a]).all())
        if not fits or np.any(np.diff(p) >= 0.0) or np.any(np.diff(a) < 0.0) or a[-1] <= a[0]:
            raise ConfigError(
                "not a brake characteristic",
                where="characteristic",
                expected="falling signals in mA with decelerations in m/s2 that do not fall",
                got=f"{self.signals} and {self.decelerations}",
            )

    @property
    def segments(self) -> int:
        """Their number."""
        return len(self.signals) - 1

    def deceleration(self, signal: float) -> float:
        """Deceleration in m/s2 at a signal in mA."""
        return float(np.interp(-signal, -np.array(self.signals), self.decelerations))

    def signal(self, request: float) -> float:
        """The signal in mA for a deceleration in m/s2: coasting as long as friction alone does it."""
        if request <= self.decelerations[0]:
            return self.signals[0]
        # Of knots with equal deceleration (the dead band) the last is where braking begins.
        a, p = np.array(self.decelerations), np.array(self.signals)
        last = np.concatenate([a[1:] > a[:-1], [True]])
        return float(np.interp(request, a[last], p[last]))


def identify_characteristic(
    trace: Trace,
    *,
    signal: str = "P",
    deceleration: str = "A",
    segments: int = 4,
    settle: float = 1.0,
    window: float = 2.0,
) -> Characteristic:
    """Find a brake characteristic from a trace in which the signal moves slowly over its range.

    Samples count where the signal has changed by less than ``settle`` within ``window``; knots and ordinates of the
    piecewise linear characteristic are then found together by least squares.

    Args:
        trace: With signal and deceleration, in mA and m/s2 or what these can be made of.
        signal: Its channel.
        deceleration: Its channel.
        segments: Of the characteristic.
        settle: In mA.
        window: In s.

    Returns:
        The characteristic over the range of the trace.

    Raises:
        TraceError: If too few samples are settled.
        UnitError: If a channel measures something else.
    """
    p, a = (
        convert(trace[name], trace.channel(name).unit, unit) for name, unit in ((signal, "mA"), (deceleration, "m/s^2"))
    )
    back = max(1, round(window / trace.sample_time))
    settled = np.zeros(len(p), dtype=np.bool_)
    settled[back:] = np.abs(p[back:] - p[:-back]) < settle
    settled &= trace.usable_samples & (p <= COAST)
    if settled.sum() < 10 * segments or np.ptp(p[settled]) < 5.0:
        raise TraceError(
            "the trace does not show the brake characteristic",
            where=f"trace {trace.name}",
            expected=f"at least {10 * segments} settled samples over more than 5 mA",
            got=f"{int(settled.sum())} settled samples",
            remedy="move the signal slowly, or in steps, over its braking range",
        )
    p, a = p[settled], a[settled]
    high, low = float(p.max()), float(p.min())

    def knots(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        widths = np.exp(shares - shares.max())
        return np.concatenate([[high], high - (high - low) * np.cumsum(widths) / widths.sum()])

    def ordinates(at: NDArray[np.float64]) -> NDArray[np.float64]:
        hats = np.stack([np.interp(-p, -at, unit) for unit in np.eye(len(at))], axis=1)
        return np.asarray(np.linalg.lstsq(hats, a, rcond=None)[0])

    def residual(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        at = knots(shares)
        return np.asarray(np.interp(-p, -at, ordinates(at)) - a)

    found = least_squares(residual, np.zeros(segments), x_scale=0.3)
    at = knots(found.x)
    return Characteristic(
        signals=tuple(at.tolist()), decelerations=tuple(np.maximum.accumulate(ordinates(at)).tolist())
    )


def grade_acceleration(tachometer: float, pendulum: float) -> float:
    """Acceleration by the grade in m/s2, from the wheels' acceleration less the pendulum's.

    A pendulum feels the vehicle's acceleration and the slope: ``a + g s``.

    Args:
        tachometer: Acceleration from the wheels in m/s2.
        pendulum: Acceleration from the pendulum in m/s2.

    Returns:
        Negative uphill.

    Example:
        >>> round(grade_acceleration(-0.5, -0.5 + 9.81 * 0.01), 4)
        -0.0981
    """
    return tachometer - pendulum
