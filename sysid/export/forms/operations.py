"""What each operation of a grey box's programs is in every target: a row an operation, and no other place.

Switches are exact here: soft forms are for training. Numbers that are not numbers go through as they do in the register
machine (:mod:`sysid.kernels.register_machine`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Protocol

from sysid.kernels import register_machine as machine

Points = tuple[tuple[float, float], ...]
"""Of a table."""


class Graph(Protocol):
    """What of an ONNX graph under construction an operation needs."""

    def add(self, operator: str, inputs: Sequence[str], output: str, **attributes: Any) -> str:
        """Add a node with one output, whose name it gives back."""

    def numbers(self, name: str, values: Any) -> str:
        """Add a constant of the graph's number type, whose name it gives back."""

    def integers(self, values: Any) -> str:
        """Add an index constant, whose name it gives back."""

    def kind(self) -> int:
        """The graph's number type, as ONNX counts them."""


@dataclass(frozen=True, kw_only=True)
class Operation:
    """An operation over up to three numbers.

    Args:
        c: A C expression of ``{a}``, ``{b}``, ``{c}``; numbers as ``R(1.0)``, functions of libm as ``M(exp)``.
        slopes: Its partial derivatives by each of them, as C expressions of these and of the result ``{r}``; ``""`` for
            none.
        onnx: Adds its nodes to a graph, from a name for what comes out and the names of what it reads.
        torch: The same on tensors and numbers, given the module torch; what comes out is a tensor.
        casadi: The same on CasADi's expressions, given its module.
        jax: The same on JAX's numbers, given the module ``jax.numpy``.
        matlab: A MATLAB expression of scalars; C's where it is the same. Functions that MATLAB has not, or has
            otherwise for what is not a number, are those of ``templates/functions.m.j2``.
        st: An expression of Structured Text; C's where it is the same. Functions in braces are those of
            ``templates/functions.st.j2``.
    """

    c: str
    slopes: tuple[str, ...]
    onnx: Callable[..., str]
    torch: Callable[..., Any]
    casadi: Callable[..., Any]
    jax: Callable[..., Any]
    matlab: str = ""
    st: str = ""

    def __post_init__(self) -> None:
        """Fill in what is the same as in C."""
        object.__setattr__(self, "matlab", self.matlab or self.c)
        object.__setattr__(self, "st", self.st or self.c)


def _node(operator: str) -> Callable[..., str]:
    return lambda graph, name, *reads: graph.add(operator, reads, name)


def _fma_nodes(graph: Graph, name: str, a: str, b: str, c: str) -> str:
    return graph.add("Add", [graph.add("Mul", [a, b], f"{name}_product"), c], name)


def _number(graph: Graph, truth: str, name: str) -> str:
    return graph.add("Cast", [truth], name, to=graph.kind())


def _switch_nodes(operator: str) -> Callable[..., str]:
    def nodes(graph: Graph, name: str, a: str) -> str:
        return _number(graph, graph.add(operator, [a, graph.numbers("zero", 0.0)], f"{name}_holds"), name)

    return nodes


def _sign_nodes(graph: Graph, name: str, a: str) -> str:
    above, below = (_switch_nodes(one)(graph, f"{name}_{one}", a) for one in ("Greater", "Less"))
    return graph.add("Sub", [above, below], name)


def _root_nodes(graph: Graph, name: str, a: str) -> str:
    zero = graph.numbers("zero", 0.0)
    below = graph.add("LessOrEqual", [a, zero], f"{name}_below")
    return graph.add("Sqrt", [graph.add("Where", [below, zero, a], f"{name}_held")], name)


def _select_nodes(graph: Graph, name: str, a: str, b: str, c: str) -> str:
    between = graph.add("Mul", [a, graph.add("Sub", [b, c], f"{name}_step")], f"{name}_share")
    between = graph.add("Add", [c, between], f"{name}_between")
    low = graph.add("LessOrEqual", [a, graph.numbers("zero", 0.0)], f"{name}_low")
    high = graph.add("GreaterOrEqual", [a, graph.numbers("one", 1.0)], f"{name}_high")
    return graph.add("Where", [high, b, graph.add("Where", [low, c, between], f"{name}_not_high")], name)


