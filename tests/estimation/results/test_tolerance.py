"""How many records a free run stays within a tolerance over."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.estimation.results.tolerance import outside, spans_of
from sysid.traces import Channel, Trace


def test_ranges_are_over_all_records_and_never_nought() -> None:
    channels = tuple(Channel(name=name, unit="m") for name in ("y", "still"))
    traces = [
        Trace(name=str(k), sample_time=1.0, channels=channels, values=np.array([[low, 5.0], [low + 1.0, 5.0]]))
        for k, low in enumerate((0.0, 3.0))
    ]
    np.testing.assert_array_equal(spans_of(traces, ["y", "still"]), [4.0, 1.0])


@pytest.mark.parametrize(
    ("shares", "tolerance", "count"),
    [
        ([], 0.01, 0),
        ([0.01, 0.010001, np.nan, np.inf], 0.01, 3),
        ([0.5, np.nan], None, 0),
        ([[0.0, 0.02], [0.01, 0.01]], 0.01, 1),
        ([[0.02], [0.0]], 0.01, 1),
        (np.zeros((3, 0)), 0.01, 0),
    ],
)
def test_a_record_is_outside_where_any_output_is(shares: object, tolerance: float | None, count: int) -> None:
    assert outside(shares, tolerance) == count  # type: ignore[arg-type] - lists and arrays alike
