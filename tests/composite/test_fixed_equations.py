"""Fixed submodels as equations: the weights that a sum stands for, any other expression as it is, and what is wrong."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.composite import FixedMember, equation_of, fixed_by_equations, with_fixed
from sysid.composite.fixed.equations import unit_contradictions_of
from sysid.errors import ConfigError
from sysid.models import Mapping, VectorGreyBox, VectorGreyBoxModel, VectorScaling
from sysid.traces import Channel, Trace


def words(one: FixedMember) -> tuple[Any, ...]:
    return one.mapping, one.weights, one.memory, one.constant, one.low, one.high, one.rest, one.unit


@pytest.mark.parametrize(
    ("equation", "mapping", "gains", "constant", "bounds"),
    [
        ("y = 2*a - b", "a+b -> y", {"a": 2, "b": -1}, 0, (-math.inf, math.inf)),
        ("y = clamp(-(a - 3*b)/4 + 1, -2, 1e3)", "a+b -> y", {"a": -0.25, "b": 0.75}, 1, (-2, 1000)),
        ("y = saturate(a, low=-1, high=2*3)", "a -> y", {"a": 1}, 0, (-1, 6)),
        ("y = switch(a + a[k-2] - 0.5)", "a -> y", {"a": {0: 1, 2: 1}}, -0.5, (0, 1)),
        ("y[k+1] = 0.9*y[k] + 0.1*a[k]", "a -> y", {"a": {1: 0.1}, "y": 0.9}, 0, (-math.inf, math.inf)),
        ("y = relay(a, on=1.44, off=-1.01, slope=20)", "a -> y", {"a": 20, "y": 50}, -28.8, (0, 1)),
        ("y = 0.1*a + 0.2*a", "a -> y", {"a": 0.3}, 0, (-math.inf, math.inf)),
        ('y = "P 1"*(2 - 1) + 2*3*a', "P 1+a -> y", {"P 1": 1, "a": 6}, 0, (-math.inf, math.inf)),
        ("y = a + pi", "a -> y", {"a": 1}, math.pi, (-math.inf, math.inf)),
    ],
)  # fmt: skip
def test_an_equation_is_the_weights_that_it_stands_for(equation, mapping, gains, constant, bounds):
    (found,) = fixed_by_equations(equation)
    inputs, output = mapping.split(" -> ")
    expected = FixedMember(
        mapping=Mapping(inputs=tuple(inputs.split("+")), outputs=(output,)),
        gains=gains, constant=constant, low=bounds[0], high=bounds[1], rest=0,
    )  # fmt: skip
    assert words(found) == words(expected)


NUMBERS = st.one_of(st.floats(-1e6, 1e6), st.integers(-200, 200).map(float), st.just(1.0), st.just(-1.0))
LAGS = st.dictionaries(st.integers(0, 20), NUMBERS, min_size=1, max_size=3)


@given(
    st.dictionaries(st.sampled_from(["a", "b", "BP10", "dt", "P 1"]), st.one_of(NUMBERS, LAGS), min_size=1),
    NUMBERS, NUMBERS, st.tuples(st.floats(-1e3, 0), st.floats(1e-3, 1e3)), st.sampled_from(["1", "psi"]),
)  # fmt: skip
def test_what_is_written_is_read_as_the_same(gains, memory, constant, bounds, unit):
    low, high = bounds
    mapping = Mapping(inputs=tuple(gains), outputs=("y",))
    one = FixedMember(
        mapping=mapping, gains={**gains, "y": memory}, constant=constant, low=low, high=high, rest=0, unit=unit
    )
    (found,) = fixed_by_equations(equation_of(one), unit={"y": unit})
    assert words(found) == words(one)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("y = a*b", ["y = a * b"]),
        ("y[k+1] = max(a, 2)/b[k-1]", ["y = max(a[k-1], 2) / b[k-2]"]),
        ("y = clamp(sqrt(a) - b, -2, 5)", ["y = clamp(sqrt(a) - b, -2, 5)"]),
        ("y = clamp(a, b, 1)", ["y = clamp(a, b, 1)"]),
        ("y = curve(a) > switch(b)", ["y = curve(a) > clamp(b, 0, 1)"]),
        ("y = y[k-2] + a", ['"y 2 before" = y[k-2]', 'y = "y 2 before" + a']),
        ("y = min(y[k-1], a)", ['"y before" = y[k-1]', 'y = min("y before", a)']),
        ("y = relay(a, on=2, off=1)", ['"y before" = y[k-1]', 'y = switch(where(a > 2, 1, (a >= 1) * "y before"))']),
        ("y = latch(a > 1, b > 1)", ['"y before" = y[k-1]', 'y = where(a > 1, 1, (1 - (b > 1)) * "y before")']),
        ("y = hold(a, b > 2)", ['"y before" = y[k-1]', 'y = where(b > 2, a, "y before")']),
    ],
)  # fmt: skip
def test_what_is_no_sum_is_an_expression_and_its_past_a_channel(text, written):
    tables = {"curve": [[0, 1], [2, 5]]} if "curve" in text else {}
    found = fixed_by_equations(text, tables=tables)
    assert [equation_of(one) for one in found] == written
    assert fixed_by_equations("\n".join(written), tables=tables) == found


def test_what_remembers_is_what_it_is_in_a_grey_box():
    """A relay, a latch and a value that is held, against the language's own, which have states."""
    text = "r = relay(a, on=0.5, off=-0.5); l = latch(a > 1, b > 1); h = hold(a - b, b > 0)"
    rng = np.random.default_rng(0)
    values = rng.normal(size=(300, 2))
    trace = Trace(name="t", sample_time=0.1, channels=tuple(Channel(name=n, unit="1") for n in "ab"), values=values)
    (seen,) = with_fixed(fixed_by_equations(text), [trace])
    structure = VectorGreyBox(equations=text)
    mapping = Mapping(inputs=("a", "b"), outputs=("r", "l", "h"))
    form = VectorGreyBoxModel(
        grey=structure, theta=np.empty(0), norms=(), levels=(0,) * 3, spans=(1,) * 3, substeps=1, mapping=mapping,
        scaling=VectorScaling(input_offset=(0, 0), input_scale=(1, 1), output_offset=(0,) * 3, output_scale=(1,) * 3),
        sample_time=0.1, input_units=("1", "1"), output_units=("1",) * 3, rest_outputs=(0,) * 3,
    ).recursion  # fmt: skip
    expected = form.run(form.given(values, values[:1]), np.zeros(3))
    assert 0 < expected[:, 0].mean() < 1
    np.testing.assert_array_equal(seen.columns(["r", "l", "h"]), expected)


