"""Levels at rest that are another output's: the same quantity twice, as the members of a committee have it.

Whoever says where an output begins says it of all that follow it.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from collections.abc import Mapping as Dict
from typing import Any

from sysid.errors import ChannelError, ConfigError, shortened


def levels_at_rest(given: Any, outputs: Collection[str]) -> Dict[str, float] | None:
    """Levels of some outputs at rest, by name.

    Args:
        given: One number, of all of them; numbers by name; or ``None``.
        outputs: The outputs that there are.

    Returns:
        Numbers by name; ``None`` where nothing was given.

    Raises:
        ChannelError: If a name is none of an output.
        ConfigError: If a level is no finite number.

    Example:
        >>> levels_at_rest(2, ["y"]), levels_at_rest({"y": 1.5}, ["y", "z"])
        ({'y': 2.0}, {'y': 1.5})
    """
    if given is None:
        return None
    levels = dict(given) if isinstance(given, Dict) else dict.fromkeys(outputs, given)
    strangers = [name for name in levels if name not in outputs]
    if strangers:
        raise ChannelError(strangers, tuple(outputs), where="rest_output")
    for name, level in levels.items():
        number = hasattr(level, "__float__") and not isinstance(level, bool) and not getattr(level, "ndim", 0)
        if not number or not math.isfinite(level):
            raise ConfigError(
                "an output's level at rest is one finite number",
                where=f"rest_output, {name}",
                expected="a number, in the output's unit",
                got=shortened(level),
                remedy="write for example rest_output=1.5, or rest_output={'y1': 1.5, 'y2': 0.0} for several outputs",
            )
    return {name: float(level) for name, level in levels.items()}


def leaders(name: str, rest: Dict[str, float | str], outputs: Collection[str]) -> list[str]:
    """The outputs whose level a channel has, the nearest first.

    Args:
        name: The channel.
        rest: Levels by channel: a value, or the name of the channel whose level it is.
        outputs: The outputs.

    Returns:
        Their names; none of a channel with a level of its own, or an input's.

    Raises:
        ConfigError: If channels follow each other in a circle.

    Example:
        >>> leaders("y_2", {"y_2": "y", "y": "u"}, ["y", "y_2"]), leaders("y", {"y": "u"}, ["y"])
        (['y'], [])
    """
    walk = [name]
    while isinstance(level := rest.get(walk[-1]), str) and level in outputs:
        walk.append(level)
        if level in walk[:-1]:
            raise ConfigError(
                "levels at rest follow each other in a circle",
                where=f"rest of {name}",
                expected="a value, an input, or an output with a level of its own",
                got=" -> ".join(walk),
                remedy="give one of them a value",
            )
    return walk[1:]


def resting(name: str, rest: Dict[str, float | str], own: Dict[str, float], outputs: Collection[str]) -> float | str:
    """An output's level, through all whose level it has.

    Args:
        name: The output.
        rest: As in :func:`leaders`.
        own: Levels of outputs of which nothing is declared.
        outputs: The outputs.

    Returns:
        A value, or the input whose first sample it is.
    """
    last = [name, *leaders(name, rest, outputs)][-1]
    return rest.get(last, own.get(last, 0.0))
