"""Ranges: which values a sweep tries for a field, written on the field itself or in a pipeline's YAML.

A structure's field says what is usual for it, ``neurons: Annotated[int, IntRange(low=1, high=20)]``; a pipeline
that writes ``neurons: range`` takes that, and one that writes ``{from: 2, to: 30}`` or ``{among: [4, 8, 16]}`` its own.
Every range is a finite list of values, so that a grid can be counted before it is begun.
"""

from __future__ import annotations

import math
import typing
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid.errors import ConfigError

WORD = "range"
"""What a pipeline writes for the range that the structure declares."""


class AbstractRange(ABC):
    """A finite list of values."""

    @property
    @abstractmethod
    def values(self) -> tuple[Any, ...]:
        """The values, in the order of a grid."""

    @property
    def numeric(self) -> bool:
        """Whether neighbours in the list are neighbours in meaning, which a sampler can use."""
        return True


@dataclass(frozen=True, kw_only=True)
class IntRange(AbstractRange):
    """Whole numbers, both ends included.

    Args:
        low: The first.
        high: The last, or the end that no step passes.
        step: From one to the next.

    Raises:
        ConfigError: If nothing lies in it.

    Example:
        >>> IntRange(low=1, high=10, step=3).values
        (1, 4, 7, 10)
    """

    low: int
    high: int
    step: int = 1

    def __post_init__(self) -> None:
        if self.step < 1 or self.high < self.low:
            raise _empty(f"from {self.low} to {self.high} in steps of {self.step}")

    @property
    def values(self) -> tuple[int, ...]:
        """The numbers, rising."""
        return tuple(range(self.low, self.high + 1, self.step))


@dataclass(frozen=True, kw_only=True)
class FloatRange(AbstractRange):
    """Real numbers, evenly spaced or in equal ratios, both ends included.

    Args:
        low: The first.
        high: The last.
        points: How many.
        log: In equal ratios.

    Raises:
        ConfigError: If the ends are not in order, or not positive where ratios are asked for.

    Example:
        >>> FloatRange(low=0.01, high=1.0, points=3, log=True).values
        (0.01, 0.1, 1.0)
    """

    low: float
    high: float
    points: int
    log: bool = False

    def __post_init__(self) -> None:
        ends = math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high
        if not ends or self.points < 2 or (self.log and self.low <= 0.0):
            raise _empty(f"{self.points} points from {self.low} to {self.high}{' in equal ratios' if self.log else ''}")

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers, rising."""
        if self.log:
            inner = np.geomspace(self.low, self.high, self.points)
        else:
            inner = np.linspace(self.low, self.high, self.points)
        # Twelve digits: 0.1 and not 0.10000000000000002, so that a point is named as it was meant.
        return tuple(float(f"{value:.12g}") for value in inner)


@dataclass(frozen=True, kw_only=True)
class Among(AbstractRange):
    """Values of any kind, one by one: lag sets, words.

    Args:
        choices: The values, each once.

    Raises:
        ConfigError: If there is none, or one stands twice.
    """

    choices: tuple[Any, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "choices", tuple(self.choices))
        texts = [repr(choice) for choice in self.choices]
        if not texts or len(set(texts)) < len(texts):
            raise _empty(f"among {list(self.choices)}")

    @property
    def values(self) -> tuple[Any, ...]:
        """The choices, as listed."""
        return self.choices

    @property
    def numeric(self) -> bool:
        """False: a list says nothing of what lies between."""
        return False


def declared_ranges(structure: type) -> dict[str, AbstractRange]:
    """The ranges that a structure's fields declare.

    Args:
        structure: A structure's class.

    Returns:
        By field; fields without a range are left out.

    Example:
        >>> from sysid.models import NARX
        >>> declared_ranges(NARX)["neurons"].values[:3]
        (1, 2, 3)
    """
    found: dict[str, AbstractRange] = {}
    for name, hint in typing.get_type_hints(structure, include_extras=True).items():
        for extra in getattr(hint, "__metadata__", ()):
            if isinstance(extra, AbstractRange):
                found[name] = extra
    return found


def parse_range(written: object, declared: AbstractRange | None, *, where: str) -> AbstractRange | None:
    """The range that a pipeline writes for a field, if it writes one.

    Args:
        written: The field's value in the YAML: a range in words, or a plain value.
        declared: What the field declares.
        where: The field, for errors.

    Returns:
        The range; ``None`` for a plain value.

    Raises:
        ConfigError: If it is meant as a range and is none.

    Example:
        >>> parse_range({"from": 1, "to": 5}, None, where="neurons").values
        (1, 2, 3, 4, 5)
        >>> parse_range(4, None, where="neurons") is None
        True
    """
    if written == WORD:
        if declared is None:
            raise ConfigError(
                f"{where} declares no range",
                where=where,
                expected="{from: 1, to: 5} or {among: [...]}",
                got=WORD,
                remedy="write the ends of the range",
            )
        return declared
    if not isinstance(written, dict) or not {"from", "to", "among"} & set(written):
        return None
    try:
        if "among" in written:
            if set(written) != {"among"}:
                raise TypeError("among stands alone")
            return Among(choices=tuple(written["among"]))
        ends = {"low": written["from"], "high": written["to"]}
        rest = {str(key): value for key, value in written.items() if key not in {"from", "to"}}
        if "points" in rest or any(isinstance(end, float) for end in ends.values()):
            return FloatRange(**ends, **rest)
        return IntRange(**ends, **rest)
    except (TypeError, KeyError) as error:
        raise ConfigError(
            f"{where} is not a range",
            where=where,
            expected="{from: 1, to: 5, step: 2}; {from: 1e-4, to: 1, points: 5, log: true}; {among: [...]}",
            got=repr(written),
            remedy=f"correct it ({error})",
        ) from error


def _empty(got: str) -> ConfigError:
    return ConfigError(
        "the range has nothing in it, or one value twice",
        expected="ends in order, a step from 1 on, at least two points, every choice once",
        got=got,
        remedy="correct the ends of the range",
    )
