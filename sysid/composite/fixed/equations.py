"""Fixed submodels as equations: ``RL = relay(BP - AR, on=1.45, off=-0.985, slope=20)``.

An equation here is an expression of channels, now and some samples ago, held between two bounds. A weighted sum is
found as one, and runs as one (:mod:`sysid.composite.fixed_members`); anything else is taken as it is written
(:mod:`sysid.composite.fixed.expressions`). Sums are done in fractions of the decimals that are written: 0.1 + 0.2 is
0.3, and an equation is the same submodel to the last bit as the weights that it stands for.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from sysid.composite.fixed.expressions import expression_of, reads_nothing, words_of
from sysid.composite.fixed.member import FixedMember, parameters_of
from sysid.equations.parser import DEEPEST, parse
from sysid.equations.syntax import (
    CONTINUOUS,
    DISCRETE,
    Call,
    Delayed,
    Equation,
    Name,
    Node,
    Number,
    Operation,
    equation_error,
    nodes_of,
)
from sysid.equations.system import System, written_name
from sysid.equations.units_checked import unit_contradictions
from sysid.errors import ConfigError
from sysid.models import Mapping
from sysid.models.grey_box.declared import Parameter
from sysid.traces import Trace

_SWITCH = (0.0, 1.0)
"""Bounds of a switch: off, on and how far between."""


def fixed_by_equations(
    text: str,
    *,
    rest: float | Dict[str, float] = 0.0,
    unit: str | Dict[str, str] = "1",
    instances: tuple[str, ...] = ("",),
    shared: tuple[str, ...] = (),
    tables: Dict[str, Any] | None = None,
    parameters: Dict[str, Any] | tuple[Parameter, ...] = (),
) -> tuple[FixedMember, ...]:
    """Fixed submodels, one for each equation; beside one that reads its own past, what that was.

    Args:
        text: Equations, one a line: ``y = clamp(2*u - x[k-1], -5, 5)``, ``y[k+1] = ...``; ``y = switch(u - 3)``, a pure
            number that is held between 0 and 1; ``y = relay(u, on=2, off=1, slope=20)``, a switch with hysteresis:
            beyond ``on`` it goes to 1, the quicker the larger ``slope``, and stays until ``u`` is back at ``off``,
            without a slope at once; or any expression of the language, ``y = where(u > 3, max(u, x), y[k-1])``.
        rest: Values at rest, in the units of the outputs: one for all, or by output; 0 for those without.
        unit: Units of the outputs: one for all but switches, or by output; a pure number for those without.
        instances: Suffixes of the channel names, one for each instance.
        shared: Inputs that have the same name in every instance.
        tables: By name the points ``[[x, y], ...]`` of functions that equations call.
        parameters: By name the start of what is estimated, or ``{start:, low:, high:, prior:, fixed:, unit:}``, as of
            :class:`sysid.models.GreyBox`. One is the same wherever it is named, in limits too.

    Returns:
        The submodels, in the order of the equations.

    Raises:
        ConfigError: If the text is none, an equation cannot be fixed, or what has a rest or a unit has no equation.

    Example:
        >>> (relay,) = fixed_by_equations("R = relay(p - q, on=1.5, off=-0.5, slope=10)", rest={"R": 1})
        >>> str(relay.mapping), relay.memory, relay.constant, relay.low, relay.high
        ('p+q -> R', 21.0, -15.0, 0.0, 1.0)
    """
    equations, named = parse(text), parameters_of(parameters)
    names = [one.name for one in equations]
    for what, given in (("rest", rest), ("unit", unit)):
        _check_known(what, list(given) if isinstance(given, Dict) else [], names)
    members = [
        FixedMember(
            **words,
            rest=rest.get(one.name, 0.0) if isinstance(rest, Dict) else rest,
            unit=unit.get(one.name, "1") if isinstance(unit, Dict) else "1" if _is_switch(one) else unit,
            instances=instances,
            shared=tuple(name for name in shared if name in words["mapping"].inputs),
        )
        for one in equations
        for words in _found(one, text, tables or {}, named)
    ]
    _check_known("parameters", [one.name for one in named], [name for one in equations for name in _read(one)])
    _check_known("tables", list(tables or {}), [node.function for one in equations for node in _calls(one)])
    _check_known("shared", list(shared), [name for one in equations for name in _read(one)])
    return tuple(members)


def bounds_in(text: str, parameters: Collection[str] = ()) -> tuple[float, float]:
    """Between which numbers the right side of an equation is held; infinite where it is not.

    Args:
        text: One equation.
        parameters: Names in it that are estimated.

    Returns:
        Least and greatest value.

    Raises:
        ConfigError: If it cannot be read.
    """
    (equation,) = parse(text)
    return _Reader(text=text, shift=0, parameters=frozenset(parameters)).bounded(equation.right)[1:]


def equation_of(fixed: FixedMember) -> str:
    """A fixed submodel as an equation.

    Args:
        fixed: The submodel.

    Returns:
        The equation, which :func:`fixed_by_equations` reads as the same submodel.

    Example:
        >>> equation_of(*fixed_by_equations("y[k+1] = 0.5*y[k] + 2*u[k]"))
        'y = 2*u[k-1] + 0.5*y[k-1]'
    """
    total = fixed.equation or _sum_of(fixed)
    if (fixed.low, fixed.high) == _SWITCH and fixed.unit == "1":
        total = f"switch({total})"
    elif (fixed.low, fixed.high) != (-math.inf, math.inf):
        total = f"clamp({total}, {_number(fixed.low)}, {_number(fixed.high)})"
    return f"{written_name(fixed.output)} = {total}"


def unit_contradictions_of(fixed: Sequence[FixedMember], like: Trace) -> list[str]:
    """What contradicts itself in the units of fixed submodels, of which nothing is converted.

    Args:
        fixed: The submodels.
        like: A trace with all of their channels.

    Returns:
        A sentence for each place, as :func:`sysid.equations.units_checked.unit_contradictions` gives them.
    """
    there = {one.name: "" if one.unit == "1" else one.unit for one in like.channels}
    told = []
    for one in fixed:
        units = {name: there[name] for name in (*one.mapping.inputs, one.output)}
        units |= {parameter.name: parameter.unit for parameter in one.named}
        text = f"{written_name(one.output)} = {one.equation or _sum_of(one)}"
        system = System.read(text, [parameter.name for parameter in one.named], one.points)
        told += unit_contradictions(system, units)
    return list(dict.fromkeys(told))


def _sum_of(fixed: FixedMember) -> str:
    terms = [
        (weight, f"{written_name(name)}[k-{lag}]" if lag else written_name(name))
        for name, weights in zip(fixed.mapping.inputs, fixed.weights, strict=True)
        for lag, weight in sorted(weights.items())
    ]
    if fixed.memory:
        terms.append((fixed.memory, f"{written_name(fixed.output)}[k-1]"))
    written = [(weight, name if abs(weight) == 1 else f"{_number(abs(weight))}*{name}") for weight, name in terms]
    if fixed.constant:
        written.append((fixed.constant, _number(abs(fixed.constant))))
    first, *others = written
    total = ("-" if first[0] < 0 else "") + first[1]
    return total + "".join(f" {'-' if weight < 0 else '+'} {term}" for weight, term in others)


def _number(value: float) -> str:
    return repr(value).removesuffix(".0")


def _is_switch(equation: Equation) -> bool:
    return isinstance(equation.right, Call) and equation.right.function in {"switch", "relay", "latch"}


def _calls(equation: Equation) -> list[Call]:
    return [node for node in nodes_of(equation.right) if isinstance(node, Call)]


def _read(equation: Equation) -> frozenset[str]:
    """The channels on its right side."""
    return frozenset(node.name for node in nodes_of(equation.right) if isinstance(node, Name | Delayed))


def _check_known(what: str, given: list[str], known: list[str]) -> None:
    strangers = [name for name in given if name not in known]
    if strangers:
        said = f"{what} names {strangers[0]}, which is in none of the equations"
        otherwise = "correct the name, or write its equation"
        raise ConfigError.unknown(said, strangers[0], dict.fromkeys(known), otherwise, where=what)


@dataclass(kw_only=True)
class _Sum:
    """A weighted sum, exact.

    Args:
        weights: Of each channel by how many samples ago, in the order in which they are written.
        constant: What is added.
    """

    weights: dict[tuple[str, int], Fraction] = field(default_factory=dict)
    constant: Fraction = Fraction(0)

    def add(self, other: _Sum, factor: Fraction) -> None:
        """Another one, so many times."""
        for key, weight in other.weights.items():
            self.weights[key] = self.weights.get(key, Fraction(0)) + factor * weight
        self.constant += factor * other.constant

    def times(self, factor: Fraction) -> _Sum:
        """All of it, so many times."""
        weights = {key: weight * factor for key, weight in self.weights.items()}
        return _Sum(weights=weights, constant=self.constant * factor)


class _NoSum(Exception):  # noqa: N818 - nobody is told: what is no sum is an expression
    """Something is no weighted sum."""


def _found(
    equation: Equation, text: str, tables: Dict[str, Any], parameters: tuple[Parameter, ...]
) -> list[dict[str, Any]]:
    """An equation in the words of :class:`FixedMember`: those of what goes with it first."""
    if equation.kind == CONTINUOUS:
        raise equation_error(
            f"{equation.name} is given by its rate",
            text,
            equation.at,
            expected="y = ... or y[k+1] = ..., sample by sample",
            remedy=f"write {equation.name}[k+1] = {equation.name}[k] + h*(...), h being the sample time",
        )
    names = frozenset(one.name for one in parameters)
    reader = _Reader(text=text, shift=int(equation.kind == DISCRETE), parameters=names)
    inside, low, high = reader.bounded(equation.right)
    try:
        return [_held_sum(equation, reader.total(inside, equation.name), text) | {"low": low, "high": high}]
    except _NoSum:
        found = expression_of(equation, inside, text, names)
    try:
        total = replace(reader, shift=0).total(found.equation.right, equation.name)
        words = _held_sum(found.equation, total, text)
    except _NoSum:
        called = {node.function for node in _calls(equation)}
        own = {name: points for name, points in tables.items() if name in called}
        read = _read(found.equation)
        words = words_of(found.equation, names) | {
            "tables": own, "parameters": tuple(one for one in parameters if one.name in read)
        }  # fmt: skip
    return [*found.past, words | {"low": low, "high": high}]


def _held_sum(equation: Equation, total: _Sum, text: str) -> dict[str, Any]:
    """A weighted sum in these words; told where it is none that is held."""
    by_lag: dict[str, dict[int, float]] = {}
    for (name, lag), weight in total.weights.items():
        by_lag.setdefault(name, {})[lag] = float(weight)
    own = by_lag.pop(equation.name, {})
    if set(own) - {1}:
        raise _NoSum
    inputs = tuple(by_lag)
    if not inputs:
        raise reads_nothing(equation, text)
    gains: dict[str, Any] = {name: one[0] if set(one) == {0} else one for name, one in by_lag.items()}
    if own:
        gains[equation.name] = own[1]
    mapping = Mapping(inputs=inputs, outputs=(equation.name,))
    return {"mapping": mapping, "gains": gains, "constant": float(total.constant)}


@dataclass(frozen=True, kw_only=True)
class _Reader:
    """Reads right sides.

    Args:
        text: All equations, to show where something is wrong.
        shift: Samples that all is earlier: 1 where the left side is the next sample.
        parameters: Names of what is estimated: no sum has one.
    """

    text: str
    shift: int
    parameters: frozenset[str] = frozenset()

    def bounded(self, node: Node) -> tuple[Node, float, float]:
        """What of a right side stands between two numbers, and the numbers."""
        if isinstance(node, Call) and node.function in {"clamp", "saturate"}:
            given = self._named(node, ("x", "low", "high"))
            try:
                low, high = (float(self._constant(given[bound])) for bound in ("low", "high"))
            except _NoSum:
                return node, -math.inf, math.inf
            return given["x"], low, high
        if isinstance(node, Call) and node.function == "switch":
            return self._named(node, ("x",))["x"], *_SWITCH
        if isinstance(node, Call) and node.function == "relay":
            return node, *_SWITCH
        return node, -math.inf, math.inf

    def total(self, node: Node, name: str) -> _Sum:
        """What stands between bounds, as a sum."""
        with_slope = isinstance(node, Call) and node.function == "relay" and len(node.parts) > len(("x", "on", "off"))
        return self._relay(node, name) if with_slope and isinstance(node, Call) else self.sum(node)

    def _relay(self, node: Call, name: str) -> _Sum:
        """A Schmitt trigger as a sum with its own last value: see :mod:`sysid.composite.fixed_members`."""
        given = self._named(node, ("x", "on", "off", "slope"))
        on, off, slope = (self._constant(given[option]) for option in ("on", "off", "slope"))
        if not (on > off and slope > 0):
            raise equation_error(
                "the relay has no width",
                self.text,
                node.at,
                expected="on above off, and slope above 0",
                remedy="exchange on and off, and put a minus before what switches it, if it goes on as that falls",
            )
        middle, memory = (on + off) / 2, 1 + slope * (on - off)
        total = self.sum(given["x"]).times(slope)
        total.add(_Sum(weights={(name, 1): Fraction(1)}), memory)
        total.constant += Fraction(1, 2) - slope * middle - memory / 2
        return total

    def _named(self, node: Call, names: tuple[str, ...]) -> dict[str, Node]:
        """The arguments of a function by name."""
        given = dict(zip(names, node.arguments, strict=False))
        twice = [name for name, _ in node.options if name in given]
        given |= dict(node.options)
        if twice or len(node.arguments) > len(names) or set(given) != set(names):
            raise equation_error(
                f"{node.function} has other arguments",
                self.text,
                node.at,
                expected=f"{node.function}({', '.join(names)})",
                remedy="give each of them once, in this order or by name",
            )
        return given

    def _constant(self, node: Node) -> Fraction:
        value = self.sum(node)
        if value.weights:
            raise _NoSum
        return value.constant

    def sum(self, node: Node, depth: int = 0) -> _Sum:
        """An expression as a weighted sum: its terms one after the other, however many there are."""
        total, waiting = _Sum(), [(node, Fraction(1))]
        while waiting:
            one, factor = waiting.pop()
            match one:
                case Operation(operator="+" | "-" as sign, operands=(left, right)):
                    waiting += [(right, factor if sign == "+" else -factor), (left, factor)]
                case Operation(operator="-", operands=(negated,)):
                    waiting.append((negated, -factor))
                case _:
                    total.add(self._term(one, depth), factor)
        return total

    def _term(self, node: Node, depth: int) -> _Sum:
        """What is no sum or difference: a number, a channel, or one of them so many times."""
        if depth > DEEPEST:
            raise _NoSum
        match node:
            case Number():
                return _Sum(constant=Fraction(repr(node.value)))
            case Name() if node.name not in self.parameters:
                return _Sum(weights={(node.name, self.shift): Fraction(1)})
            case Delayed(seconds=False):
                return _Sum(weights={(node.name, int(node.lag) + self.shift): Fraction(1)})
            case Operation(operator="*" | "/" as sign, operands=operands):
                left, right = (self.sum(one, depth + 1) for one in operands)
                if sign == "*" and not left.weights:
                    left, right = right, left
                if sign == "/" and not right.weights and not right.constant:
                    raise equation_error(
                        "a division by 0", self.text, node.at, expected="another divisor", remedy="correct it"
                    )
                if not right.weights:
                    return left.times(right.constant if sign == "*" else 1 / right.constant)
        raise _NoSum
