"""Thinning: nothing that can be seen is lost."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sysid.reporting.figures.thinning import distinct_points, thin

values = arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(float("nan")))


@given(y=values, columns=st.integers(1, 20))
def test_every_column_keeps_its_ends_its_extremes_and_its_gaps(y: np.ndarray, columns: int) -> None:
    x = np.arange(len(y), dtype=np.float64)
    thin_x, thin_y = thin(x, y, columns)
    np.testing.assert_array_equal(thin_y, y[thin_x.astype(int)])
    assert (np.diff(thin_x) > 0).all()
    assert len(thin_x) <= max(5 * columns, len(y) if len(y) <= 4 * columns else 0)
    edges = np.linspace(0, len(y), columns + 1).astype(int)
    for begin, end in pairwise(edges):
        whole, kept = y[begin:end], thin_y[(thin_x >= begin) & (thin_x < end)]
        if not len(whole):
            continue
        np.testing.assert_array_equal(kept[[0, -1]], whole[[0, -1]])
        assert np.isnan(kept).any() == np.isnan(whole).any()
        if np.isfinite(whole).any():
            assert (np.nanmin(kept), np.nanmax(kept)) == (np.nanmin(whole), np.nanmax(whole))


@given(points=arrays(np.float64, st.tuples(st.integers(0, 200), st.just(2)), elements=st.floats(-1e3, 1e3)))
def test_distinct_points_lie_within_half_a_cell_of_a_sample(points: np.ndarray) -> None:
    cells = 10
    x, y = distinct_points(points[:, 0], points[:, 1], cells)
    if not len(points):
        assert len(x) == 0
        return
    half = np.ptp(points, axis=0) / cells / 2 + 1e-9
    for sample in points:
        assert ((np.abs(x - sample[0]) <= half[0]) & (np.abs(y - sample[1]) <= half[1])).any()
    assert len(x) <= len(points)


def test_points_that_are_not_finite_are_left_out() -> None:
    x, y = distinct_points(np.array([1.0, 2.0]), np.array([np.inf, np.nan]), 5)
    assert (len(x), len(y)) == (0, 0)


@pytest.mark.parametrize("cells", [1, 7])
def test_one_point_stays_where_it_is(cells: int) -> None:
    x, y = distinct_points(np.array([3.0]), np.array([4.0]), cells)
    assert (x.tolist(), y.tolist()) == ([3.0], [4.0])
