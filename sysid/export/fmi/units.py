"""Units in the words of FMI: a name, and how it is made of SI base units."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

BASE = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}
"""The base units of FMI by their names in pint."""


def unit_definitions(units: Iterable[str]) -> list[dict[str, Any]]:
    """The definitions of units, each once.

    Args:
        units: Names of units; ``"1"`` is no unit.

    Returns:
        Per unit its ``name`` and ``base``: exponents, factor and offset as attributes, or ``None`` where it has
        none in FMI's base units.

    Example:
        >>> unit_definitions(["degC", "1"])
        [{'name': 'degC', 'base': {'K': '1', 'factor': '1.0', 'offset': '273.15'}}]
    """
    return [{"name": unit, "base": _base(unit)} for unit in dict.fromkeys(units) if unit != "1"]


@cache
def _registry() -> Any:
    """Read once: that takes a sixth of a second."""
    import pint

    return pint.UnitRegistry(cache_folder=None, autoconvert_offset_to_baseunit=True)


def _base(unit: str) -> dict[str, str] | None:
    import pint

    registry = _registry()
    try:
        zero, one = (registry.Quantity(value, unit).to_base_units() for value in (0.0, 1.0))
    except (pint.errors.PintError, AttributeError):
        return None
    powers = {BASE.get(str(name)): power for name, power in one.unit_items()}
    if None in powers or any(power != int(power) for power in powers.values()):
        return None
    found = {symbol: str(int(powers[symbol])) for symbol in BASE.values() if symbol in powers}
    factor, offset = float(one.magnitude) - float(zero.magnitude), float(zero.magnitude)
    # Below 15 digits the difference of two numbers near 273 has nothing but noise.
    found["factor"] = repr(float(f"{factor:.15g}") if offset == 0.0 else round(factor, 12))
    if offset:
        found["offset"] = repr(offset)
    return found