def _least_nodes(operator: str) -> Callable[..., str]:
    """The least or the greatest; what is not a number on either side stays so."""

    def nodes(graph: Graph, name: str, a: str, b: str) -> str:
        first = graph.add(operator, [a, b], f"{name}_first")
        first = graph.add("Or", [first, graph.add("IsNaN", [a], f"{name}_lost")], f"{name}_is_first")
        return graph.add("Where", [first, a, b], name)

    return nodes


def _table_nodes(graph: Graph, name: str, a: str, points: Points) -> str:
    """A piece by comparing with the points between; then its line, of the argument held between the ends."""
    x, y, slopes = pieces(points)
    ends = [graph.numbers(f"{name}_{side}", at) for side, at in (("low", points[0][0]), ("high", points[-1][0]))]
    held = graph.add("Clip", [a, *ends], f"{name}_held")
    at = graph.numbers(f"{name}_between", [[one] for one in x[1:]] or [[float("inf")]])
    behind = _number(graph, graph.add("GreaterOrEqual", [held, at], f"{name}_behind"), f"{name}_counted")
    count = graph.add("ReduceSum", [behind, graph.integers([0])], f"{name}_count", keepdims=1)
    piece = graph.add("Cast", [count], f"{name}_piece", to=_INT64)
    begin, level, slope = (
        graph.add("Gather", [graph.numbers(f"{name}_{what}", values), piece], f"{name}_own_{what}", axis=0)
        for what, values in (("x", x), ("y", y), ("slope", slopes))
    )
    moved = graph.add("Mul", [slope, graph.add("Sub", [held, begin], f"{name}_along")], f"{name}_rise")
    return graph.add("Add", [level, moved], name)


_ATAN = (
    (-8.750608600031904122785e-1, -1.615753718733365076637e1, -7.500855792314704667340e1, -1.228866684490136173410e2,
     -6.485021904942025371773e1),
    (1.0, 2.485846490142306297962e1, 1.650270098316988542046e2, 4.328810604912902668951e2, 4.853903996359136964868e2,
     1.945506571482613964425e2),
)  # fmt: skip
"""``atan x = x + x z P(z)/Q(z)`` with ``z = x^2`` up to 0.66 (Cephes, ``atan.c``, Moshier 1989)."""


def _atan_nodes(graph: Graph, name: str, a: str) -> str:
    """By itself: onnxruntime has no arc tangent in float64."""

    def add(operator: str, *reads: str | float, to: str) -> str:
        named = [one if isinstance(one, str) else graph.numbers(f"{name}_{to}_number{i}", one) for i, one in
                 enumerate(reads)]  # fmt: skip
        return graph.add(operator, named, f"{name}_{to}")

    size = add("Abs", a, to="size")
    far, middle = add("Greater", size, math.tan(3.0 * math.pi / 8.0), to="far"), add("Greater", size, 0.66, to="middle")
    turned = add("Div", add("Sub", size, 1.0, to="less"), add("Add", size, 1.0, to="more"), to="turned")
    x = add("Where", far, add("Div", -1.0, size, to="over"), add("Where", middle, turned, size, to="near"), to="x")
    begun = add("Where", far, math.pi / 2.0, add("Where", middle, math.pi / 4.0, 0.0, to="quarter"), to="begun")
    z, sums = add("Mul", x, x, to="z"), []
    for which, (first, *others) in zip("PQ", _ATAN, strict=True):
        total: str | float = first
        for i, one in enumerate(others):
            total = add("Add", add("Mul", total, z, to=f"{which}{i}_grown"), one, to=f"{which}{i}")
        sums.append(total)
    ratio = add("Mul", z, add("Div", *sums, to="ratio"), to="share")
    found = add("Add", begun, add("Add", x, add("Mul", x, ratio, to="rest"), to="angle"), to="whole")
    return graph.add("Mul", [add("Sign", a, to="sign"), found], name)


