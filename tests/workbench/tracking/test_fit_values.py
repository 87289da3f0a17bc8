"""What is tracked of a fit, in plain words."""

from __future__ import annotations

from sysid.workbench.tracking.fit_values import MAX_METRICS, batches


def test_metrics_go_in_as_many_batches_as_the_store_needs():
    values = list(range(2 * MAX_METRICS + 1))
    assert [len(one) for one in batches(values)] == [MAX_METRICS, MAX_METRICS, 1]
    assert [value for one in batches(values) for value in one] == values
    assert list(batches([])) == []
