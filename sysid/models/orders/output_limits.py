"""Limits between which a network holds its output: how they are written."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from sysid.errors import ConfigError, shortened

FOUND = "found"
"""Limits are found in the records: where the output stands at its least or greatest value while an input moves on."""

Between = tuple[float | None, float | None]
"""Least and greatest value in the output's unit; ``None`` where nothing holds it."""


def parse_limits(value: object) -> str | Between | None:
    """Limits as people write them.

    Args:
        value: ``None``, ``"found"``, ``[low, high]`` with ``None`` for a side that is open, or ``{low:, high:}``.

    Returns:
        ``None``, ``"found"``, or both sides.

    Raises:
        ConfigError: If it is none of these.

    Example:
        >>> parse_limits([0, None]), parse_limits({"high": 2}), parse_limits("found")
        ((0.0, None), (None, 2.0), 'found')
    """
    if value is None or value == FOUND:
        return value
    sides: Any = value
    if isinstance(value, Mapping) and value and set(value) <= {"low", "high"}:
        sides = (value.get("low"), value.get("high"))
    if isinstance(sides, list | tuple) and len(sides) == 2 and all(one is None or _is_number(one) for one in sides):
        low, high = (None if one is None else float(one) for one in sides)
        if (low is not None or high is not None) and (low is None or high is None or low < high):
            return low, high
    raise ConfigError(
        "not limits of an output",
        where="limits",
        expected="found, or [low, high] in the output's unit with low < high; null for a side that is open",
        got=shortened(value),
        remedy="write limits: found, or for example limits: [0, 300]",
    )


Named = tuple[tuple[str, Between], ...]
"""Limits of some of several outputs, by name."""


def parse_several(value: object) -> str | Named | None:
    """Limits of several outputs as people write them.

    Args:
        value: ``None``, ``"found"``, or the limits of some outputs by name, each as for one output; or what this gives.

    Returns:
        ``None``, ``"found"``, or names with both sides.

    Raises:
        ConfigError: If it is none of these.

    Example:
        >>> parse_several({"place": [0, 80], "speed": {"low": -1}})
        (('place', (0.0, 80.0)), ('speed', (-1.0, None)))
    """
    if value is None or value == FOUND:
        return value
    named: Any = value
    if isinstance(value, tuple) and all(isinstance(one, tuple) and len(one) == 2 for one in value):
        named = dict(value)
    if isinstance(named, Mapping) and named and all(isinstance(name, str) for name in named):
        sides = {name: parse_limits(one) for name, one in named.items()}
        if all(isinstance(one, tuple) for one in sides.values()):
            return tuple((name, one) for name, one in sides.items() if isinstance(one, tuple))
    raise ConfigError(
        "not limits of several outputs",
        where="limits",
        expected="found, or limits by the output's name: {position: [0, 300]}",
        got=shortened(value),
        remedy="write limits: found, or for example limits: {position: [0, 300]}",
    )


def written(limits: str | Between) -> str:
    """Limits in a label.

    Example:
        >>> written((0.0, None)), written("found")
        ('from 0', 'found')
    """
    if isinstance(limits, str):
        return limits
    return " ".join(
        f"{side} {value:g}" for side, value in zip(("from", "to"), limits, strict=True) if value is not None
    )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
