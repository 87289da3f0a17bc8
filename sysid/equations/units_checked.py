"""Whether the units of equations go together: numbers are taken as they are, and nothing converts between them.

What has no unit, as a plain number, is taken for whatever fits, so that only what contradicts itself is told: sums and
comparisons of different things, the same thing in different units, angles in degrees. A factor such as ``60`` may
convert from one unit to another, and one such as ``9.81``, ``4180`` or ``1000`` may have a unit of its own that nobody
wrote: of what it is in nothing is known.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from collections.abc import Mapping as Dict
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

from sysid.equations.functions import ALIKE, ANGLE, ANY, FUNCTIONS, PURE, ROOT, SECONDS, Function
from sysid.equations.syntax import CONTINUOUS, Call, Delayed, Equation, Name, Node, Number, Operation, nodes_of
from sysid.equations.system import System
from sysid.equations.written import written
from sysid.written_units import plain_unit, registry

_SAME: Final = 1e-3
"""Units of one thing are the same up to this: some have been rounded differently, as psi in Pa."""
_PURE: Final = frozenset({1.0, 2.0, 3.0, 4.0, 0.5, 0.25, math.pi})
"""Factors that are of geometry, and have no unit."""
_SUMS, _PRODUCTS, _POWERS, _LOGIC = ("+", "-"), ("*", "/"), ("^", "**"), ("and", "or")


@dataclass(frozen=True)
class _Unit:
    """What a part of an expression is in."""

    of: Any  # a pint unit: what its arithmetic returns is typed as something less

    def __str__(self) -> str:
        return f"{self.of:~C}" or "1"

    def contradicts(self, other: _Unit) -> bool:
        """Whether numbers in one are none in the other."""
        if self.of.dimensionality != other.of.dimensionality:
            return True
        return not math.isclose(_factor(self.of), _factor(other.of), rel_tol=_SAME)


_Known: TypeAlias = "_Unit | None"


def unit_contradictions(system: System, units: Dict[str, str]) -> list[str]:
    """What contradicts itself in the units of equations.

    Args:
        system: The equations.
        units: By name the unit of inputs, outputs, states and parameters, as people write them; ``""`` where none is
            known, and ``"1"`` for a pure number.

    Returns:
        A sentence for each place; none where all goes together, or too little is known.

    Example:
        >>> system = System.read("dlevel/dt = flow/area - level", ["area"])
        >>> unit_contradictions(system, {"level": "m", "flow": "m^3/s", "area": "m^2"})
        ['flow / area is in m/s, and level in m, in the equation of level: they are added or compared.']
    """
    if len({unit for unit in units.values() if unit}) < 2 and not any(map(units.get, system.parameters)):
        return []  # of one unit alone nothing is apart, and pint takes a third of a second to load
    known: dict[str, _Known] = {name: _read(unit) for name, unit in units.items()}
    told = [f"{name} is in {unit}, which is no unit that is known: it was not checked." for name, unit in units.items()
            if unit and known[name] is None]  # fmt: skip
    _inferred(system, known)
    checks = [_Check(equation, known, system) for equation in system.equations]
    return told + list(dict.fromkeys(text for one in checks for text in one.told))


def _inferred(system: System, known: dict[str, _Known]) -> None:
    """Add what the equations show of names whose unit nobody gave: where two names are equal first."""
    states = [one for one in system.equations if one.name not in system.definitions]
    in_order = [*(system.definitions[name] for name in system.order), *states]  # what is read before who reads it
    shown = True
    while shown:
        shown = False
        for by_formula in (False, True):
            for equation in () if shown else in_order:
                for name, unit in _Check(equation, known, system).shown(by_formula=by_formula):
                    known[name] = unit
                    shown = True


@dataclass
class _Check:
    """One equation, looked through with what is known so far."""

    equation: Equation
    known: Dict[str, _Known]
    system: System
    told: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        read = {node.name for node in nodes_of(self.equation.right) if isinstance(node, Name | Delayed)}
        mine = read.intersection(self.system.parameters)
        self.complete = all(self.known.get(name) for name in mine)
        # A number beside parameters that all have units has one of its own only by mistake.
        self.strict = self.complete and bool(mine)
        self.left = self._times(self.known.get(self.equation.name), per_second=self.equation.kind == CONTINUOUS)
        self.right = self.unit(self.equation.right)
        self._assigned()

    def _times(self, unit: _Known, *, per_second: bool) -> _Known:
        return _Unit(unit.of / registry().second) if unit and per_second else unit

    def _assigned(self) -> None:
        if not (self.left and self.right and self.left.contradicts(self.right)):
            return
        of_one_kind = self.left.of.dimensionality == self.right.of.dimensionality
        if self.strict or of_one_kind:
            rate = "The rate of " * (self.equation.kind == CONTINUOUS)
            self.told.append(
                f"{rate}{self.equation.name} is in {self.left}, and its equation gives {self.right}"
                f"{': nothing converts it' if of_one_kind else ''}."
            )

    def shown(self, *, by_formula: bool = False) -> list[tuple[str, _Unit]]:
        """Names whose unit nobody gave and this equation shows: by a name alone on its right, or by more."""
        right, rate = self.equation.right, self.equation.kind == CONTINUOUS
        sides: list[tuple[str, _Known]] = []
        if isinstance(right, Name) or (by_formula and self.complete):
            whole = _Unit(self.right.of * registry().second) if self.right and rate else self.right
            sides.append((self.equation.name, whole))
        if isinstance(right, Name):
            sides.append((right.name, self.left))
        return [(name, unit) for name, unit in sides if unit and not self.known.get(name)]

    def unit(self, node: Node) -> _Known:
        """What a part is in; ``None`` where nobody knows."""
        match node:
            case Number():
                return _number() if self.strict and node.value in _PURE else None
            case Name() | Delayed():
                return self.known.get(node.name)
            case Call():
                return self._call(node)
        assert isinstance(node, Operation)  # noqa: S101 - there is no other node
        return self._operation(node)

    def _operation(self, node: Operation) -> _Known:
        if len(node.operands) == 1:
            inside = self.unit(node.operands[0])
            return inside if node.operator == "-" else _number()
        a, b = node.operands
        if node.operator in _SUMS:
            return self._alike([part for _, part in _chain(node, _SUMS)])
        if node.operator in _PRODUCTS:
            found: _Known = _number()
            for operator, part in _chain(node, _PRODUCTS):
                found = _product(found, self.unit(part), operator)
            return found
        if node.operator in _POWERS:
            return self._power(self.unit(a), b)
        if node.operator in _LOGIC:
            for _, part in _chain(node, _LOGIC):
                self.unit(part)
        else:
            self._alike((a, b))
        return _number()

    def _power(self, base: _Known, exponent: Node) -> _Known:
        negative = isinstance(exponent, Operation) and len(exponent.operands) == 1 and exponent.operator == "-"
        inside = exponent.operands[0] if negative and isinstance(exponent, Operation) else exponent
        if base is None or not isinstance(inside, Number):
            return None
        return _Unit(base.of ** (-inside.value if negative else inside.value))

    def _alike(self, parts: Sequence[Node]) -> _Known:
        """The unit that parts have in common; told where they have none."""
        first: tuple[Node, _Unit] | None = None
        apart = False
        for node in parts:
            # A bare number in a sum has the unit of the rest.
            unit = None if isinstance(node, Number) else self.unit(node)
            if unit and first and unit.contradicts(first[1]):
                apart = True
                self.told.append(
                    f"{written(first[0])} is in {first[1]}, and {written(node)} in {unit}, in the equation of "
                    f"{self.equation.name}: they are added or compared."
                )
            first = first or ((node, unit) if unit else None)
        return first[1] if first and not apart else None

    def _call(self, node: Call) -> _Known:
        one = FUNCTIONS.get(node.function, FUNCTIONS["net"])  # of a table nobody knows what it makes of what
        alike: list[Node] = []
        for asked, part in _asked(one, node):
            if asked == ALIKE:
                alike.append(part)
            elif found := self.unit(part):
                self._as_asked(node, found, asked)
        common = self._alike(alike)
        if one.gives == PURE:
            return _number()
        if one.gives == ROOT and common:
            return _Unit(common.of**0.5)
        return common if one.gives == ALIKE else None

    def _as_asked(self, node: Call, unit: _Unit, asked: str) -> None:
        """Tell of an argument that is not what its function is of."""
        if asked == SECONDS and unit.contradicts(_Unit(registry().second)):
            self.told.append(f"{written(node)} is late by what is in {unit}: seconds are meant.")
        elif asked in {PURE, ANGLE} and unit.of.dimensionality:
            self.told.append(f"{written(node)} is of what is in {unit}, where a pure number is meant.")
        elif asked == ANGLE and unit.contradicts(_Unit(registry().radian)):
            self.told.append(f"{written(node)} is of what is in {unit}: radians are meant.")


def _asked(function: Function, node: Call) -> list[tuple[str, Node]]:
    """Arguments, each with what its function takes it to be in: those by name by theirs, in whatever order."""
    by_name = dict(zip(function.arguments, map(function.unit_of, range(len(function.arguments))), strict=True))
    found = [(function.unit_of(place), one) for place, one in enumerate(node.arguments)]
    return found + [(by_name.get(name, ANY), one) for name, one in node.options]


def _chain(node: Operation, operators: Collection[str]) -> list[tuple[str, Node]]:
    """Operands from left to right, each with what stands before it: a sum of a thousand terms is not gone into."""
    parts: list[tuple[str, Node]] = []
    left: Node = node
    while isinstance(left, Operation) and len(left.operands) == 2 and left.operator in operators:
        parts.append((left.operator, left.operands[1]))
        left = left.operands[0]
    return [("*", left), *reversed(parts)]


def _number() -> _Unit:
    return _Unit(registry().dimensionless)


def _product(a: _Known, b: _Known, operator: str) -> _Known:
    if a is None or b is None:
        return None
    return _Unit(a.of * b.of if operator == "*" else a.of / b.of)


def _factor(unit: Any) -> float:
    """How many base units it is; of a temperature its degree, wherever its zero lies."""
    factor: Any = registry().get_root_units(unit, check_nonmult=False)[0]
    return float(factor)


def _read(unit: str) -> _Known:
    plain = plain_unit(unit) if unit else None
    if plain is None:
        return None
    import pint

    found = _Unit(registry().parse_units("dimensionless" if plain == "1" else plain))
    try:
        _factor(found.of)
    except pint.UndefinedUnitError:  # a ratio of decibels, for which pint has a name and no unit
        return None
    return found