def test_units_and_rests_are_for_all_or_by_output_and_a_switch_has_no_unit():
    text = "p = clamp(2*a, 0, 9); s = switch(a); r = relay(a, on=2, off=1, slope=5)"
    one = fixed_by_equations(text, unit="psi", rest={"p": 3})
    assert [(each.output, each.unit, each.rest) for each in one] == [("p", "psi", 3), ("s", "1", 0), ("r", "1", 0)]
    other = fixed_by_equations(text, unit={"s": "m"}, rest=1)
    assert [(each.unit, each.rest) for each in other] == [("1", 1), ("m", 1), ("1", 1)]


def test_instances_and_shared_inputs_are_those_of_each_equation():
    one, other = fixed_by_equations("x = a + s; y = 2*a", instances=("", "9"), shared=("s",))
    assert (one.outputs, one.shared, other.shared) == (["x", "x9"], ("s",), ())


def test_a_relay_switches_where_it_says():
    """Up above ``on``, down below ``off``, to within the slope; between them as it was."""
    (relay,) = fixed_by_equations("r = relay(a, on=2, off=-1, slope=100)")
    values = np.concatenate([np.linspace(-3, 1.98, 40), np.full(3, 2.01), np.linspace(2, -0.98, 40), np.full(3, -1.01)])
    trace = Trace(name="t", sample_time=0.1, channels=(Channel(name="a", unit="1"),), values=values[:, None])
    (seen,) = with_fixed([relay], [trace])
    assert (seen["r"] > 0.5).tolist() == [False] * 40 + [True] * 43 + [False] * 3


