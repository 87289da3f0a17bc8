"""Numbers as printed."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.reporting.numbers import number, quantity, seconds, times


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.00415, "0.00415"),
        (15.865, "15.9"),
        (-0.0541, "−0.0541"),
        (999.6, "1000"),
        (9999.6, "10\u202f000"),
        (123456.0, "123\u202f000"),
        (1e6, "1.00\u00a0×\u00a010⁶"),
        (2.239e-5, "2.24\u00a0×\u00a010⁻⁵"),
        (math.nan, "not defined"),
        (math.inf, "infinite"),
        (-math.inf, "minus infinite"),
    ],
)
def test_three_significant_digits_or_a_word(value: float, text: str) -> None:
    assert number(value) == text


@given(value=st.floats(1e-300, 1e300), sign=st.sampled_from([1.0, -1.0]))
def test_a_printed_number_is_the_number_to_half_of_its_last_digit(value: float, sign: float) -> None:
    text = number(sign * value).translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789", "\u202f"))
    mantissa, _, power = text.partition("\u00a0×\u00a010")
    assert float(f"{mantissa}e{power or 0}") == pytest.approx(sign * value, rel=5.1e-3)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (4.2e-5, "42.0 µs"),
        (0.203, "203 ms"),
        (40.0, "40.0 s"),
        (4500.0, "75.0 min"),
        (28800.0, "8.00 h"),
        (math.nan, "not measured"),
    ],
)
def test_durations_take_the_unit_that_suits_them(value: float, text: str) -> None:
    assert seconds(value).replace("\u00a0", " ") == text


def test_units_and_ratios_are_left_out_where_there_is_no_number() -> None:
    assert quantity(math.nan, "psi", missing="diverged") == "diverged"
    assert times(math.nan) == "not defined"
