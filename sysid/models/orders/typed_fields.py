"""Fields that are what they say: a switch is true or false, a count a whole number, a limit a number.

Python holds nobody to the types of a dataclass. ``intercept="no"`` would be true, a limit that is not a number would
never be reached, and one that is text would be a trace from within a fit.
"""

from __future__ import annotations

from abc import ABCMeta
from inspect import Signature, signature
from typing import Any

import numpy as np

from sysid.errors import ConfigError, shortened

LEAST = {"seed": 0, "max_time_s": 0.0, "tolerance": 0.0}
"""Options that no class allows below a number."""
MOST = {"starts": 10_000}
"""Options of which a slip of the pen would take all memory."""


def plain_values(value: Any) -> Any:
    """Numbers and arrays of NumPy as plain ones, at whatever depth of lists, tuples and dicts.

    Args:
        value: Anything.

    Returns:
        The same, or plain values in its place.

    Example:
        >>> plain_values({"k": (np.int8(2), np.array([[0, 1]], dtype=np.uint8))})
        {'k': (2, [[0, 1]])}
    """
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if type(value) in {list, tuple}:
        return type(value)(plain_values(one) for one in value)
    return {key: plain_values(one) for key, one in value.items()} if type(value) is dict else value


class _Looked(ABCMeta):
    """Looks at what is given before anything is made of it; numbers and arrays of NumPy are plain ones then."""

    def __call__(cls, *args: Any, **given: Any) -> Any:
        plain = {name: plain_values(value) for name, value in given.items()}
        fields = getattr(cls, "__dataclass_fields__", {})
        for name, value in plain.items():
            if name in fields and fields[name].type in cls.held:  # type: ignore[attr-defined]  # of both classes below
                _check(name, fields[name].type, value)
        return super().__call__(*args, **plain)

    @property
    def __signature__(cls) -> Signature:
        """That of the fields, for help and for who asks what there is: it would be that of the call above."""
        own = signature(cls.__init__)  # type: ignore[misc]  # of this class and no other
        return own.replace(parameters=tuple(own.parameters.values())[1:])


class Switches(metaclass=_Looked):
    """Whose fields of type ``bool`` are held to it, from whatever door they come."""

    held: tuple[str, ...] = ("bool", "bool | None")
    """Types of the fields that are looked at, as they are written."""


class TypedFields(Switches):
    """Whose fields that are numbers are held to their types too."""

    held = (*Switches.held, "int", "int | None", "float", "float | None")


def _check(name: str, kind: str, value: Any) -> None:
    plain, optional = kind.removesuffix(" | None"), kind.endswith(" | None")
    if value is None and optional:
        return
    number = isinstance(value, int | float) and not isinstance(value, bool) and value == value  # noqa: PLR0124 - nan
    fits = {"bool": isinstance(value, bool), "int": number and isinstance(value, int), "float": number}[plain]
    if fits and (plain == "bool" or LEAST.get(name, -np.inf) <= value <= MOST.get(name, np.inf)):
        return
    expected = {"bool": "true or false", "int": "a whole number", "float": "a number"}[plain]
    least = f", {LEAST[name]:g} or more" if name in LEAST else f", {MOST[name]:,} at most" if name in MOST else ""
    raise ConfigError(
        f"{name} cannot be used as it is",
        where=name,
        expected=expected + least + (", or nothing" if optional else ""),
        got=shortened(value),
        remedy="correct the value",
    )
