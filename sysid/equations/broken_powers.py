"""Powers in equations that are no numbers where what is raised is below 0."""

from __future__ import annotations

from dataclasses import replace

from sysid.equations.syntax import Call, Node, Number, Operation, nodes_of
from sysid.equations.system import System
from sysid.equations.written import written

_POSITIVE = frozenset({"abs", "exp", "sqrt", "cosh"})
"""Functions whose value is never below 0."""


def broken_powers(system: System) -> tuple[tuple[str, str], ...]:
    """Powers that may have no value: no whole number above what nothing keeps at 0 or more.

    Args:
        system: The equations.

    Returns:
        Each as it is written, and as one that is 0 there.

    Example:
        >>> broken_powers(System.read("dx/dt = u - a*x^1.5 + x^2 + max(x, 0)^a", ["a"]))
        (('x^1.5', 'max(x, 0)^1.5'),)
    """
    found: dict[str, str] = {}
    for equation in system.equations:
        for node in nodes_of(equation.right):
            if isinstance(node, Operation) and node.operator == "^":
                base, exponent = node.operands
                if not _whole(exponent) and not _kept_positive(base):
                    kept = Call(function="max", arguments=(base, Number(value=0.0, at=node.at)), at=node.at)
                    found[written(node)] = written(replace(node, operands=(kept, exponent)))
    return tuple(found.items())


def _whole(node: Node) -> bool:
    inside = node.operands[0] if isinstance(node, Operation) and len(node.operands) == 1 else node
    return isinstance(inside, Number) and inside.value.is_integer()


def _kept_positive(node: Node) -> bool:
    """Whether it is seen that this is never below 0."""
    if isinstance(node, Call) and node.function == "max":
        return any(_kept_positive(one) for one in node.arguments)
    if isinstance(node, Operation) and node.operator == "^":
        return isinstance(node.operands[1], Number) and node.operands[1].value % 2.0 == 0.0
    return (isinstance(node, Number) and node.value >= 0.0) or (isinstance(node, Call) and node.function in _POSITIVE)