def test_with_parameters_or_channels_for_numbers_it_is_the_same():
    """A sum with numbers, an expression with names; what is bounded, delayed and summed likewise."""
    values = np.column_stack([np.random.default_rng(3).normal(scale=2.0, size=300), np.full(300, 2.0)])
    trace = Trace(name="t", sample_time=0.1, channels=tuple(Channel(name=n, unit="1") for n in "ab"), values=values)
    text = "r = relay(a, on=2, off=-1, slope=3); y = clamp(0.5*a - 0.25, -1, 2); z[k+1] = 0.5*z[k] + 2*a[k]"
    named = "r = relay(a, on=b, off=p, slope=3); y = clamp(q*a - 0.25, p, b); z[k+1] = q*z[k] + 2*a[k]"
    (seen,) = with_fixed(fixed_by_equations(text), [trace])
    (other,) = with_fixed(fixed_by_equations(named, parameters={"p": -1, "q": {"start": 0.5, "fixed": True}}), [trace])
    assert 0.1 < seen["r"].mean() < 0.9
    np.testing.assert_allclose(other.columns(["r", "y", "z"]), seen.columns(["r", "y", "z"]), rtol=0, atol=1e-12)


def test_a_sum_of_thousands_of_terms_is_read():
    (one,) = fixed_by_equations("y = " + " + ".join(["a"] * 3_000))
    assert one.weights == ({0: 3000.0},)


@pytest.mark.parametrize(
    ("equation", "says"),
    [
        ("dy/dt = -y + a", r"(?s)given by its rate.*y\[k\+1\] = y\[k\]"),
        ("y = a/0", "a division by 0"),
        ("y = a*relay(b, on=1, off=0)", r"(?s)relay within.*\^.*an equation of its own"),
        ("y = a*net(b, neurons=2)", r"(?s)net within.*fit a member"),
        ("y = a*delay(b, 0.5)", r"(?s)delay within.*in samples"),
        ("y = maxi(a, 0) + b", "no function maxi"),
        ("y = a*b(t - 0.5)", r"(?s)a delay in seconds.*b\[k-5\]"),
        ("y = a(t - 0.5)", r"(?s)a delay in seconds.*a\[k-5\]"),
        ("y = clamp(a, 0)", r"(?s)clamp has other arguments.*clamp\(x, low, high\)"),
        ("y = clamp(a, 0, low=1, high=2)", "clamp has other arguments"),
        ("y = relay(a, on=1, off=2, slope=3)", "the relay has no width"),
        ("y = relay(a, on=2)", r"(?s)relay has other arguments.*slope"),
        ("y = relay(a, on=b, slope=2)", "relay has other arguments"),
        ("y = max(y, a)", "reads itself now"),
        ("y = max(y[k-1], 2)", "reads no other channel"),
        ("y = y + a", "reads itself now"),
        ("y = 3 + y[k-1]", "reads no other channel"),
        ("y = clamp(a, 2, 1)", r"(?s)bounds of y.*low 2, rest 0, high 1"),
        ("y = ", "a value belongs"),
    ],
)
def test_what_is_no_held_sum_is_told(equation, says):
    with pytest.raises(ConfigError, match=says):
        fixed_by_equations(equation)


@pytest.mark.parametrize(
    "given", [{"rest": {"z": 1}}, {"unit": {"z": "m"}}, {"shared": ("z",)}, {"tables": {"z": [[0, 1], [1, 2]]}}]
)
def test_what_is_said_of_no_equation_is_told(given):
    with pytest.raises(ConfigError, match=f"{next(iter(given))} names z, which is in none of the equations"):
        fixed_by_equations("y = a", **given)


@pytest.mark.parametrize(
    ("equation", "told"),
    [
        pytest.param("y = a - b", "a is in bar, and b in psi", id="a sum"),
        pytest.param("y = 2*a - 0.1*b", "", id="weights, which may convert"),
        pytest.param("y = min(a, b)", "a is in bar, and b in psi", id="an expression"),
        pytest.param("R = relay(a - b[k-1], on=1, off=0)", "a is in bar, and b[k-1] in psi", id="a relay"),
        pytest.param("y = where(a > 3, high*b, b[k-1])", "high * b is in Pa*psi, and b[k-1] in psi", id="a parameter"),
        pytest.param("y = where(a > 3, b, y[k-1])", "", id="its own past"),
    ],
)
def test_units_that_contradict_each_other_are_told(equation: str, told: str) -> None:
    parameters = {"high": {"start": 2.0, "unit": "Pa"}} if "high" in equation else {}
    fixed = fixed_by_equations(equation, parameters=parameters)
    channels = (Channel(name="a", unit="bar"), Channel(name="b", unit="psi"))
    record = Trace(name="record", sample_time=0.1, channels=channels, values=np.ones((5, 2)))
    found = unit_contradictions_of(fixed, with_fixed(fixed, [record])[0])
    assert [told in one for one in found] == [True] * bool(told)
