"""Rows of the Jacobian that have exploded count no more than a long one."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.testing import assert_allclose, assert_array_equal

from sysid.estimation.least_squares.leverage import leverage_roots

jacobians = arrays(np.float64, array_shapes(min_dims=2, max_dims=2, max_side=6), elements=st.floats(-1e9, 1e9))


@given(jacobians)
def test_without_a_limit_all_count_alike(rows):
    assert_array_equal(leverage_roots(rows, np.inf), 1.0)


@given(jacobians, st.floats(1e-3, 1e6))
def test_no_row_is_longer_than_the_limit_and_shorter_ones_stay(rows, longest):
    roots = leverage_roots(rows, longest)
    lengths = np.sqrt((rows**2).sum(axis=1))
    assert_allclose(lengths * roots, np.minimum(lengths, longest), rtol=1e-12)
    assert_array_equal(roots[lengths < longest], 1.0)
