"""What a train is made of: pipe, head valve, brake valves and cylinders, with the constants of Appendix C.

All constants are SI and those of the dissertation's Appendix C ("Run_Freio_V01") unless a line says
otherwise. Pressures measured from the atmosphere say so; differences of pressure need no reference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from sysid.airbrake.settings import check_numbers
from sysid.errors import ConfigError
from sysid.units import PSI_IN_PA, STANDARD_ATMOSPHERE_PA

TEMPERATURE = 298.0
"""Temperature of all air in K; the model is isothermal."""

MOST_PAIRS = 500
"""Longest train in wagon pairs (ours)."""


@dataclass(frozen=True, kw_only=True)
class Pipe:
    """The brake pipe of one vehicle.

    Args:
        radius: Inner radius in m (rEG): a pipe of 1 1/4 in.
        length: Length per vehicle in m (Legvag).
        area: Area between two vehicles in m2 (AEG).
        vehicle_length: Distance from one vehicle to the next in m (Lvag + Lcti).

    Raises:
        ConfigError: If one of them is not a finite number above 0.
    """

    radius: float = 0.015875
    length: float = 10.5
    area: float = 8e-4
    vehicle_length: float = 9.75 + 0.08

    def __post_init__(self) -> None:
        check_numbers(self, "a brake pipe")

    @property
    def volume(self) -> float:
        """Volume per vehicle in m3 (Veg = pi (2 r)^2 / 4 L)."""
        return math.pi * (2.0 * self.radius) ** 2 / 4.0 * self.length


@dataclass(frozen=True, kw_only=True)
class HeadValve:
    """The 26-L brake valve of a locomotive.

    Args:
        feed_area: Area into the pipe in m2 (AlocoI).
        exhaust_area: Area out of the pipe in m2 (AlocoO); twice that in an emergency.

    Raises:
        ConfigError: If one of them is not a finite number above 0.
    """

    feed_area: float = 9.5e-5
    exhaust_area: float = 8e-5

    def __post_init__(self) -> None:
        check_numbers(self, "a head valve")


CHOKES = (
    "charge_auxiliary", "charge_emergency", "charge_action", "apply", "release", "accelerate_service",
    "accelerate_emergency", "bleed_action", "quick_service", "emergency_vent",
)  # fmt: skip
"""Areas of a valve; one that a valve does not have is 0."""


@dataclass(frozen=True, kw_only=True)
class BrakeValve:
    """The ABDX valve of a wagon pair: areas in m2, thresholds in Pa, and the volumes it connects in m3.

    Args:
        auxiliary_volume: Auxiliary reservoir (Vaux).
        emergency_volume: Emergency reservoir (Vemg).
        action_volume: Quick-action chamber, which remembers the pipe's pressure (Vpsr).
        charge_auxiliary: Pipe to auxiliary reservoir (AegAX).
        charge_emergency: Pipe to emergency reservoir (AegEM).
        charge_action: Pipe to quick-action chamber, and the command-driven quick service (AegPSR).
        apply: Either reservoir to brake cylinder (AEGCF).
        release: Brake cylinder to atmosphere (Ascf).
        accelerate_service: Emergency reservoir to pipe on a service release (Aesr).
        accelerate_emergency: Brake cylinder to pipe on a release after an emergency (ACFEG).
        bleed_action: Quick-action chamber to atmosphere (APSRatm).
        quick_service: Pipe to atmosphere while the pipe falls (AEGatmPSR).
        emergency_vent: Pipe to atmosphere in an emergency (AegaATMEM).
        apply_drop: Auxiliary above pipe that applies (DAC).
        release_rise: Pipe above auxiliary that releases (DAL); 1.45 psi.
        service_drop: Action chamber above pipe that counts as a falling pipe (DSR).
        emergency_drop: Action chamber above pipe that trips the emergency (DPE); 26.1 psi.
        lap_band: Band about the command in which the listing stops a release (DPcEG).
        command_drop: Pipe above command that opens the listing's quick service (7000 in the text).
        empty_pipe: Absolute pipe pressure below which the listing stops a release (11E4 in the text).
        first_fall: Of a distributor of graduated release: pipe below the control reservoir that applies; half of it
            releases (ours: between the 0.3 bar in 60 s that must not apply and the 0.6 bar in 6 s that must).
        full_fall: The same that gives all of ``cylinder_limit``; 1.5 bar.
        cylinder_limit: Largest gauge pressure of its cylinder; 3.8 bar.
        opening_band: What the cylinder is off by at which its choke is fully open, in proportion below (ours).

    Raises:
        ConfigError: If one of them is not a finite number above 0; a choke may have no area.
    """

    auxiliary_volume: float = 0.041
    emergency_volume: float = 0.057
    action_volume: float = 0.015
    charge_auxiliary: float = 2e-6
    charge_emergency: float = 2e-6
    charge_action: float = 1e-6
    apply: float = 3.5e-6
    release: float = 3e-6
    accelerate_service: float = 8.5e-6
    accelerate_emergency: float = 8.5e-6
    bleed_action: float = 9e-7
    quick_service: float = 2e-7
    emergency_vent: float = 8e-4
    apply_drop: float = 7_000.0
    release_rise: float = 10_000.0
    service_drop: float = 1_000.0
    emergency_drop: float = 180_000.0
    lap_band: float = 20_000.0
    command_drop: float = 7_000.0
    empty_pipe: float = 110_000.0
    first_fall: float = 8_000.0
    full_fall: float = 150_000.0
    cylinder_limit: float = 380_000.0
    opening_band: float = 10_000.0

    def __post_init__(self) -> None:
        check_numbers(self, "a brake valve", from_zero=CHOKES)


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """The brake cylinder of a wagon pair.

    Appendix C declares a piston (area, stroke, a pressure PFmin of 10 psi) and then uses the full volume from
    the start. The travel at which the shoes touch, and the pressure that stretches the rigging to the full stroke,
    are ours: they are chosen so that a reduction of 16 psi gives 40 psi, the textbook's 2.5 psi per psi, while full
    service still equalises at the full volume.

    Args:
        area: Piston area in m2 (ACF).
        stroke: Full travel in m (Xst).
        contact_travel: Travel in m at which the shoes touch the wheels (ours).
        contact_pressure: Gauge pressure in Pa that takes the piston there against its spring (PFmin).
        stroke_pressure: Gauge pressure in Pa at which the travel is full (ours).

    Raises:
        ConfigError: If one of them is not a finite number above 0, or the shoes touch at the full stroke or behind it.
    """

    area: float = 0.06477
    stroke: float = 0.2122
    contact_travel: float = 0.1444
    contact_pressure: float = 10.0 * PSI_IN_PA
    stroke_pressure: float = 60.0 * PSI_IN_PA

    def __post_init__(self) -> None:
        check_numbers(self, "a brake cylinder")
        if not (self.contact_travel < self.stroke and self.contact_pressure < self.stroke_pressure):
            raise ConfigError(
                "not a brake cylinder: the shoes touch behind the full stroke", where="cylinder",
                expected="a contact_travel below stroke and a contact_pressure below stroke_pressure",
                got=f"{self.contact_travel:g} of {self.stroke:g} m, "
                f"{self.contact_pressure:g} of {self.stroke_pressure:g} Pa",
            )  # fmt: skip

    @property
    def volume(self) -> float:
        """Volume at full stroke in m3 (VOLCF)."""
        return self.area * self.stroke

    @property
    def contact_volume(self) -> float:
        """Volume in m3 when the shoes touch."""
        return self.area * self.contact_travel


@dataclass(frozen=True, kw_only=True)
class Consist:
    """One leading locomotive and wagon pairs behind it, one brake valve per pair.

    Nodes are numbered as in the listing: 1 is the leading locomotive, 2 the first wagon (pipe only), 3 the
    second, which carries the first pair's valve, and so on.

    Args:
        pairs: Number of wagon pairs.
        locomotives: Further locomotives, each given by the number of pairs ahead of it (1 to ``pairs``).
        running_pressure: Setting of the feed valve in psi gauge (Peq).
        pipe: The brake pipe.
        head: The locomotive's brake valve.
        valve: The wagon pair's brake valve.
        cylinder: The wagon pair's brake cylinder.
        loads: Share of the valve's pressure that a cylinder gets, one for all pairs or one for each: 1 is loaded,
            less is what an empty/load device leaves (AAR: a volume stands for what the cylinder does not take; UIC:
            a relay).
        retainers: Psi gauge that the retaining valve of a pair holds in its cylinder on a release, one for all or one
            for each; 0 is direct exhaust, 20 the high-pressure position of freight cars.

    Raises:
        ConfigError: If a number is out of its range.

    Example:
        >>> Consist(pairs=50).vehicles, Consist(pairs=2).valve_nodes
        (101, (3, 5))
    """

    pairs: int = 50
    locomotives: tuple[int, ...] = ()
    running_pressure: float = 90.0
    pipe: Pipe = field(default_factory=Pipe)
    head: HeadValve = field(default_factory=HeadValve)
    valve: BrakeValve = field(default_factory=BrakeValve)
    cylinder: Cylinder = field(default_factory=Cylinder)
    loads: float | tuple[float, ...] = 1.0
    retainers: float | tuple[float, ...] = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.pairs, bool) or not (isinstance(self.pairs, int) and 1 <= self.pairs <= MOST_PAIRS):
            raise ConfigError(
                "a train needs wagons, and not more than a railway can run", where="pairs",
                expected=f"an integer from 1 to {MOST_PAIRS}", got=self.pairs,
            )  # fmt: skip
        object.__setattr__(self, "locomotives", tuple(sorted(self.locomotives)))
        for ahead in self.locomotives:
            if not isinstance(ahead, int) or not 1 <= ahead <= self.pairs:
                raise ConfigError(
                    "a locomotive stands outside the train",
                    where="locomotives",
                    expected=f"numbers of pairs ahead of it, from 1 to {self.pairs}",
                    got=ahead,
                )
        if not 50.0 <= self.running_pressure <= 150.0:
            raise ConfigError(
                "this is no running pressure",
                where="running_pressure",
                expected="psi gauge, from 50 to 150 (70 to 110 are in use)",
                got=self.running_pressure,
                remedy="give it in psi gauge",
            )
        for name, low, high in (("loads", 0.2, 1.0), ("retainers", 0.0, 50.0)):
            values = self._of_pairs(getattr(self, name))
            if len(values) != self.pairs or not all(low <= value <= high for value in values):
                raise ConfigError(
                    f"{name} do not fit the train", where=name, got=getattr(self, name),
                    expected=f"one number from {low:g} to {high:g}, or {self.pairs} of them, one for each pair",
                )  # fmt: skip

    def _of_pairs(self, given: float | tuple[float, ...]) -> tuple[float, ...]:
        return tuple(given) if isinstance(given, tuple | list) else (float(given),) * self.pairs

    @property
    def load_of_pairs(self) -> tuple[float, ...]:
        """Share of the valve's pressure that each pair's cylinder gets."""
        return self._of_pairs(self.loads)

    @property
    def retained_by_pairs(self) -> tuple[float, ...]:
        """Psi gauge that each pair's retaining valve holds."""
        return self._of_pairs(self.retainers)

    @property
    def vehicles(self) -> int:
        """Number of vehicles, that is of pipe nodes."""
        return 1 + 2 * self.pairs + len(self.locomotives)

    @property
    def valve_nodes(self) -> tuple[int, ...]:
        """Node number (from 1) of each pair's valve, front to rear."""
        ahead = [sum(1 for place in self.locomotives if place < pair) for pair in range(1, self.pairs + 1)]
        return tuple(1 + 2 * pair + extra for pair, extra in zip(range(1, self.pairs + 1), ahead, strict=True))

    @property
    def port_nodes(self) -> tuple[int, ...]:
        """Node number (from 1) of each further locomotive."""
        return tuple(2 + 2 * place + index for index, place in enumerate(self.locomotives))

    @property
    def charged(self) -> float:
        """Running pressure in Pa absolute."""
        return self.running_pressure * PSI_IN_PA + STANDARD_ATMOSPHERE_PA
