"""How far an input of an FMU may move where its description has no min and max: a guess, which is told as one."""

from __future__ import annotations

from typing import Any

from sysid.references.fmu_variables import INTEGERS, declared_unit

GUESS = "is a guess"
"""What tells a guess in what is said of a range."""
ABOUT = {"K": 10.0, "degC": 10.0, "degF": 20.0}
"""Of a temperature, whose zero says nothing: how far it moves about its start."""


def guessed(
    variable: Any, low: float | None, high: float | None, start: float | None
) -> tuple[float, float, str] | None:
    """A range, by what the description has: named values, a nominal value, the unit, the start.

    Args:
        variable: As fmpy has it.
        low: Its least value; ``None`` where nothing is said.
        high: Likewise its greatest.
        start: Where it begins.

    Returns:
        The range, and a sentence that ends in where it is from; ``None`` where its limits leave no range.

    Example:
        >>> from types import SimpleNamespace
        >>> force = SimpleNamespace(name="force", type="Real", unit="N", nominal="50", declaredType=None)
        >>> guessed(force, 0.0, None, 20.0)
        (0.0, 70.0, 'is a guess, by its nominal value of 50 about its start')
    """
    items = named_values(variable)
    if len(items) > 1:
        return min(items), max(items), "as it has so many named values"
    by, why = _how_far(variable, start)
    whole, at = str(variable.type) in INTEGERS, start or 0.0
    # Of a whole number, which may be a gear or a mode, the next is likelier to be one than that before nought.
    least, most = (at if whole and not at else at - by), at + by
    least = max(least, 0.0) if str(variable.type).startswith("UInt") else least
    least, most = (least if low is None else max(least, low)), (most if high is None else min(most, high))
    return (least, most, f"{GUESS}, {why}") if least < most else None


def named_values(variable: Any) -> list[float]:
    """The values of an enumeration.

    Args:
        variable: As fmpy has it.

    Returns:
        They, rising; none of what is no enumeration, or has none.
    """
    items = getattr(variable.declaredType, "items", None) or ()
    found = sorted(float(one.value) for one in items if one.value is not None)
    return found if str(variable.type) == "Enumeration" else []


def range_told(name: str, low: float, high: float) -> str:
    """A range as it is said.

    Args:
        name: Of the input.
        low: Its least value.
        high: Its greatest.

    Returns:
        Both, in words.
    """
    return f"{name}: {low:g} to {high:g}"


def _how_far(variable: Any, start: float | None) -> tuple[float, str]:
    nominal, unit = _nominal(variable), declared_unit(variable)
    if nominal:
        return abs(nominal), f"by its nominal value of {nominal:g} about its start"
    if unit in ABOUT:
        return ABOUT[unit], f"{ABOUT[unit]:g} {unit} about its start"
    if start:
        return abs(start), f"by its start of {start:g}"
    return 1.0, "as the model description says nothing of how far it goes"


def _nominal(variable: Any) -> float | None:
    """Its own or of its type."""
    for one in (variable, variable.declaredType):
        try:
            value = float(getattr(one, "nominal", None))  # type: ignore[arg-type]
        except (TypeError, ValueError):
            continue
        return value if 0.0 < abs(value) < float("inf") else None
    return None
