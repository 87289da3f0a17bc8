"""The functions of the language: what each takes, and the operations that it becomes.

A function is a row of :data:`FUNCTIONS`. Those that remember (``relay``, ``latch``, ``hold``) and ``net`` have states
or weights of their own, and become operations in :mod:`sysid.equations.lowering`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from sysid.kernels import register_machine as machine


class Values(Protocol):
    """What makes values of values."""

    def constant(self, value: float) -> int:
        """A number."""

    def value_of(self, node: int) -> float | None:
        """The value of a constant; ``None`` for what is none."""

    def apply(self, operation: int, a: int, b: int | None = None, c: int | None = None, own: int = 0) -> int:
        """An operation over values."""

    def switch(self, operation: int, a: int) -> int:
        """A switch on a value."""


ALIKE, PURE, ANGLE, SECONDS, ANY = "alike", "pure", "angle", "seconds", ""
"""Units of arguments and values: one unit for all that are alike, a pure number, radians, seconds, and what may be."""
ROOT = "root"
"""The unit of a value that is the square root of its argument's."""


@dataclass(frozen=True, kw_only=True)
class Function:
    """A function.

    Args:
        arguments: Names of its arguments, in order.
        says: What it is, for people.
        lower: Its operations; ``None`` where it has states or weights of its own.
        units: What each argument is in; the last one is that of all that may follow.
        gives: What its value is in.
        more: Whether there may be more arguments than have names.
    """

    arguments: tuple[str, ...]
    says: str
    lower: Callable[..., int] | None = None
    units: tuple[str, ...]
    gives: str
    more: bool = False

    def unit_of(self, place: int) -> str:
        """What an argument is in.

        Args:
            place: Which, from 0.

        Returns:
            One of the kinds above.
        """
        return self.units[min(place, len(self.units) - 1)]


def _unary(operation: int) -> Callable[[Values, int], int]:
    return lambda g, x: g.apply(operation, x)


def _many(operation: int) -> Callable[..., int]:
    def lower(g: Values, *values: int) -> int:
        found = values[0]
        for value in values[1:]:
            found = g.apply(operation, found, value)
        return found

    return lower


def _clamp(g: Values, x: int, low: int, high: int) -> int:
    return g.apply(machine.MIN, g.apply(machine.MAX, x, low), high)


def _deadzone(g: Values, x: int, low: int, high: int) -> int:
    above = g.apply(machine.MAX, g.apply(machine.SUB, x, high), g.constant(0.0))
    below = g.apply(machine.MIN, g.apply(machine.SUB, x, low), g.constant(0.0))
    return g.apply(machine.ADD, above, below)


def _where(g: Values, condition: int, yes: int, no: int) -> int:
    return g.apply(machine.SELECT, condition, yes, no)


def _tan(g: Values, x: int) -> int:
    return g.apply(machine.DIV, g.apply(machine.SIN, x), g.apply(machine.COS, x))


def _hyperbolic(sign: int) -> Callable[[Values, int], int]:
    def lower(g: Values, x: int) -> int:
        up, down = g.apply(machine.EXP, x), g.apply(machine.EXP, g.apply(machine.NEG, x))
        return g.apply(machine.MUL, g.constant(0.5), g.apply(sign, up, down))

    return lower


def _log10(g: Values, x: int) -> int:
    return g.apply(machine.MUL, g.constant(1.0 / math.log(10.0)), g.apply(machine.LOG, x))


_X, _ONE_UNIT = ("x",), (ALIKE,)
LIMITS, _ONE_UNIT_EACH = ("x", "low", "high"), (ALIKE, ALIKE, ALIKE)
"""What a function takes that has limits."""


def _of_number(lower: Callable[..., int], says: str, units: str = PURE) -> Function:
    """A function that makes a pure number of one."""
    return Function(arguments=_X, lower=lower, units=(units,), gives=PURE, says=says)


def _limited(lower: Callable[..., int], says: str) -> Function:
    return Function(arguments=LIMITS, lower=lower, units=_ONE_UNIT_EACH, gives=ALIKE, says=says)


def _most(operation: int, says: str) -> Function:
    return Function(arguments=("a", "b"), lower=_many(operation), units=_ONE_UNIT, gives=ALIKE, more=True, says=says)


