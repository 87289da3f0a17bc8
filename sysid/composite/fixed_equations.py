"""Fixed submodels as equations: ``RL = relay(BP - AR, on=1.45, off=-0.985, slope=20)``.

An equation here is a weighted sum of channels, now and some samples ago, held between two bounds
(:mod:`sysid.composite.fixed_members`). Sums are done in fractions of the decimals that are written: 0.1 + 0.2 is 0.3,
and an equation is the same submodel to the last bit as the weights that it stands for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from sysid.composite.composite import FixedMember
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
from sysid.equations.system import written_name
from sysid.errors import ConfigError
from sysid.models import Mapping

_FORM = "a weighted sum of channels, alone or in clamp(sum, low, high), switch(sum) or relay(sum, on=, off=, slope=)"
_SWITCH = (0.0, 1.0)
"""Bounds of a switch: off, on and how far between."""


def fixed_by_equations(
    text: str,
    *,
    rest: float | Dict[str, float] = 0.0,
    unit: str | Dict[str, str] = "1",
    instances: tuple[str, ...] = ("",),
    shared: tuple[str, ...] = (),
) -> tuple[FixedMember, ...]:
    """Fixed submodels, one for each equation.

    Args:
        text: Equations, one a line: ``y = clamp(2*u - x[k-1], -5, 5)``, ``y[k+1] = ...``; ``y = switch(u - 3)``, a pure
            number that is held between 0 and 1; or ``y = relay(u, on=2, off=1, slope=20)``, a switch with hysteresis:
            beyond ``on`` it goes to 1, the quicker the larger ``slope``, and stays until ``u`` is back at ``off``.
        rest: Values at rest, in the units of the outputs: one for all, or by output; 0 for those without.
        unit: Units of the outputs: one for all but switches, or by output; a pure number for those without.
        instances: Suffixes of the channel names, one for each instance.
        shared: Inputs that have the same name in every instance.

    Returns:
        The submodels, in the order of the equations.

    Raises:
        ConfigError: If the text is none, an equation is no held sum, or what has a rest or a unit has no equation.

    Example:
        >>> (relay,) = fixed_by_equations("R = relay(p - q, on=1.5, off=-0.5, slope=10)", rest={"R": 1})
        >>> str(relay.mapping), relay.memory, relay.constant, relay.low, relay.high
        ('p+q -> R', 21.0, -15.0, 0.0, 1.0)
    """
    equations = parse(text)
    names = [one.name for one in equations]
    for what, given in (("rest", rest), ("unit", unit)):
        _check_known(what, list(given) if isinstance(given, Dict) else [], names)
    members = [
        FixedMember(
            **_held_sum(one, text),
            rest=rest.get(one.name, 0.0) if isinstance(rest, Dict) else rest,
            unit=unit.get(one.name, "1") if isinstance(unit, Dict) else "1" if _is_switch(one) else unit,
            instances=instances,
            shared=tuple(name for name in shared if name in _read(one)),
        )
        for one in equations
    ]
    _check_known("shared", list(shared), [name for one in equations for name in _read(one)])
    return tuple(members)


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
    total += "".join(f" {'-' if weight < 0 else '+'} {term}" for weight, term in others)
    if (fixed.low, fixed.high) == _SWITCH and fixed.unit == "1":
        total = f"switch({total})"
    elif (fixed.low, fixed.high) != (-math.inf, math.inf):
        total = f"clamp({total}, {_number(fixed.low)}, {_number(fixed.high)})"
    return f"{written_name(fixed.output)} = {total}"


def _number(value: float) -> str:
    return repr(value).removesuffix(".0")


def _is_switch(equation: Equation) -> bool:
    return isinstance(equation.right, Call) and equation.right.function in {"switch", "relay"}


def _read(equation: Equation) -> frozenset[str]:
    """The channels on its right side."""
    return frozenset(node.name for node in nodes_of(equation.right) if isinstance(node, Name | Delayed))


def _check_known(what: str, given: list[str], known: list[str]) -> None:
    strangers = [name for name in given if name not in known]
    if strangers:
        raise ConfigError(
            f"{what} names {strangers[0]}, which is in none of the equations",
            where=what,
            expected=f"one of {', '.join(dict.fromkeys(known))}",
            got=strangers[0],
            remedy="correct the name, or write its equation",
        )


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


def _held_sum(equation: Equation, text: str) -> dict[str, Any]:
    """An equation in the words of :class:`FixedMember`."""
    if equation.kind == CONTINUOUS:
        raise equation_error(
            f"{equation.name} is given by its rate",
            text,
            equation.at,
            expected="y = ... or y[k+1] = ..., sample by sample",
            remedy=f"write {equation.name}[k+1] = {equation.name}[k] + h*(...), h being the sample time",
        )
    reader = _Reader(text=text, shift=int(equation.kind == DISCRETE))
    total, low, high = reader.held(equation.right, equation.name)
    by_lag: dict[str, dict[int, float]] = {}
    for (name, lag), weight in total.weights.items():
        by_lag.setdefault(name, {})[lag] = float(weight)
    own = by_lag.pop(equation.name, {})
    _check_own(equation, own, text)
    inputs = tuple(by_lag)
    if not inputs:
        raise equation_error(
            f"{equation.name} reads no other channel",
            text,
            equation.at,
            expected="at least one channel on the right side",
            remedy="leave it out: a constant is added where it is needed",
        )
    gains: dict[str, Any] = {name: one[0] if set(one) == {0} else one for name, one in by_lag.items()}
    if own:
        gains[equation.name] = own[1]
    mapping = Mapping(inputs=inputs, outputs=(equation.name,))
    return {"mapping": mapping, "gains": gains, "constant": float(total.constant), "low": low, "high": high}


def _check_own(equation: Equation, own: Dict[int, float], text: str) -> None:
    for lag in sorted(set(own) - {1}):
        raise equation_error(
            f"{equation.name} reads itself {'now' if lag == 0 else f'{lag} samples ago'}",
            text,
            equation.at,
            expected=f"its last value alone, {equation.name}[k-1]",
            remedy="write it so; give an earlier value a name in an equation of its own",
        )


@dataclass(frozen=True, kw_only=True)
class _Reader:
    """Reads right sides.

    Args:
        text: All equations, to show where something is wrong.
        shift: Samples that all is earlier: 1 where the left side is the next sample.
    """

    text: str
    shift: int

    def held(self, node: Node, name: str) -> tuple[_Sum, float, float]:
        """A right side as a sum and its two bounds."""
        if isinstance(node, Call) and node.function in {"clamp", "saturate"}:
            given = self._named(node, ("x", "low", "high"))
            low, high = (float(self._constant(given[bound])) for bound in ("low", "high"))
            return self.sum(given["x"]), low, high
        if isinstance(node, Call) and node.function == "switch":
            return self.sum(self._named(node, ("x",))["x"]), *_SWITCH
        if isinstance(node, Call) and node.function == "relay":
            return self._relay(node, name), *_SWITCH
        return self.sum(node), -math.inf, math.inf

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
            raise self._no_sum(node, "a bound, a factor or a setting that hangs on a channel", "a number")
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
            raise self._no_sum(node, f"more than {DEEPEST} factors in a row", _FORM)
        match node:
            case Number():
                return _Sum(constant=Fraction(repr(node.value)))
            case Name():
                return _Sum(weights={(node.name, self.shift): Fraction(1)})
            case Delayed(seconds=False):
                return _Sum(weights={(node.name, int(node.lag) + self.shift): Fraction(1)})
            case Delayed():
                raise self._no_sum(node, "a delay in seconds", f"a delay in samples, {node.name}[k-5]")
            case Operation(operator="*" | "/" as sign, operands=operands):
                left, right = (self.sum(one, depth + 1) for one in operands)
                if sign == "*" and not left.weights:
                    left, right = right, left
                if not right.weights and (sign == "*" or right.constant):
                    return left.times(right.constant if sign == "*" else 1 / right.constant)
            case Call():
                raise self._no_sum(node, f"{node.function} within an expression", _FORM)
        raise self._no_sum(node, "no weighted sum", _FORM)

    def _no_sum(self, node: Node, what: str, expected: str) -> ConfigError:
        return equation_error(
            f"{what} in the equation of a fixed submodel",
            self.text,
            node.at,
            expected=expected,
            remedy="give the part a name in an equation of its own; what is no held sum is fitted as a member, or is a "
            "GreyBox (docs/how/equations.md)",
        )
