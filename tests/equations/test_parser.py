"""What the language reads, and what it says of what it does not."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.equations.parser import DEEPEST, parse
from sysid.equations.syntax import Call, Delayed, Equation, Name, Node, Number, Operation
from sysid.errors import ConfigError


def written(node: Node) -> str:
    """A tree with all its brackets."""
    if isinstance(node, Number):
        return f"{node.value:g}"
    if isinstance(node, Name):
        return node.name
    if isinstance(node, Delayed):
        return f"{node.name}@{node.lag:g}{'s' * node.seconds}"
    if isinstance(node, Call):
        options = [f"{name}={written(value)}" for name, value in node.options]
        return f"{node.function}({','.join([*map(written, node.arguments), *options])})"
    assert isinstance(node, Operation)
    parts = [written(one) for one in node.operands]
    return f"({node.operator}{parts[0]})" if len(parts) == 1 else f"({parts[0]}{node.operator}{parts[1]})"


def one(text: str) -> Equation:
    (equation,) = parse(text)
    return equation


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("a + b*c", "(a+(b*c))"),
        ("a - b - c", "((a-b)-c)"),
        ("a/b/c", "((a/b)/c)"),
        ("-a^2", "(-(a^2))"),
        ("2^-a", "(2^(-a))"),
        ("a^b^c", "(a^(b^c))"),
        ("a**2", "(a^2)"),
        ("-a*b", "((-a)*b)"),
        ("not a > b and c or d", "(((not(a>b))andc)ord)"),
        ("a + b < c * 2", "((a+b)<(c*2))"),
        ("f(x, u; n=8)", "f(x,u,n=8)"),
        ("u(t - 0.5) + u(t)", "(u@0.5s+u)"),
        ("x[k] + x[k-3]", "(x@0+x@3)"),
        ("1.5e-3 * .5", "(0.0015*0.5)"),
        ('"P 1" - T_ü', "(P 1-T_ü)"),
    ],
)
def test_operators_bind_as_they_do_in_mathematics(text: str, tree: str) -> None:
    assert written(one(f"y = {text}").right) == tree


@pytest.mark.parametrize(
    ("text", "kind", "name"),
    [
        ("dx1/dt = 0", "d/dt", "x1"),
        ("der(x1) = 0", "d/dt", "x1"),
        ('der("x 1") = 0', "d/dt", "x 1"),
        ('d"x 1"/dt = 0', "d/dt", "x 1"),
        ("x[k+1] = 0", "[k+1]", "x"),
        ("y = 0", "=", "y"),
        ("y[k] = 0", "=", "y"),
        ("y(t) = 0", "=", "y"),
        ("dx = 0", "=", "dx"),
    ],
)
def test_left_sides_are_rates_next_samples_and_definitions(text: str, kind: str, name: str) -> None:
    assert (one(text).kind, one(text).name) == (kind, name)


def test_equations_stand_on_lines_that_are_over_and_remarks_are_nothing() -> None:
    text = "# a tank\na = (1 +\n 2) # three\n\nb = 1 +\n   2; c = f(1,\n 2; n=3)\n"
    assert [equation.name for equation in parse(text)] == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("text", "words", "column"),
    [
        ("y = 2x", "'x' does not go on", 6),
        ("y = a +", "the equation ends", 8),
        ("y = (a + b", "the end of the equation where '\\)'", 11),
        ("y = a $ b", "'\\$' is no sign", 7),
        ("y = a == b", "== between real numbers", 7),
        ("y = a < b < c", "two comparisons in a row", 11),
        ("y = x[k+1]", "a sample that is not there yet", 5),
        ("y = x[n-1]", "an index is a sample", 7),
        ("y = u(t - tau)", "a delay is a number of seconds", 11),
        ("y = u(t + 1)", "a delay is a number of seconds", 9),
        ("y = t", "'t' stands where a value belongs", 5),
        ("y = sin(t)", "'t' stands where a value belongs", 9),
        ("y = exp(t - 5)", "'t' stands where a value belongs", 9),
        ("x[k+2] = 1", "a left side is now or the next sample", 1),
        ("2 = y", "does not begin so", 1),
        ("y 2", "'2' where '=' belongs", 3),
        ("y = f(n=1, 2)", "an argument after an option", 12),
        ("y = f(1 2)", "the arguments of f do not end", 9),
        ("y = 1e999", "too large", 5),
        ("y = __import__('os')", "no sign", 16),
        ("y = a.b", "'.b' does|'\\.' is no sign", 6),
    ],
)
def test_what_is_wrong_is_told_with_its_place(text: str, words: str, column: int) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        parse(text)
    assert str(caught.value.where) == f"equations, line 1, column {column}"
    assert caught.value.remedy


def test_the_place_counts_lines() -> None:
    with pytest.raises(ConfigError) as caught:
        parse("a = 1\n\n  b = +*2")
    assert caught.value.where == "equations, line 3, column 8"
    assert str(caught.value.got).splitlines()[0] == "  b = +*2"


@pytest.mark.parametrize("text", ["(" * 500 + "1" + ")" * 500, "-" * 3_000 + "1", "1" + "^1" * 2_000, "f(" * 900])
def test_what_is_too_deep_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="too deep") as caught:
        parse(f"y = {text}")
    assert str(DEEPEST) in str(caught.value.expected)


def test_what_is_too_long_is_refused() -> None:
    with pytest.raises(ConfigError, match="too long"):
        parse("y = 1" + " + 1" * 6_000)
    with pytest.raises(ConfigError, match="there is no equation"):
        parse("  # nothing\n")


TOKENS = st.lists(
    st.sampled_from(
        ["x", "u", "1", "2.5", "+", "-", "*", "/", "^", "(", ")", "[", "]", "=", ",", ";", "\n", "k", "t", "dx", "/dt",
         "dt", "and", "not", "<", ">=", "sqrt", "net", '"a b"', "#", "der", "where"]
    ),
    max_size=25,
)  # fmt: skip


@given(st.one_of(st.text(max_size=60), TOKENS.map(" ".join), TOKENS.map(lambda words: "y = " + " ".join(words))))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        parse(text)
    except ConfigError as error:
        assert error.remedy
