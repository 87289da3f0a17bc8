"""Mapping: which channels go in and which come out."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Any

from sysid.errors import ConfigError
from sysid.names import read_sides, written_side

LISTS = "a name that holds + or -> in quotes, or as lists: inputs: [...], output: ..."
"""What helps where a name is misread."""


def _listed(value: object, *, what: str) -> tuple[str, ...]:
    """Names as they stand in the list form of a mapping: one, or a list of them."""
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise ConfigError(
            f"the {what} of a mapping are no names",
            expected="a name, or a list of names, as in inputs: [BP, AR]",
            got=repr(value),
            remedy="put a name that is a number or a word of YAML, such as 1 or yes, in quotes",
        )
    return tuple(names)


def _check_fields(value: Dict[str, Any], known: tuple[str, ...], example: str) -> None:
    """Refuse the list form of a mapping whose fields are others."""
    if set(value) != set(known):
        raise ConfigError(
            "not a mapping",
            expected=f"the fields {' and '.join(known)}, as in {example}",
            got=", ".join(map(str, value)) or "none",
            remedy=f"write {example}",
        )


@dataclass(frozen=True, init=False, repr=False)
class Mapping:
    """Which channels go in, which come out; written ``BP+AR -> BC``, or ``STP -> BP+AR`` for several outputs.

    Args:
        inputs: Names of the input channels, all different; none for a time series or a decay (``-> BC``).
        outputs: Names of the output channels, at least one.
        output: The output channel, in place of ``outputs``, where there is one.

    Raises:
        ConfigError: If there is no output, a name is empty, or a channel appears twice.

    Example:
        >>> Mapping.parse("BP + AR -> BC")
        Mapping(inputs=('BP', 'AR'), output='BC')
        >>> [str(one) for one in Mapping.parse("STP -> BP+AR").each]
        ['STP -> BP', 'STP -> AR']
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __init__(self, *, inputs: Iterable[str], outputs: Iterable[str] = (), output: str | None = None) -> None:
        object.__setattr__(self, "inputs", tuple(inputs))
        object.__setattr__(self, "outputs", tuple(outputs) if output is None else (output,))
        names = (*self.inputs, *self.outputs)
        if not self.outputs or not all(names) or len(set(names)) != len(names):
            raise ConfigError(
                "not a mapping of input channels to output channels",
                expected="different channel names on both sides, as in BP+AR -> BC",
                got=str(self),
                remedy="name each channel once; a model's own past outputs are inputs by its structure",
            )

    def __repr__(self) -> str:
        out = f"output={self.outputs[0]!r}" if len(self.outputs) == 1 else f"outputs={self.outputs}"
        return f"Mapping(inputs={self.inputs}, {out})"

    def __str__(self) -> str:
        return f"{written_side(self.inputs)} -> {written_side(self.outputs)}".lstrip()

    @property
    def output(self) -> str:
        """The output, of a mapping that has one.

        Raises:
            ConfigError: If there are several.
        """
        self.check_single()
        return self.outputs[0]

    @property
    def channels(self) -> tuple[str, ...]:
        """Inputs and outputs, each once."""
        return tuple(dict.fromkeys((*self.inputs, *self.outputs)))

    @property
    def each(self) -> tuple[Mapping, ...]:
        """One mapping an output, all of the same inputs."""
        return tuple(Mapping(inputs=self.inputs, output=output) for output in self.outputs)

    def check_single(self, what: str = "") -> None:
        """Refuse several outputs.

        Args:
            what: What takes one output only, for the error.

        Raises:
            ConfigError: If there are several.
        """
        if len(self.outputs) != 1:
            raise ConfigError(
                f"{what or 'a mapping here'} has one output",
                expected="input channels, an arrow and one output channel",
                got=str(self),
                remedy=f"write one mapping for each output, {' and '.join(repr(str(one)) for one in self.each[:2])}"
                + (" and so on" if len(self.outputs) > 2 else ""),
            )

    @classmethod
    def of(cls, value: object) -> Mapping:
        """A mapping from what people write.

        Args:
            value: A mapping, its text, or its lists: ``{"inputs": ["P+", "V->C"], "output": "y"}``, or ``outputs``,
                where any name may stand as it is.

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
        word = "outputs" if "outputs" in value else "output"
        _check_fields(value, ("inputs", word), "{inputs: [BP, AR], output: BC}")
        return cls(inputs=_listed(value["inputs"], what="inputs"), outputs=_listed(value[word], what="outputs"))

    @classmethod
    def parse(cls, text: str) -> Mapping:
        """Read a mapping from text.

        Args:
            text: Input names joined by ``+``, or nothing, an arrow, output names joined by ``+``. A name that holds
                ``+`` or ``->`` stands in double quotes.

        Returns:
            The mapping.

        Raises:
            ConfigError: If the text does not have that form.
        """
        sides = read_sides(text)
        if len(sides) != 2:
            raise ConfigError(
                "not a mapping",
                expected="input channels, an arrow and output channels, as in BP+AR -> BC",
                got=text,
                remedy="write -> between inputs and outputs" if len(sides) < 2 else f"write {LISTS}",
            )
        inputs, outputs = sides
        return cls(inputs=inputs, outputs=outputs)
