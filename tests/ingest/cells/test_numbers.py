"""Cells to numbers, with nothing guessed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sysid.ingest.cells.numbers import NumberFormat

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize(
    ("cell", "decimal", "thousands", "value"),
    [
        ("1.5", ".", None, 1.5),
        ("1,5", ",", None, 1.5),
        (" -1,5e-3 ", ",", None, -0.0015),
        (",5", ",", None, 0.5),
        ("5.", ".", None, 5.0),
        ("1.003,5", ",", ".", 1003.5),
        ("1,234,567.25", ".", ",", 1234567.25),
        ("1'003.5", ".", "'", 1003.5),
        ("1.003.000", ".", ".", 1003.0),
        ("301.000", ".", ".", 301.0),
        ("0.000", ".", ".", 0.0),
        ("151.303.250", ".", ".", 151303.25),
        ("17", ".", ".", 17.0),
        ("inf", ".", None, math.inf),
        ("", ".", None, math.nan),
        ("NaN", ",", None, math.nan),
        ("---", ".", None, math.nan),
    ],
)
def test_a_number_is_read(cell: str, decimal: str, thousands: str | None, value: float) -> None:
    parsed = NumberFormat(decimal=decimal, thousands=thousands, missing=("---",)).parse(cell)
    assert parsed is not None
    assert parsed == value or (math.isnan(parsed) and math.isnan(value))


@pytest.mark.parametrize(
    ("cell", "decimal", "thousands"),
    [
        ("1.5", ",", None),
        ("1,5", ".", None),
        ("1.5", ",", "."),  # groups have three digits: this is not 15
        ("1.0003", ",", "."),
        ("1.003.000", ".", None),
        ("1.0.5", ".", "."),
        ("1_000", ".", None),
        ("٣", ".", None),
        ("0x", ".", None),
        ("10h", ".", None),
        ("1 2", ".", None),
        ("OK", ".", None),
        ("1e", ".", None),
        (".", ".", None),
        ("--1", ".", None),
    ],
)
def test_what_is_not_a_number_of_this_file_is_refused(cell: str, decimal: str, thousands: str | None) -> None:
    numbers = NumberFormat(decimal=decimal, thousands=thousands)
    assert numbers.parse(cell) is None
    assert numbers.column(["1", cell, "2"]) == 1


@given(st.lists(FINITE, min_size=1), st.sampled_from([".", ","]))
def test_every_float_reads_back_exactly(values: list[float], decimal: str) -> None:
    cells = [repr(value).replace(".", decimal) for value in values]
    column = NumberFormat(decimal=decimal).column(cells)
    np.testing.assert_array_equal(column, values)


@given(
    st.integers(-(10**15), 10**15),
    st.integers(0, 999),
    st.sampled_from([(",", "."), (".", ","), (".", "'"), (".", ".")]),
)
def test_grouped_numbers_read_back(whole: int, part: int, marks: tuple[str, str]) -> None:
    decimal, thousands = marks
    cell = f"{whole:,}".replace(",", thousands) + f"{decimal}{part:03d}"
    value = NumberFormat(decimal=decimal, thousands=thousands).parse(cell)
    assert value == float(f"{whole}.{part:03d}")


@given(st.lists(st.text(max_size=8)), st.sampled_from([".", ","]))
def test_the_fast_way_and_the_slow_way_agree(cells: list[str], decimal: str) -> None:
    numbers = NumberFormat(decimal=decimal)
    slow = [numbers.parse(cell) for cell in cells]
    column = numbers.column(cells)
    if None in slow:
        assert column == slow.index(None)
    else:
        np.testing.assert_array_equal(column, np.array(slow, dtype=float))
