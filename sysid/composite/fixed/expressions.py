"""Fixed submodels that are no weighted sums: any expression of the language of equations.

What an expression remembers is a channel. So a relay, a latch or a value that is held is an equation of its own, which
reads what it was a sample ago; and an equation's own past is a fixed submodel beside it, called after it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from sysid.equations.functions import OWN
from sysid.equations.parser import parse
from sysid.equations.syntax import (
    DEFINITION,
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
from sysid.equations.written import rewritten, written
from sysid.errors import ConfigError
from sysid.models import Mapping

_REMEMBER = frozenset({"relay", "latch", "hold"})
"""Functions that may be the whole of an equation."""

_COMPARED = frozenset({"<", "<=", ">", ">=", "and", "or", "not"})


@dataclass(frozen=True, kw_only=True)
class FixedExpression:
    """A fixed submodel as it was found in an equation.

    Args:
        equation: What it is, of other channels alone.
        past: Its own past where it reads that, in the words of :class:`sysid.composite.FixedMember`.
    """

    equation: Equation
    past: tuple[dict[str, Any], ...]


def expression_of(equation: Equation, right: Node, text: str, parameters: Collection[str] = ()) -> FixedExpression:
    """What an equation says that is no weighted sum.

    Args:
        equation: The equation.
        right: What of its right side is left once its bounds are taken away.
        text: All equations, to show where something is wrong.
        parameters: Names that are no channels.

    Returns:
        The fixed submodel, and what goes with it.

    Raises:
        ConfigError: With line and column, of what cannot be fixed.
    """
    name = equation.name
    if equation.kind == DISCRETE:
        right = rewritten(right, partial(_a_sample_earlier, parameters))
    if right is equation.right or equation.kind == DISCRETE:
        right = _without_memory(right, name, text)
    right = rewritten(right, _plain)
    _check(right, name, text)
    lags = sorted({int(node.lag) for node in nodes_of(right) if isinstance(node, Delayed) and node.name == name})
    past = {lag: f"{name} before" if lag == 1 else f"{name} {lag} before" for lag in lags}

    def own(node: Node) -> Node:
        mine = isinstance(node, Delayed) and node.name == name
        return Name(name=past[int(node.lag)], at=node.at) if mine else node  # type: ignore[attr-defined]  # a Delayed

    found = replace(equation, kind=DEFINITION, right=rewritten(right, own))
    if not set(channels_of(found.right, parameters)) - set(past.values()):
        raise reads_nothing(equation, text)
    return FixedExpression(
        equation=found,
        past=tuple(
            {"mapping": Mapping(inputs=(name,), outputs=(before,)), "gains": {name: {lag: 1.0}}}
            for lag, before in past.items()
        ),
    )


def words_of(equation: Equation, parameters: Collection[str] = ()) -> dict[str, Any]:
    """An equation of other channels, and of parameters, in the words of :class:`sysid.composite.FixedMember`."""
    text = written(equation.right)
    (again,) = parse(f"{written_name(equation.name)} = {text}")  # in whose order the channels are counted
    inputs = channels_of(again.right, parameters)
    return {"mapping": Mapping(inputs=inputs, outputs=(equation.name,)), "equation": text}


def channels_of(node: Node, parameters: Collection[str] = ()) -> tuple[str, ...]:
    """The channels that an expression reads, in order."""
    read = sorted((one for one in nodes_of(node) if isinstance(one, Name | Delayed)), key=lambda one: one.at)
    return tuple(dict.fromkeys(one.name for one in read if one.name not in parameters))


def moving(node: Node) -> frozenset[str]:
    """The names in an expression that it moves with: what is compared decides, and moves nothing.

    Args:
        node: The expression.

    Returns:
        The names.
    """
    match node:
        case Name() | Delayed():
            return frozenset([node.name])
        case Operation() if node.operator in _COMPARED:
            return frozenset()
        case Operation():
            return frozenset().union(*map(moving, node.operands))
        case Call() if node.function == "sign":
            return frozenset()
        case Call():
            return frozenset().union(*map(moving, node.parts))
    return frozenset()


def reads_nothing(equation: Equation, text: str) -> ConfigError:
    """Why a constant is no fixed submodel."""
    return equation_error(
        f"{equation.name} reads no other channel",
        text,
        equation.at,
        expected="at least one channel on the right side",
        remedy="leave it out: a constant is added where it is needed",
    )


def _a_sample_earlier(parameters: Collection[str], node: Node) -> Node:
    match node:
        case Name() if node.name not in parameters:
            return Delayed(name=node.name, lag=1.0, seconds=False, at=node.at)
        case Delayed():
            return replace(node, lag=node.lag + 1.0)
    return node


def _plain(node: Node) -> Node:
    """A switch in the words of the language, which has it as a clamp."""
    if isinstance(node, Call) and node.function == "switch" and len(node.parts) == 1:
        bounds = (Number(value=0.0, at=node.at), Number(value=1.0, at=node.at))
        return Call(function="clamp", arguments=(*node.parts, *bounds), at=node.at)
    return node


def _without_memory(node: Node, name: str, text: str) -> Node:
    """A relay, a latch or a value that is held, by what the output was a sample ago."""
    if not isinstance(node, Call) or node.function not in _REMEMBER:
        return node
    names = OWN[node.function].arguments
    if node.function == "relay" and len(node.parts) > len(names):
        names = (*names, "slope")
    given = dict(zip(names, node.arguments, strict=False)) | dict(node.options)
    if len(node.parts) != len(names) or set(given) != set(names):
        raise equation_error(
            f"{node.function} has other arguments",
            text,
            node.at,
            expected=OWN[node.function].says + ("; or with a slope" if node.function == "relay" else ""),
            remedy="give each of them once",
        )
    before = Delayed(name=name, lag=1.0, seconds=False, at=node.at)

    def operation(operator: str, left: Node, right: Node) -> Node:
        return Operation(operator=operator, operands=(left, right), at=node.at)

    def where(condition: Node, yes: Node, no: Node) -> Node:
        return Call(function="where", arguments=(condition, yes, no), at=node.at)

    one = Number(value=1.0, at=node.at)
    if "slope" in given:  # what fixed_members says of a Schmitt trigger, of on and off that are no numbers
        half = Number(value=0.5, at=node.at)
        middle = operation("*", half, operation("+", given["on"], given["off"]))
        memory = operation("+", one, operation("*", given["slope"], operation("-", given["on"], given["off"])))
        moved = operation("*", given["slope"], operation("-", given["x"], middle))
        return operation("+", operation("+", half, moved), operation("*", memory, operation("-", before, half)))
    if node.function == "hold":
        return where(given["when"], given["x"], before)
    if node.function == "latch":
        return where(given["set"], one, operation("*", operation("-", one, given["reset"]), before))
    on, off = (operation(sign, given["x"], given[at]) for sign, at in ((">", "on"), (">=", "off")))
    return where(on, one, operation("*", off, before))


def _check(right: Node, name: str, text: str) -> None:
    """Refuse what a fixed submodel cannot have."""
    for node in nodes_of(right):
        if isinstance(node, Call) and node.function in OWN:
            fitted = node.function == "net"
            raise equation_error(
                f"{node.function} within the equation of a fixed submodel",
                text,
                node.at,
                expected="what has neither weights nor a memory of its own",
                remedy="fit a member for it, and read what it puts out" if fitted
                else f"write a delay in samples, as in {name}[k-5]" if node.function == "delay"
                else "give it a name in an equation of its own, and read that",
            )  # fmt: skip
        if isinstance(node, Delayed) and node.seconds:
            raise equation_error(
                "a delay in seconds in the equation of a fixed submodel",
                text,
                node.at,
                expected=f"a delay in samples, {node.name}[k-5]",
                remedy="count it in samples",
            )
        if (isinstance(node, Name) or (isinstance(node, Delayed) and not node.lag)) and node.name == name:
            raise equation_error(
                f"{name} reads itself now",
                text,
                node.at,
                expected=f"an earlier value, {name}[k-1]",
                remedy="write it so",
            )
