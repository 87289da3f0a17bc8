"""Mapping: which channels go in and which one comes out."""

from __future__ import annotations

from dataclasses import dataclass

from sysid.errors import ConfigError


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
        return f"{'+'.join(self.inputs)} -> {self.output}".lstrip()

    @classmethod
    def parse(cls, text: str) -> Mapping:
        """Read a mapping from text.

        Args:
            text: Input names joined by ``+``, or nothing, an arrow, the output name.

        Returns:
            The mapping.

        Raises:
            ConfigError: If the text does not have that form.
        """
        left, arrow, right = text.partition("->")
        if not arrow:
            raise ConfigError(
                "not a mapping",
                expected="input channels, an arrow and one output channel, as in BP+AR -> BC",
                got=text,
                remedy="write -> between inputs and output",
            )
        if "+" in right:
            raise ConfigError(
                "a mapping has one output",
                expected="input channels, an arrow and one output channel, as in BP+AR -> BC",
                got=text,
                remedy="write one pipeline, or one mapping, for each output",
            )
        inputs = tuple(name.strip() for name in left.split("+")) if left.strip() else ()
        return cls(inputs=inputs, output=right.strip())