_INT64 = 7
"""``TensorProto.INT64``."""


def pieces(points: Points) -> tuple[list[float], list[float], list[float]]:
    """Where each piece of a table begins, and its slope."""
    ahead = list(pairwise(points))
    slopes = [(after[1] - before[1]) / (after[0] - before[0]) for before, after in ahead]
    return [before[0] for before, _ in ahead], [before[1] for before, _ in ahead], slopes


def _truth(torch: Any, truth: Any, like: Any) -> Any:
    return torch.where(truth, torch.ones_like(like), torch.zeros_like(like))


def _whole(torch: Any, *values: Any) -> list[Any]:
    """Tensors all, where one at least is."""
    like = next(one for one in values if torch.is_tensor(one))
    return [one if torch.is_tensor(one) else torch.full_like(like, one) for one in values]


def _power_torch(torch: Any, a: Any, b: Any) -> Any:
    return torch.pow(*_whole(torch, a, b))


def _select_torch(torch: Any, a: Any, b: Any, c: Any) -> Any:
    a, b, c = _whole(torch, a, b, c)
    return torch.where(a >= 1.0, b, torch.where(a <= 0.0, c, c + a * (b - c)))


def _table_torch(torch: Any, a: Any, points: Points) -> Any:
    x, y, slopes = (torch.tensor(one, dtype=a.dtype, device=a.device) for one in pieces(points))
    held = torch.clamp(a, points[0][0], points[-1][0])
    piece = (held.unsqueeze(-1) >= x[1:]).sum(dim=-1)
    return y[piece] + slopes[piece] * (held - x[piece])


def _table_casadi(casadi: Any, a: Any, points: Points) -> Any:
    x, y, slopes = pieces(points)
    found: Any = y[0] + slopes[0] * (a - x[0])
    for begin, level, slope in zip(x[1:], y[1:], slopes[1:], strict=True):
        found = casadi.if_else(a >= begin, level + slope * (a - begin), found)
    found = casadi.if_else(a <= points[0][0], points[0][1], found)
    return casadi.if_else(a >= points[-1][0], points[-1][1], found)


def _least_casadi(casadi: Any, a: Any, b: Any, first: Any) -> Any:
    return casadi.if_else(first, a, casadi.if_else(casadi.logic_or(a <= 0, a > 0), b, a))


def _select_casadi(casadi: Any, a: Any, b: Any, c: Any) -> Any:
    return casadi.if_else(a >= 1, b, casadi.if_else(a <= 0, c, c + a * (b - c)))


def _root_jax(jnp: Any, a: Any) -> Any:
    """A root of 1 where it is not asked for: that of 0 has no derivative."""
    return jnp.where(a <= 0.0, 0.0, jnp.sqrt(jnp.where(a <= 0.0, 1.0, a)))


def _select_jax(jnp: Any, a: Any, b: Any, c: Any) -> Any:
    return jnp.where(a >= 1.0, b, jnp.where(a <= 0.0, c, c + a * (b - c)))


def _table_jax(jnp: Any, a: Any, points: Points) -> Any:
    x, y, slopes = (jnp.asarray(one) for one in pieces(points))
    held = jnp.clip(a, points[0][0], points[-1][0])
    piece = jnp.sum(held >= x[1:])
    return y[piece] + slopes[piece] * (held - x[piece])


def _same(name: str) -> Callable[..., Any]:
    """A function that a library has by this name."""
    return lambda library, *reads: getattr(library, name)(*reads)


def _plain(operator: Callable[..., Any]) -> Callable[..., Any]:
    """What Python's own operators do, on numbers of any library."""
    return lambda _, *reads: operator(*reads)


def _everywhere(operator: Callable[..., Any]) -> dict[str, Any]:
    """The same by the operators of Python in every library that has them."""
    return dict.fromkeys(("torch", "casadi", "jax"), _plain(operator))


