"""Joined passages against their twins, number by number."""

from __future__ import annotations

import numpy as np
import pytest

from sysid import testing
from sysid.kernels import passages


@pytest.mark.parametrize("width", [1, 2, 5, 7, 8, 9, 12, 16, 23, 40])
def test_the_closest_place_is_that_of_the_twin(width: int) -> None:
    rng = np.random.default_rng(width)
    features = rng.uniform(-1.0, 1.0, (60, width))
    features[30:] = features[:30]  # of places alike the first that was drawn
    for end in (0, 7, 59, 70):
        for apart in (1, 8, 100):
            drawn = rng.integers(0, 60, 25)
            assert passages.closest(features, drawn, end, apart) == testing.closest(features, drawn, end, apart)


def test_passages_are_joined_as_the_twin_joins_them() -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(50, 3))
    rows.setflags(write=False)
    parts = [
        (0, 6.3, 6.3 / 9, 10, False),  # slower
        (20, 11.0, 11.0 / 4, 5, True),  # faster
        (44, 5, 5 / 2, 3, True),  # to the end of the record, in fewer samples than it is led over
        (10, 4, 1.0, 12, True),  # as recorded, and standing where it ends
        (49, 0, 1.0, 8, True),  # a way of one row
        (49, 0.0, 0.0, 6, False),
    ]
    at, span, step, count, led = (np.array(one) for one in zip(*parts, strict=True))
    found = np.empty((count.sum(), 3))
    passages.joined(
        rows, at, span.astype(np.float64), step, count, led, 6, rows.min(axis=0), rows.max(axis=0), found
    )  # fmt: skip
    np.testing.assert_array_equal(found, testing.joined(rows, parts, 6))
