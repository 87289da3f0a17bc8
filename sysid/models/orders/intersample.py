"""What inputs do between samples, as MATLAB's ``InterSample``: held, or straight to the next."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from typing import Any

from sysid.errors import ConfigError, did_you_mean, shortened

HELD, MOVING = "zoh", "foh"
INTERSAMPLE = (HELD, MOVING)
"""Zero-order hold, as of a converter that drives the plant; first-order hold, as of a plant that is only measured."""

InterSample = str | tuple[tuple[str, str], ...]
"""One for all inputs, or by input; those that are not named are held."""


def intersample_of(given: Any) -> InterSample:
    """Bring what people write into its form.

    Args:
        given: ``zoh`` or ``foh``, or one of them by input.

    Returns:
        It.

    Raises:
        ConfigError: If it is neither.
    """
    pairs = given.items() if isinstance(given, Dict) else given if isinstance(given, tuple | list) else None
    if pairs is None:
        return _one(given)
    if not all(isinstance(pair, tuple | list) and len(pair) == 2 and isinstance(pair[0], str) for pair in pairs):
        raise _unknown(given)
    return tuple((str(name), _one(one)) for name, one in pairs)


def marked(given: InterSample) -> str:
    """What labels say of it: nothing of inputs that are held."""
    return f" {MOVING}" if given == MOVING or (not isinstance(given, str) and MOVING in dict(given).values()) else ""


def moving(given: InterSample, inputs: Sequence[str]) -> tuple[bool, ...]:
    """By input, whether it goes straight to its next sample.

    Args:
        given: From :func:`intersample_of`.
        inputs: Names of the inputs.

    Returns:
        An entry for each.

    Raises:
        ConfigError: If one is named that is no input.
    """
    if isinstance(given, str):
        return (given == MOVING,) * len(inputs)
    for name, _ in given:
        if name not in inputs:
            raise ConfigError(
                f"{name} is no input", where="intersample", expected=f"inputs: {', '.join(inputs) or 'there are none'}",
                got=name, remedy=did_you_mean(name, inputs, "remove it"),
            )  # fmt: skip
    return tuple(dict(given).get(name) == MOVING for name in inputs)


def told(flags: Sequence[bool], inputs: Sequence[str]) -> str:
    """What is told of the inputs between samples.

    Args:
        flags: From :func:`moving`.
        inputs: Names of the inputs.

    Returns:
        A sentence behind a blank; empty where all are held.
    """
    names = [name for name, moves in zip(inputs, flags, strict=True) if moves]
    if not names:
        return ""
    one = len(names) == 1
    return f" Between samples {', '.join(names)} {'goes' if one else 'go'} straight to the next value ({MOVING})."


def to_fields(given: InterSample) -> dict[str, Any]:
    """What is written of it: nothing where inputs are held, as they are by default.

    Args:
        given: From :func:`intersample_of`.

    Returns:
        The field, or none.
    """
    if given == HELD:
        return {}
    return {"intersample": given if isinstance(given, str) else dict(given)}


def _one(given: Any) -> str:
    if not isinstance(given, str) or given not in INTERSAMPLE:
        raise _unknown(given)
    return given


def _unknown(given: Any) -> ConfigError:
    return ConfigError(
        "inputs do no such thing between samples", where="intersample",
        expected="zoh (held) or foh (straight to the next sample), for all inputs or by input as in {force: foh}",
        got=shortened(given),
        remedy=did_you_mean(given, INTERSAMPLE, "write foh, or give the data more samples, where inputs are smoother")
        if isinstance(given, str)
        else "write intersample: foh",
    )  # fmt: skip
