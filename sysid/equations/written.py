"""Expression trees as text, and the same trees over other names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Dict
from dataclasses import replace

from sysid.equations.parser import BINDING
from sysid.equations.syntax import CONTINUOUS, DISCRETE, Call, Delayed, Equation, Name, Node, Number, Operation
from sysid.equations.system import written_name

_UNARY = 0
"""What a sign binds as a part of something else: less than anything, so that it gets brackets."""
_POWER = "^"


def written(node: Node) -> str:
    """An expression as text.

    Args:
        node: The expression.

    Returns:
        Text that is read as the same expression.

    Example:
        >>> from sysid.equations.parser import parse
        >>> written(parse("y = ((a - (b - 2))) * max(u[k-1], -x^2)")[0].right)
        '(a - (b - 2)) * max(u[k-1], -x^2)'
    """
    match node:
        case Number():
            return repr(node.value).removesuffix(".0")
        case Name():
            return written_name(node.name)
        case Delayed(seconds=True):
            return f"{written_name(node.name)}(t - {node.lag!r})"
        case Delayed():
            return f"{written_name(node.name)}[k-{int(node.lag)}]" if node.lag else f"{written_name(node.name)}[k]"
        case Call():
            named = [f"{name}={written(value)}" for name, value in node.options]
            return f"{node.function}({', '.join([*map(written, node.arguments), *named])})"
    assert isinstance(node, Operation)  # noqa: S101 - there is no other node
    if len(node.operands) == 1:
        inside = _bracketed(node.operands[0], BINDING["*"] if node.operator == "-" else BINDING["and"])
        return f"-{inside}" if node.operator == "-" else f"not {inside}"
    # A sum of a thousand terms leans to the left: it is walked down, not gone into.
    parts: list[str] = []
    left: Node = node
    while isinstance(left, Operation) and len(left.operands) == 2 and (left is node or _goes_on(left, node)):
        node, (left, right) = left, left.operands
        spaced = node.operator if node.operator == _POWER else f" {node.operator} "
        parts.append(spaced + _bracketed(right, BINDING[node.operator] - (node.operator == _POWER)))
    return _bracketed(left, BINDING[node.operator]) + "".join(reversed(parts))


def _goes_on(left: Operation, above: Operation) -> bool:
    """Whether an operation needs no brackets to be done before the one that it stands left of."""
    ours, theirs = BINDING[left.operator], BINDING[above.operator]
    leans = above.operator != _POWER and theirs != BINDING["<"]
    return ours > theirs or (ours == theirs and leans)


def _bracketed(node: Node, binding: int) -> str:
    """A part of an operation, in brackets where it binds no more than this."""
    if not isinstance(node, Operation):
        return written(node)
    own = _UNARY if len(node.operands) == 1 else BINDING[node.operator]
    return written(node) if own > binding else f"({written(node)})"


def rewritten(node: Node, change: Callable[[Node], Node]) -> Node:
    """An expression with every part changed, those inside first.

    Args:
        node: The expression.
        change: What becomes of a part.

    Returns:
        The other one.
    """
    match node:
        case Call():
            options = tuple((name, rewritten(value, change)) for name, value in node.options)
            node = replace(node, arguments=tuple(rewritten(one, change) for one in node.arguments), options=options)
        case Operation():
            return _rewritten_operation(node, change)
    return change(node)


def _rewritten_operation(node: Operation, change: Callable[[Node], Node]) -> Node:
    """The same of an operation: what leans to the left is walked up, not gone into."""
    spine, left = [node], node.operands[0]
    while isinstance(left, Operation):
        spine.append(left)
        left = left.operands[0]
    found = rewritten(left, change)
    for one in reversed(spine):
        found = change(replace(one, operands=(found, *(rewritten(other, change) for other in one.operands[1:]))))
    return found


def renamed(equations: Sequence[Equation], names: Dict[str, str]) -> str:
    r"""Equations over other names.

    Args:
        equations: The equations.
        names: Other names by name; what is not among them keeps its own.

    Returns:
        Their text, one a line.

    Example:
        >>> from sysid.equations.parser import parse
        >>> renamed(parse("x[k+1] = 0.5*x + u; y = x"), {"u": "u 2", "x": "z"})
        'z[k+1] = 0.5 * z + "u 2"\ny = z'
    """

    def change(node: Node) -> Node:
        return replace(node, name=names.get(node.name, node.name)) if isinstance(node, Name | Delayed) else node

    lines = []
    for one in equations:
        name = written_name(names.get(one.name, one.name))
        left = {DISCRETE: f"{name}[k+1]", CONTINUOUS: f"der({name})"}.get(one.kind, name)
        lines.append(f"{left} = {written(rewritten(one.right, change))}")
    return "\n".join(lines)