FUNCTIONS: dict[str, Function] = {
    "abs": Function(arguments=_X, lower=_unary(machine.ABS), units=_ONE_UNIT, gives=ALIKE, says="magnitude"),
    "sqrt": Function(
        arguments=_X,
        lower=lambda g, x: g.switch(machine.SQRT, x),
        units=_ONE_UNIT,
        gives=ROOT,
        says="square root; 0 of what is below 0",
    ),
    "exp": _of_number(_unary(machine.EXP), "exponential"),
    "log": _of_number(_unary(machine.LOG), "natural logarithm"),
    "log10": _of_number(_log10, "decimal logarithm"),
    "tanh": _of_number(_unary(machine.TANH), "hyperbolic tangent"),
    "sinh": _of_number(_hyperbolic(machine.SUB), "hyperbolic sine"),
    "cosh": _of_number(_hyperbolic(machine.ADD), "hyperbolic cosine"),
    "sin": _of_number(_unary(machine.SIN), "sine, of radians", ANGLE),
    "cos": _of_number(_unary(machine.COS), "cosine, of radians", ANGLE),
    "tan": _of_number(_tan, "tangent, of radians", ANGLE),
    "atan": _of_number(_unary(machine.ATAN), "arc tangent, in radians"),
    "min": _most(machine.MIN, "the least"),
    "max": _most(machine.MAX, "the greatest"),
    "sign": Function(
        arguments=_X, lower=lambda g, x: g.switch(machine.SIGN, x), units=_ONE_UNIT, gives=PURE, says="-1, 0 or 1"
    ),
    "clamp": _limited(_clamp, "held within limits"),
    "saturate": _limited(_clamp, "the same as clamp"),
    "deadzone": _limited(_deadzone, "0 between limits, and what is beyond them"),
    "where": Function(
        arguments=("condition", "yes", "no"),
        lower=_where,
        units=(ANY, ALIKE, ALIKE),
        gives=ALIKE,
        says="one of two, by a condition",
    ),
    "relay": Function(
        arguments=("x", "on", "off"),
        units=_ONE_UNIT_EACH,
        gives=PURE,
        says="relay(x, on=2, off=1): 1 from above on until below off, then 0",
    ),
    "latch": Function(
        arguments=("set", "reset"),
        units=(ANY, ANY),
        gives=PURE,
        says="latch(set, reset): 1 from when set holds until reset holds",
    ),
    "hold": Function(
        arguments=("x", "when"),
        units=(ALIKE, ANY),
        gives=ALIKE,
        says="hold(x, when): x where the condition holds, and what it was then afterwards",
    ),
    "net": Function(
        arguments=_X,
        units=(ANY,),
        gives=ANY,
        more=True,
        says="net(x1, u, neurons=8): a network, for what is not known",
    ),
    "delay": Function(
        arguments=("x", "tau"), units=(ALIKE, SECONDS), gives=ALIKE, says="delay(x, 0.5): x some seconds ago"
    ),
}
"""By name."""

OWN = {name: one for name, one in FUNCTIONS.items() if one.lower is None}
"""Functions that have states or weights of their own."""

CONSTANTS = {"pi": math.pi}
"""Names of numbers."""


MOST_FACTORS = 4
"""A whole power up to this is a product."""


def _power(g: Values, a: int, b: int) -> int:
    power = g.value_of(b)
    if power is None or power not in range(2, MOST_FACTORS + 1):
        return g.apply(machine.POW, a, b)
    square = g.apply(machine.MUL, a, a)
    if power == MOST_FACTORS:
        return g.apply(machine.MUL, square, square)
    return square if power == 2.0 else g.apply(machine.MUL, square, a)


def operator(g: Values, sign: str, a: int, b: int) -> int:
    """An operator between two values.

    Args:
        g: Makes values.
        sign: The operator.
        a: On its left.
        b: On its right.

    Returns:
        The value; of a comparison 1 or 0.
    """
    plain = {
        "+": machine.ADD,
        "-": machine.SUB,
        "*": machine.MUL,
        "/": machine.DIV,
        "and": machine.MIN,
        "or": machine.MAX,
    }
    if sign in plain:
        return g.apply(plain[sign], a, b)
    if sign == "^":
        return _power(g, a, b)
    # Conditions are the signs of differences, so that a switch has a distance that a fit can smooth.
    if sign in {"<", "<="}:
        a, b = b, a
    strict = sign in {"<", ">"}
    return g.switch(machine.GREATER if strict else machine.NOT_LESS, g.apply(machine.SUB, a, b))
