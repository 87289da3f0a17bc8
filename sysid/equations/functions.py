"""The functions of the language: what each takes, and the operations that it becomes.

A function is a row of :data:`FUNCTIONS`. Those that remember (``relay``, ``latch``, ``hold``) and ``net`` have states
or weights of their own, and are in :mod:`sysid.equations.lowering`.
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


@dataclass(frozen=True, kw_only=True)
class Function:
    """A function.

    Args:
        arguments: Names of its arguments, in order.
        lower: Its operations.
        more: Whether there may be more arguments than have names.
        says: What it is, for people.
    """

    arguments: tuple[str, ...]
    lower: Callable[..., int]
    says: str
    more: bool = False


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


_X = ("x",)
LIMITS = ("x", "low", "high")
"""What a function takes that has limits."""

FUNCTIONS: dict[str, Function] = {
    "abs": Function(arguments=_X, lower=_unary(machine.ABS), says="magnitude"),
    "sqrt": Function(
        arguments=_X, lower=lambda g, x: g.switch(machine.SQRT, x), says="square root; 0 of what is below 0"
    ),
    "exp": Function(arguments=_X, lower=_unary(machine.EXP), says="exponential"),
    "log": Function(arguments=_X, lower=_unary(machine.LOG), says="natural logarithm"),
    "log10": Function(arguments=_X, lower=_log10, says="decimal logarithm"),
    "tanh": Function(arguments=_X, lower=_unary(machine.TANH), says="hyperbolic tangent"),
    "sinh": Function(arguments=_X, lower=_hyperbolic(machine.SUB), says="hyperbolic sine"),
    "cosh": Function(arguments=_X, lower=_hyperbolic(machine.ADD), says="hyperbolic cosine"),
    "sin": Function(arguments=_X, lower=_unary(machine.SIN), says="sine, of radians"),
    "cos": Function(arguments=_X, lower=_unary(machine.COS), says="cosine, of radians"),
    "tan": Function(arguments=_X, lower=_tan, says="tangent, of radians"),
    "atan": Function(arguments=_X, lower=_unary(machine.ATAN), says="arc tangent, in radians"),
    "min": Function(arguments=("a", "b"), lower=_many(machine.MIN), more=True, says="the least"),
    "max": Function(arguments=("a", "b"), lower=_many(machine.MAX), more=True, says="the greatest"),
    "sign": Function(arguments=_X, lower=lambda g, x: g.switch(machine.SIGN, x), says="-1, 0 or 1"),
    "clamp": Function(arguments=LIMITS, lower=_clamp, says="held within limits"),
    "saturate": Function(arguments=LIMITS, lower=_clamp, says="the same as clamp"),
    "deadzone": Function(arguments=LIMITS, lower=_deadzone, says="0 between limits, and what is beyond them"),
    "where": Function(arguments=("condition", "yes", "no"), lower=_where, says="one of two, by a condition"),
}
"""By name."""

CONSTANTS = {"pi": math.pi}
"""Names of numbers."""

OWN = {
    "relay": "relay(x, on=2, off=1): 1 from above on until below off, then 0",
    "latch": "latch(set, reset): 1 from when set holds until reset holds",
    "hold": "hold(x, when): x where the condition holds, and what it was then afterwards",
    "net": "net(x1, u, neurons=8): a network, for what is not known",
    "delay": "delay(x, 0.5): x some seconds ago",
}
"""Functions that have states or weights of their own, and how each is written."""


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
