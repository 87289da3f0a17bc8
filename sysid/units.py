"""Units of measurement: one pint registry, and gauge and absolute pressure told apart.

pint knows units but not what a pressure is measured from, so that a reading in gauge and one in
absolute pressure convert into each other without a word. Here the reference is a field of its own
(:class:`Reference`), and a conversion between the two adds or takes away one standard atmosphere.
Conversion happens once, at the door (ingest); inside everything is a plain float64 array.
"""

from __future__ import annotations

import enum
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from sysid.errors import UnitError

if TYPE_CHECKING:
    import pint
    from numpy.typing import NDArray

STANDARD_ATMOSPHERE_PA = 101_325.0
"""Standard atmosphere in Pa (ISO 2533:1975)."""

PSI_IN_PA = 6_894.76
"""One psi in Pa, to the six digits that the air-brake listing uses (dissertation, Appendix C)."""


class Reference(enum.Enum):
    """What a quantity is measured from. Only pressures have one."""

    NONE = "none"
    GAUGE = "gauge"
    ABSOLUTE = "absolute"


@cache
def _registry() -> pint.UnitRegistry[float]:
    # pint takes 0.3 s to import and build: only those who convert pay for it.
    import pint

    return pint.UnitRegistry(cache_folder=None)


def check_unit(unit: str) -> str:
    """Return ``unit`` if pint knows it.

    Args:
        unit: For example ``"psi"``, ``"kPa"``, ``"V"``, ``"1"``.

    Returns:
        The same text.

    Raises:
        UnitError: If it is not a unit, or hides a reference (``"barg"``).
    """
    if unit.lower() in {"barg", "psig", "bara", "psia"}:
        plain, letter = unit[:-1], unit[-1].lower()
        reference = "gauge" if letter == "g" else "absolute"
        raise UnitError(
            f"the unit {unit!r} mixes a unit and a reference",
            expected="a unit, and the reference beside it",
            got=unit,
            remedy=f"write unit: {plain} and reference: {reference}",
        )
    try:
        _registry().parse_units(unit if unit != "1" else "dimensionless")
    except Exception as error:  # pint raises many unrelated classes (tokenizer errors among them)
        raise UnitError(
            f"unknown unit {unit!r}",
            expected="a unit known to pint, such as psi, kPa, bar, V, degC, m/s or 1",
            got=unit,
            remedy="correct the unit in the header or in the data set's dataset.yaml",
        ) from error
    return unit


def convert(
    values: NDArray[np.float64],
    unit: str,
    to_unit: str,
    *,
    reference: Reference = Reference.NONE,
    to_reference: Reference | None = None,
) -> NDArray[np.float64]:
    """Convert values between units and, for pressures, between gauge and absolute.

    Args:
        values: Any shape.
        unit: Unit of ``values``.
        to_unit: Unit wanted.
        reference: What ``values`` are measured from.
        to_reference: What the result is measured from; ``None`` keeps ``reference``.

    Returns:
        The converted values, float64, same shape.

    Raises:
        UnitError: If the units do not measure the same quantity, or if only one of the two
            references is known.

    Example:
        >>> import numpy as np
        >>> bar = convert(np.array([5.0]), "bar", "bar", reference=Reference.GAUGE, to_reference=Reference.ABSOLUTE)
        >>> float(bar[0].round(5))
        6.01325
    """
    to_reference = reference if to_reference is None else to_reference
    source = _registry().parse_units(check_unit(unit) if unit != "1" else "dimensionless")
    target = _registry().parse_units(check_unit(to_unit) if to_unit != "1" else "dimensionless")
    if not source.is_compatible_with(target):
        raise UnitError(
            f"cannot convert {unit} to {to_unit}",
            expected=f"a unit of {target.dimensionality}",
            got=f"{unit}, a unit of {source.dimensionality}",
            remedy="correct the unit of the channel",
        )
    if (reference is Reference.NONE) != (to_reference is Reference.NONE):
        raise UnitError(
            "a reference is known on one side of the conversion only",
            expected="gauge or absolute on both sides, or on neither",
            got=f"{reference.value} -> {to_reference.value}",
            remedy="declare reference: gauge or reference: absolute for the channel",
        )
    converted = np.asarray(_registry().Quantity(np.asarray(values, dtype=np.float64), source).to(target).magnitude)
    if reference is to_reference:
        return converted
    atmosphere = float(_registry().Quantity(STANDARD_ATMOSPHERE_PA, "Pa").to(target).magnitude)
    return converted + atmosphere if to_reference is Reference.ABSOLUTE else converted - atmosphere
