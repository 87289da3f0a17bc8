"""What a vehicle is: mass, length, running resistance, brake rigging, traction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.airbrake.settings import check_numbers
from sysid.errors import ConfigError
from sysid.rail.constants import KMH, MPH, POUND_FORCE, SHORT_TON


def _need(condition: bool, what: str, *, where: str, expected: str, got: object) -> None:
    if not condition:
        raise ConfigError(what, where=where, expected=expected, got=got, remedy="correct the value; units are SI")


@dataclass(frozen=True, kw_only=True)
class Davis:
    """Running resistance ``a + b v + c v^2`` on level straight track.

    Args:
        a: In N.
        b: In N per m/s.
        c: In N per (m/s)2.

    Raises:
        ConfigError: If one of them is negative.

    Example:
        >>> round(Davis(a=1000.0, b=10.0, c=2.0).force(10.0))
        1300
    """

    a: float
    b: float
    c: float

    def __post_init__(self) -> None:
        check_numbers(self, "a running resistance", from_zero=("a", "b", "c"))

    def force(self, speed: float) -> float:
        """Resistance in N at a speed in m/s."""
        v = abs(speed)
        return self.a + self.b * v + self.c * v * v


def modified_davis(mass: float, axles: int, *, drag: float = 0.07) -> Davis:
    """The modified Davis equation of Ensemble 16 of the American Railway Engineering Association.

    ``R = 0.6 W + 20 n + 0.01 W V + K V^2`` with R in lb, W in short tons, n axles, V in mph, as A. A. Trani prints it
    (per ton) in "Rail Resistance Equations", Virginia Tech CEE 3604. K is 0.07 for conventional equipment, 0.0935 for
    containers and 0.16 for trailers on flat wagons.

    Args:
        mass: Of the vehicle in kg.
        axles: Their number.
        drag: K, in lb per mph2.

    Returns:
        The resistance in SI.

    Example:
        >>> loaded = modified_davis(120e3, 4)
        >>> round(loaded.force(80 / 3.6) / 120.0, 1)  # N per tonne
        14.8
    """
    tons = mass / SHORT_TON
    return Davis(
        a=(0.6 * tons + 20.0 * axles) * POUND_FORCE,
        b=0.01 * tons * POUND_FORCE / MPH,
        c=drag * POUND_FORCE / MPH**2,
    )


@dataclass(frozen=True, kw_only=True)
class Shoe:
    """Friction of a brake shoe that falls with speed: ``base (v + reference) / (slope v + reference)``.

    Form and numbers are ours, of the size of a composition shoe's.

    Args:
        base: Coefficient at rest.
        reference: In m/s.
        slope: How far it falls: to ``base / slope`` at high speed.

    Raises:
        ConfigError: If a number is not positive or the slope is below 1.

    Example:
        >>> round(Shoe().friction(80 / 3.6), 3)
        0.267
    """

    base: float = 0.36
    reference: float = 150.0 * KMH
    slope: float = 2.0

    def __post_init__(self) -> None:
        check_numbers(self, "the friction of a brake shoe")
        _need(
            self.slope >= 1.0,
            "not the friction of a brake shoe: it rises with speed",
            where="shoe, slope",
            expected="from 1 on",
            got=self.slope,
        )

    def friction(self, speed: float) -> float:
        """Coefficient at a speed in m/s."""
        v = abs(speed)
        return self.base * (v + self.reference) / (self.slope * v + self.reference)


@dataclass(frozen=True, kw_only=True)
class Rigging:
    """From cylinder pressure to the force of the shoes.

    The area is that of the dissertation's cylinder. Ratio and efficiency are ours: together they give a wagon of
    120 t a net braking ratio of 11 % at 64 psi, the full service equalisation of a running pressure of 90 psi.

    Args:
        area: Piston area in m2.
        ratio: Total lever ratio: shoe force over piston force without losses.
        efficiency: Share that reaches the shoes.
        spring_pressure: Gauge pressure in Pa that overcomes the release spring (ours: 5 psi).
        shoe: Friction of the shoes.

    Raises:
        ConfigError: If a number is out of range.

    Example:
        >>> rigging = Rigging()
        >>> round(rigging.shoe_force(64 * 6894.76) / (120e3 * 9.80665), 3)
        0.102
    """

    area: float = 0.06477
    ratio: float = 7.0
    efficiency: float = 0.65
    spring_pressure: float = 5.0 * 6_894.76
    shoe: Shoe = Shoe()

    def __post_init__(self) -> None:
        check_numbers(self, "a brake rigging", from_zero=("area", "ratio", "spring_pressure"))
        _need(
            self.efficiency <= 1.0, "not a brake rigging: more force than the lever gives", where="rigging, efficiency",
            expected="above 0 and at most 1", got=self.efficiency,
        )  # fmt: skip

    @property
    def gain(self) -> float:
        """Shoe force in N per Pa above the spring."""
        return self.area * self.ratio * self.efficiency

    def shoe_force(self, pressure: float) -> float:
        """Normal force of all shoes in N at a gauge pressure in Pa."""
        return self.gain * max(0.0, pressure - self.spring_pressure)


@dataclass(frozen=True, kw_only=True, eq=False)
class NotchCurves:
    """Force at the rail over speed for every notch: positive notches pull, negative ones brake, 0 coasts.

    Args:
        speed_step: Spacing of the speeds in m/s; the first is 0, beyond the last the force is held.
        forces: For each notch the force in N (its size) at each speed. A braking curve that does
            not begin at 0 N holds the train at rest, as one that is blended with friction does.

    Raises:
        ConfigError: If the notches are not consecutive or a curve does not fit.
    """

    speed_step: float
    forces: Mapping[int, NDArray[np.float64]]

    def __post_init__(self) -> None:
        notches = sorted({0, *self.forces})
        _need(
            notches == list(range(notches[0], notches[-1] + 1)),
            "a notch is missing",
            where="notches",
            expected="consecutive notches around 0",
            got=notches,
        )
        lengths = {len(curve) for curve in self.forces.values()}
        _need(
            len(lengths) == 1 and min(lengths) >= 2 and self.speed_step > 0.0,
            "the curves of the notches differ in length",
            where="notches",
            expected="one force per speed, at least two",
            got=sorted(lengths),
        )
        for notch, curve in self.forces.items():
            good = np.isfinite(curve).all() and np.min(curve) >= 0.0
            _need(
                bool(good),
                f"the curve of notch {notch} cannot be used",
                where="notches",
                expected="finite sizes of force from 0 N on",
                got=np.asarray(curve)[:3],
            )

    @property
    def lowest(self) -> int:
        """The deepest braking notch, at most 0."""
        return min(0, *self.forces)

    @property
    def highest(self) -> int:
        """The highest traction notch, at least 0."""
        return max(0, *self.forces)

    def table(self) -> NDArray[np.float64]:
        """Signed forces, shape ``(n_notches, n_speeds)``, from the deepest notch up."""
        length = len(next(iter(self.forces.values())))
        rows = [
            np.sign(notch) * np.asarray(self.forces.get(notch, np.zeros(length)), dtype=np.float64)
            for notch in range(self.lowest, self.highest + 1)
        ]
        return np.ascontiguousarray(np.vstack(rows))

    def force(self, notch: int, speed: float) -> float:
        """Signed force in N at a notch and a speed in m/s."""
        curve = self.table()[notch - self.lowest]
        return float(np.interp(abs(speed), self.speed_step * np.arange(len(curve)), curve))


MOST_NOTCHES = 100
"""In each direction (ours)."""


def diesel_electric(
    *,
    power: float = 3.1e6,
    starting_effort: float = 8.0e5,
    braking_power: float = 3.0e6,
    braking_effort: float = 4.3e5,
    fade_speed: float = 3.0,
    notches: int = 8,
    top_speed: float = 45.0,
) -> NotchCurves:
    """Curves of a diesel-electric locomotive; all defaults are ours, of the size of a six-axle AC locomotive.

    A notch n of N gives the share n/N of the starting effort and (n/N)^1.5 of the power: ``min(share F, share P / v)``.
    Dynamic braking has the share n/N of both and fades out linearly below ``fade_speed``; with a fade speed of 0 it
    is blended with friction down to rest.

    Args:
        power: At the rail in the highest notch, in W.
        starting_effort: In N.
        braking_power: In W.
        braking_effort: In N.
        fade_speed: In m/s.
        notches: In each direction.
        top_speed: Last speed of the table in m/s.

    Returns:
        The curves.

    Raises:
        ConfigError: If there is no notch, or a number cannot be.

    Example:
        >>> curves = diesel_electric()
        >>> round(curves.force(8, 20.0) * 20.0 / 1e6, 2), curves.force(-8, 0.0)
        (3.1, -0.0)
    """
    _need(
        float(notches).is_integer() and 1 <= notches <= MOST_NOTCHES,
        "a locomotive has notches",
        where="power, notches",
        expected=f"a whole number from 1 to {MOST_NOTCHES}",
        got=notches,
    )
    step = 0.25
    speeds = step * np.arange(round(top_speed / step) + 1)
    safe = np.maximum(speeds, 1e-9)
    forces: dict[int, NDArray[np.float64]] = {}
    for notch in range(1, notches + 1):
        share = notch / notches
        forces[notch] = np.minimum(share * starting_effort, share**1.5 * power / safe)
        braking = share * np.minimum(braking_effort, braking_power / safe)
        forces[-notch] = braking * np.minimum(1.0, speeds / fade_speed) if fade_speed > 0.0 else braking
    return NotchCurves(speed_step=step, forces=forces)


@dataclass(frozen=True, kw_only=True, eq=False)
class Vehicle:
    """One vehicle, a point mass of a length.

    Args:
        mass: In kg, the share of rotating parts included.
        length: Between the pulling faces of its couplers in m.
        davis: Running resistance.
        rigging: From cylinder pressure to shoe force; ``None`` for a vehicle whose air brake does not act (a
            locomotive that is bailed off).
        notches: Traction and dynamic brake; ``None`` for a wagon.
        name: For people.

    Raises:
        ConfigError: If mass or length is not positive.
    """

    mass: float
    length: float
    davis: Davis
    rigging: Rigging | None = None
    notches: NotchCurves | None = None
    name: str = "wagon"

    def __post_init__(self) -> None:
        check_numbers(self, f"a vehicle ({self.name})")
