"""Brake equipment as rows of data: which valve stands at a car, with its chokes, and at which pressure the pipe runs.

The AB family differs in what a valve gives back to the pipe and takes from it; a distributor of UIC leaflet 540 works
otherwise (``Variant.graduated_release``), and its chokes are chosen for the times of UIC 540 and 543: a cylinder filled
to 95 % in 3 to 5 s in position P and in 18 to 30 s in G, emptied to 0.4 bar in 15 to 20 s and in 45 to 60 s.
``tests/airbrake/test_equipment.py`` measures them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

from sysid.airbrake.consist import BrakeValve
from sysid.airbrake.variant import USUAL, Variant
from sysid.units import PSI_IN_PA

BAR = 1e5


@dataclass(frozen=True, kw_only=True)
class Equipment:
    """One row.

    Args:
        variant: How the valve works.
        valve: Its chokes and volumes.
        running_pressure: Psi gauge.
        about: What it is, for the docs.
    """

    variant: Variant = USUAL
    valve: BrakeValve = field(default_factory=BrakeValve)
    running_pressure: float = 90.0
    about: str


_UIC = dataclasses.replace(
    USUAL,
    graduated_release=True,
    quick_service_limit=0.5 * BAR,
    equalising_rate=0.3 * BAR,
)
_POSITION_P = BrakeValve(
    auxiliary_volume=0.1,
    action_volume=0.004,
    charge_auxiliary=6e-6,
    charge_action=1.5e-7,
    quick_service=1e-6,
    apply=1.9e-5,
    release=8.2e-6,
)

EQUIPMENT: Mapping[str, Equipment] = {
    "ab": Equipment(
        variant=dataclasses.replace(USUAL, accelerated_service=False, accelerated_emergency=False),
        about="AB: a release is carried on by the pipe alone",
    ),
    "abd": Equipment(about="ABD: each valve gives air back to the pipe as it releases; the usual valve"),
    "abdw": Equipment(
        variant=dataclasses.replace(USUAL, accelerated_application=True),
        about="ABDW, and ABDX with what it has of it: each valve vents the pipe for as long as an application goes on",
    ),
    "uic-p": Equipment(
        variant=_UIC,
        valve=_POSITION_P,
        running_pressure=5.0 * BAR / PSI_IN_PA,
        about="a distributor of UIC 540 in position P (passenger), 5 bar, graduated release",
    ),
    "uic-g": Equipment(
        variant=_UIC,
        valve=dataclasses.replace(_POSITION_P, apply=3.1e-6, release=2.65e-6),
        running_pressure=5.0 * BAR / PSI_IN_PA,
        about="the same in position G (goods)",
    ),
}
"""By the name that data sets give: ``options: {equipment: uic-g}``."""
