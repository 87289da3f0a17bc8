"""Fixed submodels: what is declared, as one more measured channel and as a part of the whole."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sysid.composite.fixed.equations import fixed_by_equations
from sysid.composite.fixed.member import FixedMember
from sysid.composite.fixed_members import fixed_model, with_fixed
from sysid.errors import ConfigError
from sysid.models import Mapping
from sysid.traces import Channel, Trace
from tests.composite.composites import fixed

DECLARED = fixed("a+b -> d", gains={"a": 2, "b": -1}, constant=0.5, low=-1, high=3)


def trace(values: np.ndarray) -> Trace:
    channels = (Channel(name="a", unit="psi"), Channel(name="b", unit="V"))
    return Trace(name="t", sample_time=0.1, channels=channels, values=values)


@given(
    st.lists(st.tuples(*[st.floats(-10.0, 10.0)] * 2), min_size=1, max_size=20),
    st.floats(-5.0, 0.0),
    st.floats(0.1, 5.0),
    st.floats(-3.0, 3.0),
)
def test_it_is_the_sum_that_is_declared_held_between_its_bounds(rows, low, high, constant):
    values = np.array(rows)
    declared = FixedMember(
        mapping=Mapping.parse("a+b -> d"), gains={"b": -1.0, "a": 2.0}, constant=constant, low=low, high=high, rest=0.0
    )
    expected = np.clip(2.0 * values[:, 0] - values[:, 1] + constant, low, high)
    (seen,) = with_fixed([declared], [trace(values)])
    assert_allclose(seen["d"], expected, rtol=1e-12, atol=1e-12)
    assert np.isinf(fixed_model(declared, trace(values)).clamp)


@given(
    st.lists(st.tuples(*[st.floats(-10.0, 10.0)] * 2), min_size=1, max_size=40),
    st.floats(1.0, 50.0),
    st.floats(0.2, 3.0),
)
def test_with_a_weight_above_one_on_its_last_value_it_is_a_relay_with_hysteresis(rows, slope, width):
    """Its plain twin: past one threshold up, past the other down, between them as it was."""
    values = np.array(rows)
    weight = 1.0 + 2.0 * slope * width
    declared = FixedMember(
        mapping=Mapping.parse("a+b -> d"),
        gains={"a": slope, "b": -slope, "d": weight},
        constant=0.5 - 0.5 * weight,
        low=0,
        high=1,
        rest=0,
    )
    (seen,) = with_fixed([declared], [trace(values)])
    state = 0.0
    for x, y in zip(values[:, 0] - values[:, 1], seen["d"], strict=True):
        if state in {0.0, 1.0}:
            far = abs(x) > width + 1.0 / slope + 1e-9  # beyond the threshold by what moves it in one step
            if far or (abs(x) < width - 1e-9):
                assert y == pytest.approx(float(x > 0) if far else state)
        state = y


def test_with_a_weight_of_one_it_is_a_latch():
    latch = fixed("a+b -> d", gains={"a": 1, "b": -1, "d": 1})
    values = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    (seen,) = with_fixed([latch], [trace(values)])
    assert_allclose(seen["d"], [0, 1, 1, 1, 0, 0])


def test_with_weights_by_lag_it_says_for_how_much_of_the_next_sample_a_ramp_will_be_past_a_threshold():
    """A ramp of ``slope`` per sample; its plain twin counts the next sample's instants past the threshold."""
    slope, threshold = 0.4, 3.05
    declared = fixed("a+b -> d", gains={"a": {0: 2 / slope, 1: -1 / slope}, "b": 0}, constant=0.5 - threshold / slope)
    values = np.column_stack([slope * np.arange(12.0), np.zeros(12)])  # means over samples: the middle of each
    (seen,) = with_fixed([declared], [trace(values)])
    instants = slope * (np.arange(1, 13)[:, None] + (np.arange(1000) + 0.5) / 1000 - 0.5)
    assert_allclose(seen["d"][1:], np.mean(instants > threshold, axis=1)[1:], atol=2e-3)


@given(st.lists(st.tuples(*[st.floats(-10.0, 10.0)] * 2), min_size=1, max_size=20), st.floats(-2.0, 2.0))
def test_before_the_first_sample_everything_stood_as_in_it(rows, weight):
    values = np.array(rows)
    declared = FixedMember(
        mapping=Mapping.parse("a+b -> d"), gains={"a": {0: 1.0, 3: weight}, "b": {2: -1.0}}, low=-99, high=99, rest=0
    )
    (seen,) = with_fixed([declared], [trace(values)])
    past = np.vstack([np.repeat(values[:1], 3, axis=0), values])
    expected = past[3:, 0] + weight * past[:-3, 0] - past[1:-2, 1]
    assert_allclose(seen["d"], expected, rtol=1e-12, atol=1e-12)


