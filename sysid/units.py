"""Units of measurement: one pint registry, and gauge and absolute pressure told apart.

pint knows units but not what a pressure is measured from, so that a reading in gauge and one in
absolute pressure convert into each other without a word. Here the reference is a field of its own
(:class:`Reference`), and a conversion between the two adds or takes away one standard atmosphere.
Conversion happens once, at the door (ingest); inside everything is a plain float64 array.
"""

from __future__ import annotations

import enum
import re
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from sysid.errors import UnitError
from sysid.written_units import USUAL_UNITS, plain_unit, registry

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


def in_unit(figure: str, unit: str) -> str:
    """A figure in its unit; a pure number has none to be told.

    Args:
        figure: As it is written.
        unit: Its unit; ``"1"`` of a pure number.

    Returns:
        Both.

    Example:
        >>> in_unit("0.5", "m"), in_unit("0.5", "1")
        ('0.5 m', '0.5')
    """
    return figure if unit == "1" else f"{figure} {unit}"


_IN_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "hns": 1e-7, "min": 60.0, "h": 3600.0}
"""Units that clocks count in: pint, which takes half a second to build, is not asked for what every file has."""

_ATMOSPHERE = {
    "Pa": STANDARD_ATMOSPHERE_PA,
    **{"hPa": 1013.25, "kPa": 101.325, "MPa": 0.101325, "bar": 1.01325, "mbar": 1013.25, "psi": 14.695948775513449},
}
"""The standard atmosphere in each usual unit of pressure."""


def is_pressure(unit: str) -> bool:
    """Whether a unit is one of pressure, so that a channel in it must say what it is measured from.

    Args:
        unit: Any text.

    Returns:
        True if it is.
    """
    if unit in USUAL_UNITS:
        return unit in _ATMOSPHERE
    return plain_unit(unit) is not None and _parsed(unit).is_compatible_with(_parsed("Pa"))


def atmosphere_in(unit: str) -> float:
    """The standard atmosphere.

    Args:
        unit: A unit of pressure.

    Returns:
        It, in that unit.

    Example:
        >>> atmosphere_in("bar"), atmosphere_in("atm")
        (1.01325, 1.0)
    """
    if unit in _ATMOSPHERE:
        return _ATMOSPHERE[unit]
    return float(registry().Quantity(STANDARD_ATMOSPHERE_PA, "Pa").to(_parsed(unit)).magnitude)


def check_unit(unit: str) -> str:
    """Return ``unit`` if pint knows it, or knows what people mean by it.

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
    if plain_unit(unit) is None:
        raise UnitError(
            f"unknown unit {unit!r}",
            expected="a unit known to pint, such as psi, kPa, bar, V, degC, m/s, m3/h or 1",
            got=unit,
            remedy="correct the unit in the header or in the data set's dataset.yaml; 1 takes the numbers as they are",
        )
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
    usual = unit == to_unit and unit in USUAL_UNITS
    seconds = _IN_SECONDS.get(unit) if to_unit == "s" else None
    source, target = (None, None) if usual or seconds is not None else _alike(unit, to_unit)
    if (reference is Reference.NONE) != (to_reference is Reference.NONE):
        raise UnitError(
            "a reference is known on one side of the conversion only",
            expected="gauge or absolute on both sides, or on neither",
            got=f"{reference.value} -> {to_reference.value}",
            remedy="declare reference: gauge or reference: absolute for the channel",
        )
    converted = np.array(values, dtype=np.float64)
    if seconds is not None:
        converted *= seconds
    elif source is not None:
        converted = np.asarray(registry().Quantity(converted, source).to(target).magnitude)
    if reference is to_reference:
        return converted
    atmosphere = atmosphere_in(to_unit)
    return converted + atmosphere if to_reference is Reference.ABSOLUTE else converted - atmosphere


def _alike(unit: str, to_unit: str) -> tuple[pint.Unit, pint.Unit]:
    source, target = _parsed(check_unit(unit)), _parsed(check_unit(to_unit))
    if not source.is_compatible_with(target):
        raise UnitError(
            f"cannot convert {unit} to {to_unit}",
            expected=f"a unit of {target.dimensionality}",
            got=f"{unit}, a unit of {source.dimensionality}",
            remedy="correct the unit of the channel",
        )
    return source, target


@cache
def is_same_unit(unit: str, other: str) -> bool:
    """Whether numbers in two units mean the same, whatever they are called.

    Args:
        unit: One.
        other: The other; a number without a unit, ``1``, stands for any.

    Returns:
        Whether they do.

    Raises:
        UnitError: If one is not known.

    Example:
        >>> is_same_unit("V", "volt"), is_same_unit("V", "mV"), is_same_unit("V", "1")
        (True, False, True)
    """
    if unit == other or "1" in {unit, other}:
        return True
    one, two = _parsed(check_unit(unit)), _parsed(check_unit(other))
    if not one.is_compatible_with(two):
        return False
    points = np.array([0.0, 1.0])
    return bool(np.allclose(registry().Quantity(points, one).to(two).magnitude, points, rtol=1e-12, atol=1e-12))


def _parsed(unit: str) -> pint.Unit:
    plain = plain_unit(unit) or unit
    return registry().parse_units("dimensionless" if plain == "1" else plain)


def squared(unit: str) -> str:
    """The unit of a square, such as of a mean squared error.

    Args:
        unit: Of what is squared.

    Returns:
        Its square as people write it; a pure number stays one.

    Example:
        >>> squared("psi"), squared("m/s"), squared("1")
        ('psi²', '(m/s)²', '1')
    """
    if unit in {"", "1"}:
        return unit
    return f"{unit}²" if _SINGLE.fullmatch(unit) else f"({unit})²"


def per(unit: str, other: str) -> str:
    """The unit of a ratio, such as of a gain.

    Args:
        unit: Of what stands above.
        other: Of what stands below.

    Returns:
        The ratio as people write it.

    Example:
        >>> per("degC", "l/min"), per("V", "V"), per("cm", "1"), per("1", "V")
        ('degC/(l/min)', 'V/V', 'cm', '1/V')
    """
    if other in {"", "1"}:
        return unit
    return f"{unit}/{other}" if _SINGLE.fullmatch(other) else f"{unit}/({other})"


_SINGLE = re.compile(r"[^\W\d]+|%|°\w*")
"""A unit whose exponent is its own: one word."""