_MIN_C = "({a} <= {b} || {a} != {a} ? {a} : {b})"
_FIRST = ("({a} %s {b} ? R(1.0) : R(0.0))", "({a} %s {b} ? R(0.0) : R(1.0))")


def _elementary(
    name: str,
    slope: str,
    *,
    c: str = "",
    onnx: str = "",
    torch: str = "",
    jax: str = "",
    matlab: str = "",
    st: str = "",
) -> Operation:
    """A function of one number that every target has."""
    return Operation(
        c=c or f"M({name})({{a}})",
        slopes=(slope,),
        onnx=_node(onnx or name.title()),
        torch=_same(torch or name),
        casadi=_same(name),
        jax=_same(jax or torch or name),
        matlab=f"{matlab or name}({{a}})",
        st=f"{st or name.upper()}({{a}})",
    )


OPERATIONS: dict[int, Operation] = {
    machine.ADD: Operation(
        c="{a} + {b}", slopes=("R(1.0)", "R(1.0)"), onnx=_node("Add"),
        **_everywhere(lambda a, b: a + b),
    ),
    machine.SUB: Operation(
        c="{a} - {b}", slopes=("R(1.0)", "R(-1.0)"), onnx=_node("Sub"),
        **_everywhere(lambda a, b: a - b),
    ),
    machine.MUL: Operation(
        c="{a} * {b}", slopes=("{b}", "{a}"), onnx=_node("Mul"),
        **_everywhere(lambda a, b: a * b),
    ),
    machine.DIV: Operation(
        c="{a} / {b}", slopes=("R(1.0) / {b}", "-{r} / {b}"), onnx=_node("Div"),
        **_everywhere(lambda a, b: a / b),
    ),
    machine.NEG: Operation(
        c="-{a}", slopes=("R(-1.0)",), onnx=_node("Neg"), **_everywhere(lambda a: -a)
    ),
    machine.POW: Operation(
        c="M(pow)({a}, {b})",
        slopes=(
            "({b} != R(0.0) ? {b} * M(pow)({a}, {b} - R(1.0)) : R(0.0))",
            "({a} > R(0.0) ? {r} * M(log)({a}) : R(0.0))",
        ),
        onnx=_node("Pow"), torch=_power_torch, casadi=_plain(lambda a, b: a**b),
        jax=_plain(lambda a, b: a**b), matlab="power_of({a}, {b})", st="EXPT({a}, {b})",
    ),
    machine.FMA: Operation(
        c="{a} * {b} + {c}", slopes=("{b}", "{a}", "R(1.0)"), onnx=_fma_nodes,
        **_everywhere(lambda a, b, c: a * b + c),
    ),
    machine.ABS: _elementary(
        "fabs", "({a} > R(0.0) ? R(1.0) : {a} < R(0.0) ? R(-1.0) : R(0.0))", onnx="Abs", torch="abs",
        matlab="abs", st="ABS",
    ),
    machine.MIN: Operation(
        c=_MIN_C, slopes=tuple(one % "<=" for one in _FIRST), onnx=_least_nodes("LessOrEqual"),
        torch=lambda torch, a, b: torch.minimum(*_whole(torch, a, b)),
        casadi=lambda casadi, a, b: _least_casadi(casadi, a, b, a <= b), jax=_same("minimum"),
        matlab="least({a}, {b})", st="{least}({a}, {b})",
    ),
    machine.MAX: Operation(
        c=_MIN_C.replace("<=", ">="), slopes=tuple(one % ">=" for one in _FIRST), onnx=_least_nodes("GreaterOrEqual"),
        torch=lambda torch, a, b: torch.maximum(*_whole(torch, a, b)),
        casadi=lambda casadi, a, b: _least_casadi(casadi, a, b, a >= b), jax=_same("maximum"),
        matlab="greatest({a}, {b})", st="{greatest}({a}, {b})",
    ),
    machine.SQRT: Operation(
        c="({a} <= R(0.0) ? R(0.0) : M(sqrt)({a}))", slopes=("({r} > R(0.0) ? R(0.5) / {r} : R(0.0))",),
        onnx=_root_nodes,
        # A root of 1 where it is not asked for: that of 0 has no derivative.
        torch=lambda torch, a: torch.where(
            a <= 0.0, torch.zeros_like(a), torch.sqrt(torch.where(a <= 0.0, torch.ones_like(a), a))
        ),
        casadi=lambda casadi, a: casadi.if_else(a <= 0, 0, casadi.sqrt(casadi.if_else(a <= 0, 1, a))),
        jax=_root_jax, matlab="root({a})", st="{root}({a})",
    ),
    machine.EXP: _elementary("exp", "{r}"),
    machine.LOG: _elementary("log", "R(1.0) / {a}", matlab="logarithm", st="LN"),
    machine.TANH: _elementary("tanh", "R(1.0) - {r} * {r}", c="tanh_neuron({a})", st="{tanh}"),
    machine.SIN: _elementary("sin", "M(cos)({a})"),
    machine.COS: _elementary("cos", "-M(sin)({a})"),
    machine.ATAN: replace(_elementary("atan", "R(1.0) / (R(1.0) + {a} * {a})", jax="arctan"), onnx=_atan_nodes),
    machine.SIGN: Operation(
        c="({a} > R(0.0) ? R(1.0) : {a} < R(0.0) ? R(-1.0) : R(0.0))", slopes=("",), onnx=_sign_nodes,
        torch=lambda torch, a: _truth(torch, a > 0.0, a) - _truth(torch, a < 0.0, a),
        casadi=lambda casadi, a: casadi.if_else(a > 0, 1, casadi.if_else(a < 0, -1, 0)),
        jax=lambda jnp, a: jnp.where(a > 0.0, 1.0, jnp.where(a < 0.0, -1.0, 0.0)),
        matlab="(double({a} > 0) - double({a} < 0))", st="{sign}({a})",
    ),
    machine.GREATER: Operation(
        c="({a} > R(0.0) ? R(1.0) : R(0.0))", slopes=("",), onnx=_switch_nodes("Greater"),
        torch=lambda torch, a: _truth(torch, a > 0.0, a), casadi=lambda casadi, a: casadi.if_else(a > 0, 1, 0),
        jax=lambda jnp, a: jnp.where(a > 0.0, 1.0, 0.0), matlab="double({a} > 0)", st="{above}({a})",
    ),
    machine.NOT_LESS: Operation(
        c="({a} >= R(0.0) ? R(1.0) : R(0.0))", slopes=("",), onnx=_switch_nodes("GreaterOrEqual"),
        torch=lambda torch, a: _truth(torch, a >= 0.0, a), casadi=lambda casadi, a: casadi.if_else(a >= 0, 1, 0),
        jax=lambda jnp, a: jnp.where(a >= 0.0, 1.0, 0.0), matlab="double({a} >= 0)", st="{not_below}({a})",
    ),
    machine.SELECT: Operation(
        c="({a} >= R(1.0) ? {b} : {a} <= R(0.0) ? {c} : {c} + {a} * ({b} - {c}))",
        slopes=(
            "({a} >= R(1.0) || {a} <= R(0.0) ? R(0.0) : {b} - {c})",
            "({a} >= R(1.0) ? R(1.0) : {a} <= R(0.0) ? R(0.0) : {a})",
            "({a} >= R(1.0) ? R(0.0) : {a} <= R(0.0) ? R(1.0) : R(1.0) - {a})",
        ),
        onnx=_select_nodes, torch=_select_torch, casadi=_select_casadi, jax=_select_jax,
        matlab="choice({a}, {b}, {c})", st="{choice}({a}, {b}, {c})",
    ),
    machine.TABLE: Operation(
        c="table({a}, {points})", slopes=("table_slope({a}, {points})",), onnx=_table_nodes, torch=_table_torch,
        casadi=_table_casadi, jax=_table_jax, matlab="table_at({a}, {points})", st="{points}({a})",
    ),
}  # fmt: skip
"""By the machine's number."""
