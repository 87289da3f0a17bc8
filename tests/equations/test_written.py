"""Trees as text: read again they are the same trees."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.equations.parser import parse
from sysid.equations.syntax import Call, Delayed, Name, Node, Number, Operation
from sysid.equations.written import renamed, rewritten, written
from tests.equations.test_parser import written as bracketed


def operation(operator: str, *operands: Node) -> Operation:
    return Operation(operator=operator, operands=operands, at=0)


NAMES = st.sampled_from(["a", "BP10", "P 1", "dt"])
LEAVES = st.one_of(
    st.floats(0.0, 1e9).map(lambda value: Number(value=value, at=0)),
    NAMES.map(lambda name: Name(name=name, at=0)),
    st.builds(Delayed, name=NAMES, lag=st.integers(0, 30).map(float), seconds=st.just(False), at=st.just(0)),
    st.builds(Delayed, name=NAMES, lag=st.floats(0.0, 9.0), seconds=st.just(True), at=st.just(0)),
)
TREES = st.recursive(
    LEAVES,
    lambda inside: st.one_of(
        st.builds(operation, st.sampled_from(["-", "not"]), inside),
        st.builds(operation, st.sampled_from(["+", "-", "*", "/", "^", "<", ">=", "and", "or"]), inside, inside),
        st.builds(lambda a, b: Call(function="max", arguments=(a, b), options=(("c", a),), at=0), inside, inside),
    ),
    max_leaves=8,
)


@given(TREES)
def test_what_is_written_is_read_as_the_same_tree(tree):
    (again,) = parse(f"y = {written(tree)}")
    assert bracketed(again.right) == bracketed(tree)


@pytest.mark.parametrize(
    "text", ["a - (b - c)", "(a^b)^c", "a^b^-c", "-(a * b)", "(-a)^2", "not (a or b) and c", "(a + b) * c / (d / e)"]
)
def test_brackets_stand_where_they_are_needed(text):
    (one,) = parse(f"y = {text}")
    assert bracketed(parse(f"y = {written(one.right)}")[0].right) == bracketed(one.right)
    assert written(one.right).count("(") <= text.count("(") + 1


def test_a_sum_of_thousands_of_terms_is_written_and_changed():
    text = " + ".join(["a"] * 3_000)
    (one,) = parse(f"y = {text}")
    assert written(rewritten(one.right, lambda node: node)) == text


def test_names_change_on_both_sides_and_parameters_stay():
    text = "x[k+1] = k*x + u(t - 0.5); dz/dt = -z[k-1]; y = max(x, 2)"
    assert renamed(parse(text), {"x": "dt", "u": "u 2", "z": "w"}).splitlines() == [
        '"dt"[k+1] = k * "dt" + "u 2"(t - 0.5)', "der(w) = -w[k-1]", 'y = max("dt", 2)',
    ]  # fmt: skip
