"""Equations as a tree: what the parser makes of text, and nothing is ever evaluated to make it.

Each node remembers where it stands in the text, so that whatever is wrong with it later can be shown there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sysid.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Node:
    """A part of an expression.

    Args:
        at: Where it begins in the text, in characters.
    """

    at: int

    @property
    def parts(self) -> tuple[Node, ...]:
        """The nodes that it is made of."""
        return ()


@dataclass(frozen=True, kw_only=True)
class Number(Node):
    """A number.

    Args:
        value: Its value.
    """

    value: float


@dataclass(frozen=True, kw_only=True)
class Name(Node):
    """An input, a state, a parameter or a definition, now.

    Args:
        name: Which.
    """

    name: str


@dataclass(frozen=True, kw_only=True)
class Delayed(Node):
    """The same some time ago.

    Args:
        name: Which.
        lag: How long ago, from 0 on.
        seconds: Whether the lag is in seconds; in samples otherwise.
    """

    name: str
    lag: float
    seconds: bool


@dataclass(frozen=True, kw_only=True)
class Call(Node):
    """A function of expressions.

    Args:
        function: Its name.
        arguments: What it is applied to, in order.
        options: Those that are given by name.
    """

    function: str
    arguments: tuple[Node, ...]
    options: tuple[tuple[str, Node], ...] = ()

    @property
    def parts(self) -> tuple[Node, ...]:
        """Arguments, then options."""
        return (*self.arguments, *(value for _, value in self.options))


@dataclass(frozen=True, kw_only=True)
class Operation(Node):
    """An operator between expressions, or before one.

    Args:
        operator: As it is written.
        operands: One or two.
    """

    operator: str
    operands: tuple[Node, ...]

    @property
    def parts(self) -> tuple[Node, ...]:
        """The operands."""
        return self.operands


CONTINUOUS, DISCRETE, DEFINITION = "d/dt", "[k+1]", "="
"""Kinds of equations: what a state's rate is, what a state is at the next sample, and what something is now."""


@dataclass(frozen=True, kw_only=True)
class Equation:
    """One equation.

    Args:
        kind: Which of the three.
        name: What stands on its left.
        right: Its right side.
        at: Where it begins in the text, in characters.
    """

    kind: str
    name: str
    right: Node
    at: int


def nodes_of(node: Node) -> Iterator[Node]:
    """A node and all that it is made of.

    Args:
        node: The node.

    Yields:
        Every node of the tree, the root first.
    """
    waiting = [node]
    while waiting:
        one = waiting.pop()
        yield one
        waiting.extend(one.parts)


def equation_error(
    what: str, text: str, at: int, *, expected: str | None = None, got: str | None = None, remedy: str
) -> ConfigError:
    """What is wrong at some place of the text.

    Args:
        what: What went wrong.
        text: All equations.
        at: Where, in characters.
        expected: What would have been accepted.
        got: What came instead; the line with a mark under the place by default.
        remedy: What the reader can do now.

    Returns:
        The error.
    """
    line = text.count("\n", 0, at)
    begin = text.rfind("\n", 0, at) + 1
    shown = text[begin:].split("\n", 1)[0]
    column = at - begin
    cut = max(0, column - 50)
    mark = f"{shown[cut : cut + 100]}\n            {' ' * (column - cut)}^"
    return ConfigError(
        what,
        where=f"equations, line {line + 1}, column {column + 1}",
        expected=expected,
        got=mark if got is None else f"{got} in {shown[cut : cut + 100].strip()}",
        remedy=remedy,
    )
