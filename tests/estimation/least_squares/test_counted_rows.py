"""Which samples of a record count: every so-manieth, and those where a target jumps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from sysid.estimation.least_squares.counted_rows import counted_rows

targets = st.lists(
    st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0) | st.just(float("nan"))), min_size=1, max_size=60
).map(np.array)


@given(targets, st.integers(1, 9))
def test_without_moves_every_so_manieth_counts(target, stride):
    assert_array_equal(counted_rows(target, stride), np.arange(len(target))[::stride])


@given(targets, st.integers(1, 9), st.floats(0.1, 60.0))
def test_between_two_samples_that_count_is_no_more_than_a_stride_and_no_jump(target, stride, moves):
    rows = counted_rows(target, stride, moves)
    assert rows[0] == 0
    assert (np.diff(rows) > 0).all()
    for last, following in zip(rows, [*rows[1:], len(target)], strict=True):
        assert following - last <= stride
        for n in range(last + 1, following):
            assert not (np.abs(target[n] - target[last]) > moves).any()


@given(targets, st.integers(1, 9), st.floats(0.1, 60.0))
def test_both_sides_of_a_jump_count(target, stride, moves):
    rows = set(counted_rows(target, stride, moves))
    for n in np.flatnonzero((np.abs(np.diff(target, axis=0)) > 2 * moves).any(axis=1)):
        assert {n, n + 1} <= rows


def test_a_slow_move_counts_as_often_as_it_has_come_so_far():
    target = 0.5 * np.arange(21.0)[:, None]
    assert_array_equal(counted_rows(target, 20, 2.0), [0, 4, 5, 9, 10, 14, 15, 19, 20])


@pytest.mark.parametrize("stride", [1, 7])
def test_nothing_is_no_row(stride):
    assert counted_rows(np.empty((0, 1)), stride, 1.0).size == 0
