"""What is known of a parameter of equations, and of a state before a record, as people write it."""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from dataclasses import dataclass, fields
from typing import Any

from sysid.errors import ConfigError, shortened

MOST_PARAMETERS = 500
CASE = "case"
"""What a parameter may have a value per."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of the equations, in its own unit.

    Args:
        name: Its name in the equations.
        start: Where its estimation starts; its value, where it is fixed.
        low: Least value.
        high: Greatest value.
        prior: Standard deviation of what is known of it before the data, around the start; ``None`` where nothing is.
        fixed: Whether it is known, and not estimated.
        unit: Its unit; a fit says where the equations' units contradict each other.
        per: ``case`` where each case has a value of its own; ``None`` where all share one.

    Raises:
        ConfigError: If the numbers do not go together.
    """

    name: str
    start: float
    low: float = -math.inf
    high: float = math.inf
    prior: float | None = None
    fixed: bool = False
    unit: str = ""
    per: str | None = None

    def __post_init__(self) -> None:
        where = f"parameters, {self.name}"
        if self.per not in {None, CASE}:
            raise ConfigError(
                "no such thing to have a value per", where=where, expected=CASE, got=shortened(self.per),
                remedy=f"write per: {CASE} where each record has its own value, and cases: for records that share one",
            )  # fmt: skip
        if self.per and self.fixed:
            raise ConfigError(
                f"{self.name} is known, and each case is to have its own", where=where,
                expected=f"fixed: true, or per: {CASE}", got="both",
                remedy=f"what is known of each record is an input: give the data a channel {self.name}",
            )  # fmt: skip
        for name in ("start", "low", "high", "prior"):
            _number(self, name, where, least_finite=name in {"start", "prior"})
        if not self.low <= self.start <= self.high or not self.low < self.high:
            raise ConfigError(
                f"{self.name} starts outside its bounds",
                where=where,
                expected=f"low < high, and a start from {self.low:g} to {self.high:g}",
                got=f"{self.start:g}",
                remedy="correct the start or the bounds",
            )
        if self.prior is not None and not self.prior > 0.0:
            raise ConfigError(
                "a prior is a standard deviation", where=where, expected="above 0", got=self.prior,
                remedy=f"write fixed: true where {self.name} is known",
            )  # fmt: skip

    @property
    def scale(self) -> float:
        """What is a large change of it."""
        if self.prior is not None:
            return self.prior
        if self.start != 0.0:
            return abs(self.start)
        finite = [abs(bound) for bound in (self.low, self.high) if math.isfinite(bound) and bound != 0.0]
        return min(finite, default=1.0)

    def to_dict(self) -> float | dict[str, Any]:
        """As it is written: a number where only the start is given."""
        return _written(self)


@dataclass(frozen=True, kw_only=True)
class InitialState:
    """What is known of a state before the first sample.

    Args:
        name: The state.
        start: Its value there; where the record's own is estimated, where that starts.
        low: Least value.
        high: Greatest value.
        fixed: Whether every record begins at that value, and none is estimated.
        unit: Its unit, as that of a parameter.

    Raises:
        ConfigError: If the numbers do not go together.
    """

    name: str
    start: float
    low: float = -math.inf
    high: float = math.inf
    fixed: bool = False
    unit: str = ""

    def __post_init__(self) -> None:
        where = f"initial, {self.name}"
        for name in ("start", "low", "high"):
            _number(self, name, where, least_finite=name == "start")
        if not self.low <= self.start <= self.high or not self.low < self.high:
            raise ConfigError(
                f"{self.name} begins outside its bounds",
                where=where,
                expected=f"low < high, and a start from {self.low:g} to {self.high:g}",
                got=f"{self.start:g}",
                remedy="correct the start or the bounds",
            )

    def to_dict(self) -> float | dict[str, Any]:
        """As it is written: a number where only the start is given."""
        return _written(self)


def parameters_from(given: Any) -> tuple[Parameter, ...]:
    """Parameters from what people write.

    Args:
        given: By name a start, or the fields of :class:`Parameter`.

    Returns:
        Them.

    Raises:
        ConfigError: If they cannot be.
    """
    return entries(given, Parameter, "parameters")


def entries(given: Any, kind: Any, where: str) -> tuple[Any, ...]:
    """Parameters, or initial states, from what people write.

    Args:
        given: By name a start, or the fields of their kind; or the entries themselves.
        kind: :class:`Parameter` or :class:`InitialState`.
        where: The field that they stand in.

    Returns:
        The entries.

    Raises:
        ConfigError: If they cannot be.
    """
    if isinstance(given, tuple) and all(isinstance(one, kind) for one in given):
        return given
    if not isinstance(given, Dict) or len(given) > MOST_PARAMETERS:
        raise ConfigError(
            f"{where} are no entries by name", where=where, expected=f"up to {MOST_PARAMETERS}, as in {{k: 0.5}}",
            got=shortened(given), remedy=f"write {where}: {{NAME: {{start: 0.5, low: 0}}}}",
        )  # fmt: skip
    known = [one.name for one in fields(kind) if one.name != "name"]
    found = []
    for name, entry in given.items():
        if not isinstance(name, str) or not name.strip():
            raise ConfigError(
                "not a name", where=where, expected="text", got=shortened(name), remedy="put it in quotes"
            )
        written = entry if isinstance(entry, Dict) else {"start": entry}
        for key in written:
            if key not in known:
                raise ConfigError.unknown(f"unknown field {key!r}", key, known, "remove it", where=f"{where}, {name}")
        if "start" not in written:
            raise ConfigError(
                f"{name} has no start", where=f"{where}, {name}", expected="a start, as in {start: 0.5}",
                got=", ".join(map(str, written)) or "nothing", remedy="add start: and a value of the right size",
            )  # fmt: skip
        found.append(kind(name=name, **written))
    return tuple(found)


def real(value: object) -> float:
    """A number as one; not a number what is none, a truth value among them.

    Args:
        value: Anything.

    Returns:
        It.
    """
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan


def _number(entry: Any, name: str, where: str, *, least_finite: bool) -> None:
    """Bring a field into its form, or refuse what is no number."""
    given = getattr(entry, name)
    if given is None and name == "prior":
        return
    value = real(given)
    if math.isnan(value) or (least_finite and not math.isfinite(value)):
        raise ConfigError(
            f"{name} is no number", where=where, expected="a number", got=shortened(given),
            remedy="write for example {start: 0.5, low: 0, high: 2}",
        )  # fmt: skip
    object.__setattr__(entry, name, value)


def _written(entry: Any) -> float | dict[str, Any]:
    given = {
        one.name: getattr(entry, one.name)
        for one in fields(entry)
        if one.name != "name" and (one.name == "start" or getattr(entry, one.name) != one.default)
    }
    return float(given["start"]) if len(given) == 1 else given
