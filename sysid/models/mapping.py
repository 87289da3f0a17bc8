"""Mapping: which channels go in and which one comes out."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Any

from sysid.errors import ConfigError
from sysid.names import read_sides, written_side

LISTS = "a name that holds + or -> in quotes, or as lists: inputs: [...], output: ..."
"""What helps where a name is misread."""


def listed(value: object, *, what: str) -> tuple[str, ...]:
    """Names as they stand in the list form of a mapping.

    Args:
        value: A name, or a list of names.
        what: Which they are, for errors.

    Returns:
        The names.

    Raises:
        ConfigError: If it is neither.
    """
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise ConfigError(
            f"the {what} of a mapping are no names",
            expected="a name, or a list of names, as in inputs: [BP, AR]",
            got=repr(value),
            remedy="put a name that is a number or a word of YAML, such as 1 or yes, in quotes",
        )
    return tuple(names)


def check_fields(value: Dict[str, Any], known: tuple[str, ...], example: str) -> None:
    """Refuse the list form of a mapping whose fields are others.

    Args:
        value: The fields.
        known: Their names.
        example: How it is written.

    Raises:
        ConfigError: If one is missing, or there is another.
    """
    if set(value) != set(known):
        raise ConfigError(
            "not a mapping",
            expected=f"the fields {' and '.join(known)}, as in {example}",
            got=", ".join(map(str, value)) or "none",
            remedy=f"write {example}",
        )


@dataclass(frozen=True, kw_only=True)
class Mapping:
    """Which channels go in, which comes out; written ``BP+AR -> BC``.

    Args:
        inputs: Names of the input channels, all different; none for a time series or a decay (``-> BC``).
        output: Name of the output channel.

    Raises:
        ConfigError: If a name is empty, or a channel appears twice.

    Example:
        >>> Mapping.parse("BP + AR -> BC")
        Mapping(inputs=('BP', 'AR'), output='BC')
    """

    inputs: tuple[str, ...]
    output: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(self.inputs))
        names = (*self.inputs, self.output)
        if not all(names) or len(set(names)) != len(names):
            raise ConfigError(
                "not a mapping of input channels to one output channel",
                expected="different channel names on both sides, as in BP+AR -> BC",
                got=str(self),
                remedy="name each channel once; a model's own past output is an input by its structure",
            )

    def __str__(self) -> str:
        return f"{written_side(self.inputs)} -> {written_side([self.output])}".lstrip()

    @classmethod
    def of(cls, value: object) -> Mapping:
        """A mapping from what people write.

        Args:
            value: A mapping, its text, or its lists: ``{"inputs": ["P+", "V->C"], "output": "y"}``, where any name may
                stand as it is.

        Returns:
            The mapping.

        Raises:
            ConfigError: If it is none of these.

        Example:
            >>> Mapping.of({"inputs": ["P+", "V->C"], "output": "y"}) == Mapping.of('"P+" + "V->C" -> y')
            True
        """
        if isinstance(value, Mapping):
            return value
        if not isinstance(value, Dict):
            return cls.parse(str(value))
        check_fields(value, ("inputs", "output"), "{inputs: [BP, AR], output: BC}")
        output = listed(value["output"], what="outputs")
        if len(output) != 1:
            raise _several(", ".join(output))
        return cls(inputs=listed(value["inputs"], what="inputs"), output=output[0])

    @classmethod
    def parse(cls, text: str) -> Mapping:
        """Read a mapping from text.

        Args:
            text: Input names joined by ``+``, or nothing, an arrow, the output name. A name that holds ``+`` or ``->``
                stands in double quotes.

        Returns:
            The mapping.

        Raises:
            ConfigError: If the text does not have that form.
        """
        sides = read_sides(text)
        if len(sides) != 2:
            raise ConfigError(
                "not a mapping",
                expected="input channels, an arrow and one output channel, as in BP+AR -> BC",
                got=text,
                remedy="write -> between inputs and output" if len(sides) < 2 else f"write {LISTS}",
            )
        inputs, outputs = sides
        if len(outputs) > 1:
            raise _several(text)
        return cls(inputs=tuple(inputs), output="".join(outputs))


def _several(got: str) -> ConfigError:
    return ConfigError(
        "a mapping has one output",
        expected="input channels, an arrow and one output channel, as in BP+AR -> BC",
        got=got,
        remedy=f"write one pipeline, or one mapping, for each output; {LISTS}",
    )
