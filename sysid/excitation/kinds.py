"""The kinds of excitation by the name that people write."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from enum import Enum
from typing import Any, Final, get_args, get_type_hints

from sysid.errors import ConfigError, did_you_mean
from sysid.excitation.manoeuvres import Pulses, Ramps, Sine
from sysid.excitation.noise import Chirp, FilteredNoise
from sysid.excitation.plan import AbstractExcitation
from sysid.excitation.sines import Multisine
from sysid.excitation.steps import APRBS, PRBS, Staircase

KINDS: Final[Mapping[str, type[AbstractExcitation]]] = {
    "prbs": PRBS,
    "multisine": Multisine,
    "noise": FilteredNoise,
    "chirp": Chirp,
    "staircase": Staircase,
    "aprbs": APRBS,
    "ramps": Ramps,
    "sine": Sine,
    "pulses": Pulses,
}


def kind_of(name: str, options: Mapping[str, Any]) -> AbstractExcitation:
    """A kind of excitation with its options.

    Args:
        name: As in :data:`KINDS`.
        options: Its fields; those that are ``None`` are as by default.

    Returns:
        The kind.

    Raises:
        ConfigError: If there is no such kind, or it has no such option.

    Example:
        >>> kind_of("prbs", {"clock": 4})
        PRBS(clock=4, order=None)
    """
    if name not in KINDS:
        raise ConfigError.unknown("there is no such excitation", name, KINDS, "name one of these")
    kind: Any = KINDS[name]
    hints = get_type_hints(kind)
    known = {field.name: hints[field.name] for field in dataclasses.fields(kind)}
    given = {key: value for key, value in options.items() if value is not None}
    strangers = sorted(set(given) - set(known))
    if strangers:
        raise ConfigError(
            f"{name} has no option {strangers[0]}",
            expected=f"one of {', '.join(known)}",
            got=", ".join(strangers),
            remedy=did_you_mean(strangers[0], known, "leave it out, or choose another kind"),
        )
    made: AbstractExcitation = kind(**{key: _checked(key, value, known[key]) for key, value in given.items()})
    return made


def _checked(key: str, value: Any, hint: Any) -> Any:
    """A value as its field has it: names of choices become the choice, numbers are numbers."""
    choices = next((one for one in (hint, *get_args(hint)) if isinstance(one, type) and issubclass(one, Enum)), None)
    if choices is not None and not isinstance(value, choices):
        known = {str(one.value): one for one in choices}
        if value not in known:
            raise ConfigError(
                f"there is no such {key}", expected=", ".join(known), got=repr(value), remedy="name one of these"
            )
        return known[value]
    types = {one for one in (hint, *get_args(hint)) if one in {int, float}}
    if types == {int} and (isinstance(value, bool) or not isinstance(value, int)):
        raise ConfigError(f"{key} is not a whole number", expected="a whole number", got=repr(value), remedy="give one")
    if types == {float} and (isinstance(value, bool) or not isinstance(value, int | float)):
        raise ConfigError(f"{key} is not a number", expected="a number", got=repr(value), remedy="give one")
    if key == "band":
        pair = tuple(value) if isinstance(value, list | tuple) else ()
        if len(pair) != 2 or not all(isinstance(one, int | float) for one in pair):
            raise ConfigError(
                "not a band", expected="two frequencies in Hz", got=repr(value), remedy="give (low, high)"
            )
        return float(pair[0]), float(pair[1])
    return value
