"""Variants of the brake model: Appendix C as printed, and what a real ABDX valve does instead.

Every difference is a field of its own and can be switched alone. ``LISTING`` is the print (with the
reading that the fields describe where the print cannot be read in one way), ``PHYSICAL`` has every repair of a valve,
``ACOUSTIC`` gives the air in the pipe its mass too.
"""

from __future__ import annotations

import dataclasses
import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sysid.errors import ConfigError
from sysid.units import PSI_IN_PA

LONGEST_DELAY = 60.0
"""Of ``rising_delay`` in s: every step of it is remembered for every valve."""


class QuickService(enum.Enum):
    """What opens the vent that carries an application from car to car."""

    COMMAND = "command"
    """The handle's position, known to every car at once (as printed: the front runs at 3,400 ft/s)."""
    LOCAL = "local"
    """A pipe that falls below the quick-action chamber, until the cylinder has its limit (as in the valve)."""
    NONE = "none"


@dataclass(frozen=True, kw_only=True)
class Variant:
    """One reading of the model. Defaults are those of the printed listing.

    Args:
        charge_from_upstream: Charging flows take the upstream pressure as their factor, like all other flows.
            The print takes the downstream pressure, which slows the charging of an empty reservoir.
        emergency_check_valve: The emergency reservoir charges only from a pipe above it. The print compares
            it with the auxiliary reservoir alone and can push air uphill out of an empty pipe.
        quick_service: What opens the local vent. The print's gate on the quick-action chamber is
            overwritten by one on the command, which is news that no car can have.
        quick_service_limit: Cylinder pressure in Pa gauge that closes the local vent (``LOCAL`` only).
        rising_delay: Age in s of the pipe pressure ``P3i`` with which the printed release compares; the
            print leaves it undefined. Not used by a latched release.
        latched_release: Once the pipe is ``release_rise`` above the auxiliary reservoir, the cylinder is
            open until the next application. The print closes it when the auxiliary has caught up, which
            traps up to 5 psi.
        feed_closed_in_lap: The reservoirs charge in release only, as through the slide valve's feed
            groove. Without it the auxiliary follows a slowly rising pipe at the tail of a train, and the
            release threshold is never reached. Needs ``latched_release``.
        graduating_lap: Once ``apply_drop`` has moved the slide valve, its graduating stem keeps the auxiliary at
            the pipe's pressure: the passage to the cylinder is open in proportion to the difference, fully at
            ``service_drop``. The print is open above ``apply_drop`` and shut below, and with the empty cylinder a
            full service stops 4 psi short of equalisation. Needs ``latched_release``.
        blowback_after_emergency: The cylinder empties into the pipe only after an emergency. The print
            does so in full service too, where the cylinder ends above the pipe.
        release_blocks_application: Auxiliary to cylinder is shut while the cylinder is open. The print
            drains the auxiliary through the open cylinder after an emergency.
        piston: The cylinder's volume follows the piston, which starts empty, and its air is conserved. The print
            starts with the full volume at atmospheric pressure, which adds 3.7 psi in full service.
        relay_band: Pipe above the equalising reservoir in Pa that opens the head valve's exhaust fully, in
            proportion below. ``None`` is the printed on-off valve, which chatters by 0.1 psi.
        equalising_rate: Rate in Pa/s at which the equalising reservoir follows a reduction (ours: some 4 psi/s,
            so that a service reduction on a short train does not trip the emergency). Needs ``relay_band``.
        laminar_ratio: Pressure ratio above which flow is linear, which removes the chatter between equal
            pressures. ISO 6358 implementations use 0.995 to 0.999; 0.995 is stable at a step of 1 ms.
        exhaust_as_printed: The air that leaves an open cylinder has no sign in the print: it is taken from a cylinder
            that has none left, too, which falls below the atmosphere (-0.78 psi after a full service of two pairs).
            ``LISTING`` departs from the print here and signs the flow, as all others are; this switch is the print to
            the letter.
        pipe_momentum: The air in the pipe has mass: the flow between two vehicles follows their difference of pressure
            with the inertia of the air between them, so that no wave runs faster than sound
            (``sqrt(gamma R T)``, 346 m/s: a front is too quick for the wall to keep its temperature; all else stays
            isothermal). The print's flow follows at once, and the wave of a release, which every valve pushes on,
            runs at 407 m/s through 101 vehicles; with momentum at 316 m/s, and an emergency at 248 m/s, a tenth below
            the 900 ft/s of manuals. Needs ``laminar_ratio``.
        leakage: The pipe of every vehicle leaks: Pa/s by which it falls at the running pressure where nothing feeds it
            (a hole of constant area, so that the flow falls with the pressure). 574.6 Pa/s are the 5 psi/min that
            49 CFR 232.205 (c) allows; the print's pipe is tight.
        speed_gates: A train at rest vents nothing, releases its brakes and is recharged, as printed.
        accelerated_service: Emergency reservoir to pipe on a service release (ABD and later; not AB).
        accelerated_emergency: Cylinder to pipe on a release after an emergency (ABD and later; not AB).
        accelerated_application: The local vent goes on for as long as the pipe falls at a service rate, also when the
            cylinder has its limit: the accelerated application valve of ABDW, which ABDX has built in.
        graduated_release: A distributor of UIC leaflet 540 in place of the AB family's valve: the cylinder follows
            what the pipe has fallen below a control reservoir, down as well as up (``first_fall``, ``full_fall`` and
            ``cylinder_limit`` of :class:`~sysid.airbrake.consist.BrakeValve`; the chamber ``action`` is the control
            reservoir, ``auxiliary`` the supply reservoir behind a check valve, ``emergency`` is not used). An
            emergency is a full application. Needs ``laminar_ratio``.

    Raises:
        ConfigError: If a field needs another that is not set, or a number is out of range.
    """

    charge_from_upstream: bool = False
    emergency_check_valve: bool = False
    quick_service: QuickService = QuickService.COMMAND
    quick_service_limit: float = 10.0 * PSI_IN_PA
    rising_delay: float = 0.1
    latched_release: bool = False
    feed_closed_in_lap: bool = False
    graduating_lap: bool = False
    blowback_after_emergency: bool = False
    release_blocks_application: bool = False
    piston: bool = False
    relay_band: float | None = None
    equalising_rate: float | None = None
    laminar_ratio: float | None = None
    exhaust_as_printed: bool = False
    pipe_momentum: bool = False
    leakage: float = 0.0
    speed_gates: bool = True
    accelerated_service: bool = True
    accelerated_emergency: bool = True
    accelerated_application: bool = False
    graduated_release: bool = False

    def __post_init__(self) -> None:
        needs = {
            "feed_closed_in_lap": "latched_release",
            "graduating_lap": "latched_release",
            "equalising_rate": "relay_band",
            "pipe_momentum": "laminar_ratio",
            "graduated_release": "laminar_ratio",
        }
        for name, other in needs.items():
            if getattr(self, name) and not getattr(self, other):
                raise ConfigError(
                    f"{name} needs {other}",
                    where="variant",
                    expected=f"{other} beside it",
                    got=f"{name} alone",
                    remedy=f"set {other} too, or leave {name} out",
                )
        if not 0.0 <= self.leakage < math.inf:
            raise ConfigError(
                "the leakage is not a rate", where="variant", expected="Pa/s, 0 or above", got=self.leakage,
                remedy="write for example leakage: 574.6, which is 5 psi/min",
            )  # fmt: skip
        if self.rising_delay > LONGEST_DELAY:
            raise ConfigError(
                "a valve does not remember that long", where="variant, rising_delay",
                expected=f"at most {LONGEST_DELAY:g} s", got=self.rising_delay,
            )  # fmt: skip
        for name in ("relay_band", "equalising_rate", "rising_delay", "quick_service_limit"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                raise ConfigError(f"{name} is not positive", where="variant", expected="a number above 0", got=value)

    def with_options(self, options: Mapping[str, Any]) -> Variant:
        """The same variant with some fields changed, by name.

        Args:
            options: Field names and values; ``quick_service`` as text.

        Returns:
            The changed variant.

        Raises:
            ConfigError: If a name is unknown or a value does not fit.

        Example:
            >>> PHYSICAL.with_options({"quick_service": "none"}).quick_service.name
            'NONE'
        """
        fields = {f.name: f for f in dataclasses.fields(self)}
        changes: dict[str, Any] = {}
        for name, value in options.items():
            if name not in fields:
                raise ConfigError.unknown(f"unknown switch {name}", name, fields, "name one of these", where="variant")
            changes[name] = self._checked(name, value)
        return dataclasses.replace(self, **changes)

    def _checked(self, name: str, value: Any) -> Any:
        if name == "quick_service":
            try:
                return QuickService(value)
            except ValueError:
                choices = [choice.value for choice in QuickService]
                raise ConfigError.unknown(
                    "unknown quick service", value, choices, "name one of these", where="variant"
                ) from None
        printed = getattr(LISTING, name)
        if isinstance(printed, bool) and isinstance(value, bool):
            return value
        if printed is None and value is None:
            return None
        if isinstance(printed, bool) or isinstance(value, bool) or not isinstance(value, int | float):
            kind = (
                "true or false" if isinstance(printed, bool) else "a number" + (" or null" if printed is None else "")
            )
            raise ConfigError("the switch has the wrong type", where=f"variant, {name}", expected=kind, got=value)
        return float(value)


LISTING = Variant()
"""Appendix C as printed, but for the sign of the cylinder's exhaust (``exhaust_as_printed``)."""

PHYSICAL = Variant(
    charge_from_upstream=True,
    emergency_check_valve=True,
    quick_service=QuickService.LOCAL,
    latched_release=True,
    feed_closed_in_lap=True,
    graduating_lap=True,
    blowback_after_emergency=True,
    release_blocks_application=True,
    piston=True,
    relay_band=1.0 * PSI_IN_PA,
    equalising_rate=4.0 * PSI_IN_PA,
    laminar_ratio=0.995,
    speed_gates=False,
)
"""What a real ABDX valve does; every shipped data set names it. Its pipe has no inertia, as the print's."""

ACOUSTIC = dataclasses.replace(PHYSICAL, pipe_momentum=True)
"""``PHYSICAL`` with the momentum of the air: no wave is faster than sound. What is made anew has it unless it says
otherwise; the data sets that are shipped, and all published figures, name ``PHYSICAL``."""

VARIANTS: Mapping[str, Variant] = {"listing": LISTING, "physical": PHYSICAL, "acoustic": ACOUSTIC}
"""The presets by name."""

USUAL_VARIANT = "acoustic"
"""The preset of what does not name one."""

USUAL = VARIANTS[USUAL_VARIANT]