def test_a_later_one_may_read_an_earlier_one():
    second = fixed("d -> e", gains={"d": 1})
    values = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 1.0]])
    (seen,) = with_fixed([DECLARED, second], [trace(values)])
    assert seen.channel_names == ("a", "b", "d", "e")
    assert_allclose(seen["d"], [0.5, 2.5, -1.0])
    assert_allclose(seen["e"], [0.5, 1.0, 0.0])
    assert [channel.unit for channel in seen.channels] == ["psi", "V", "1", "1"]


@given(st.lists(st.tuples(*[st.floats(-2.0, 2.0)] * 2), min_size=1, max_size=40))
def test_they_may_read_each_other_in_a_circle_through_the_past(rows):
    """A vent that opens once and, shut, stays shut until it is reset; beside it the same written plainly."""
    values = np.array(rows)
    vent = fixed("a+t -> v", gains={"a": 5, "t": {1: -50}, "v": 50})
    tripped = fixed("v+b -> t", gains={"v": 1, "b": -1, "t": 1})
    (seen,) = with_fixed([vent, tripped], [trace(values)])
    v = t = 0.0
    for n, (a, b) in enumerate(values):
        v = min(max(5.0 * a - 50.0 * t + 50.0 * v, 0.0), 1.0)
        t = min(max(v - b + t, 0.0), 1.0)
        assert_allclose([seen["v"][n], seen["t"][n]], [v, t], atol=1e-9)


def test_an_output_that_is_measured_stays_as_it_was_measured():
    """A position beside a speed, whose integral is known."""
    summed = fixed("a -> b", gains={"a": 0.1, "b": 1}, low=-500, high=500, unit="V")
    measured = trace(np.array([[1.0, 0.0], [1.0, 0.2], [1.0, 0.3]]))
    (seen,) = with_fixed([summed], [measured])
    assert seen.channel_names == ("a", "b")
    assert_allclose(seen["b"], measured["b"])


def test_an_output_that_is_measured_in_another_unit_is_refused():
    with pytest.raises(ConfigError, match="measured in another unit") as caught:
        with_fixed([fixed("a -> b", gains={"a": 0.1, "b": 1}, low=-500, high=500, unit="mV")], [trace(np.ones((3, 2)))])
    assert caught.value.remedy is not None
    assert "unit: V" in caught.value.remedy


def test_an_equation_stands_in_every_instance_over_its_channels():
    declared = fixed_by_equations(
        "top = max(a, s)*valve(a[k-2])",
        unit="psi",
        instances=("", "9"),
        shared=("s",),
        tables={"valve": [[0, 1], [9, 4]]},
    )
    values = np.random.default_rng(0).uniform(-2.0, 12.0, (50, 3))
    channels = tuple(Channel(name=name, unit="psi") for name in ("a", "a9", "s"))
    (seen,) = with_fixed(declared, [Trace(name="t", sample_time=0.1, channels=channels, values=values)])
    for name, column in (("top", 0), ("top9", 1)):
        a, before = values[:, column], np.concatenate([values[:1, column]] * 2 + [values[:-2, column]])
        expected = np.maximum(a, values[:, 2]) * np.interp(before, [0, 9], [1, 4])
        assert_allclose(seen[name], expected, rtol=1e-13)
        assert seen.channel(name).unit == "psi"


@pytest.mark.parametrize(
    "fields",
    [
        {"equation": "a*c"},
        {"equation": "a"},
        {"equation": "a*b", "constant": 1.0},
        {"equation": "a*b", "gains": {"a": 1, "b": 1}},
        {"equation": "a*b(t - 1)"},
        {"equation": "relay(a*b, 2, 1)"},
        {"gains": {"a": 1, "b": 1}, "tables": {"v": [[0, 1], [1, 2]]}},
    ],
)
def test_an_equation_of_other_inputs_or_with_a_memory_is_refused(fields):
    with pytest.raises(ConfigError, match=r"a[+]b -> d|nothing says what"):
        FixedMember(mapping=Mapping.parse("a+b -> d"), rest=0, **fields)
