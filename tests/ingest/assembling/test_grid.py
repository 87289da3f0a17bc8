"""Samples onto a uniform grid, against slow and obviously right twins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from sysid.ingest.assembling.grid import Method, fill, grid_places, place, resample


def reference(
    stamps: NDArray[np.float64], values: NDArray[np.float64], grid: NDArray[np.float64], method: Method, width: float
) -> NDArray[np.float64]:
    """One grid point at a time, as one would do it by hand."""
    out = np.full((len(grid), values.shape[1]), np.nan)
    half = 0.5 * np.median(np.diff(stamps))
    fuzz = 0.0 if method == "linear" else 1e-6 * width  # on the point counts as before it; a line is the same there
    for row, t in enumerate(grid):
        if method == "average":
            inside = [i for i, s in enumerate(stamps) if t <= s + half + 1e-6 * width < t + width]
            if inside:
                out[row] = np.mean([values[i] for i in inside], axis=0)
            continue
        last = max(i for i, s in enumerate(stamps) if s <= t + fuzz)
        if method == "hold" or last == len(stamps) - 1:
            out[row] = values[last]
        else:
            last = max(
                (i for i, s in enumerate(stamps) if s <= t), default=last
            )  # between its neighbours, never beyond
            share = (t - stamps[last]) / (stamps[last + 1] - stamps[last])
            out[row] = values[last] + share * (values[last + 1] - values[last])
    return out


@given(
    st.sampled_from(["linear", "hold", "average"]),
    st.integers(12, 40),
    st.floats(0.0, 0.4),
    st.floats(0.3, 3.0),
    st.integers(0, 2**32 - 1),
)
def test_resampling_jittered_stamps_agrees_with_doing_it_by_hand(
    method: Method, count: int, jitter: float, ratio: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    stamps = 5.0 + 0.1 * (np.arange(count) + jitter * rng.uniform(-1.0, 1.0, count))
    values = rng.normal(size=(count, 2))
    # a record slower than the grid is never averaged: assemble refuses it
    sample_time = 0.1 * (max(ratio, 1.5) if method == "average" else ratio)
    gridded = resample(
        stamps,
        values,
        sample_time=sample_time,
        method=method,
        start=float(stamps[0]),
        longest_step=1.0,
        marked=np.zeros(values.shape, dtype=bool),
    )
    grid = stamps[0] + sample_time * np.arange(len(gridded.values))
    expected = reference(stamps, values, grid, method, sample_time)
    np.testing.assert_allclose(gridded.values, expected, atol=1e-6)
    np.testing.assert_array_equal(gridded.empty, np.isnan(expected[:, 0]))
    # the grid reaches as far as the record does, and no farther
    assert grid[-1] <= stamps[-1] + 1e-6
    assert grid[-1] + (2.0 if method == "average" else 1.0) * sample_time + 0.1 > stamps[-1] - 1e-6


@given(st.integers(2, 8), st.integers(3, 30), st.integers(0, 2**32 - 1))
def test_averaging_a_fast_record_takes_whole_blocks(factor: int, blocks: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(factor * blocks + factor - 1, 1))
    stamps = 0.01 * np.arange(len(values))
    gridded = resample(
        stamps,
        values,
        sample_time=0.01 * factor,
        method="average",
        start=0.0,
        longest_step=1.0,
        marked=np.zeros(values.shape, dtype=bool),
    )
    expected = values[: factor * blocks].reshape(blocks, factor, 1).mean(axis=1)
    np.testing.assert_allclose(gridded.values, expected, atol=1e-12)


@given(st.floats(1e-3, 10.0), st.lists(st.integers(1, 5), min_size=1, max_size=50), st.floats(-1e3, 1e9))
def test_stamps_on_a_grid_find_their_places(sample_time: float, steps: list[int], start: float) -> None:
    places = np.concatenate([[0], np.cumsum(steps)])
    stamps = start + sample_time * places
    found = grid_places(stamps, sample_time, start=float(stamps[0]), tolerance=0.01)
    assert found is not None
    np.testing.assert_array_equal(found, places)


@pytest.mark.parametrize(
    "stamps", [[0.0, 0.1, 0.23], [0.0, 0.1, 0.1005], [0.0, 0.05, 0.1]], ids=["off", "two in one place", "too fast"]
)
def test_stamps_off_the_grid_have_no_places(stamps: list[float]) -> None:
    assert grid_places(np.array(stamps), 0.1, start=0.0, tolerance=0.01) is None


def test_marked_samples_taint_what_they_contribute_to() -> None:
    stamps, values = np.arange(6.0), np.column_stack([np.arange(6.0)] * 2)
    marked = np.column_stack([np.arange(6) == 2, np.arange(6) == 4])  # of each channel
    common = {"sample_time": 0.5, "start": 0.0, "longest_step": 10.0, "marked": marked}
    linear = resample(stamps, values, method="linear", **common)  # type: ignore[arg-type]  # one dict for both calls
    hold = resample(stamps, values, method="hold", **common)  # type: ignore[arg-type]  # one dict for both calls
    # grid: 0, .5, 1, 1.5, 2, 2.5, 3 ...: sample 2 reaches from 1.5 to 2.5 by lines, from 2 to 2.5 by holding
    assert np.flatnonzero(linear.tainted[:, 0]).tolist() == [3, 4, 5]
    assert np.flatnonzero(hold.tainted[:, 0]).tolist() == [4, 5]
    assert np.flatnonzero(linear.tainted[:, 1]).tolist() == [7, 8, 9]
    average = resample(stamps, values, method="average", **common | {"sample_time": 2.0})  # type: ignore[arg-type]
    assert average.tainted.tolist() == [[False, False], [True, False], [False, True]]


@pytest.mark.parametrize(
    ("method", "filled"), [("linear", [0.0, 1.0, 2.0, 3.0, 4.0]), ("hold", [0.0, 1.0, 1.0, 1.0, 4.0])]
)
def test_empty_places_are_filled(method: str, filled: list[float]) -> None:
    values = np.array([[0.0], [1.0], [4.0]])
    gridded = place(np.array([0.0, 1.0, 4.0]), values, np.array([0, 1, 4]), np.zeros((3, 1), dtype=bool))
    assert np.flatnonzero(gridded.empty).tolist() == [2, 3]
    assert fill(gridded, method)[:, 0].tolist() == filled  # type: ignore[arg-type]  # one of two literals
