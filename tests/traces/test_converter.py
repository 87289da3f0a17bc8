"""The step of a converter is found through rounding."""

from __future__ import annotations

import numpy as np
import pytest

from sysid.traces.converter import coarse_step, converter_step


def test_a_step_is_found_through_rounding_and_none_where_there_is_none() -> None:
    rng = np.random.default_rng(1)
    slow = np.cumsum(rng.standard_normal(500)) / 10
    assert converter_step(np.round(slow / 0.3) * 0.3 * 1.8 + 32.0) == pytest.approx(0.54)
    assert converter_step((np.round(slow / 0.3) * 0.3).astype(np.float32).astype(float)) == pytest.approx(0.3, rel=1e-4)
    assert converter_step(slow) is None
    assert converter_step(np.where(slow > 0, 1.0, -1.0)) is None
    assert converter_step(slow[:10].round(1)) is None
    assert coarse_step(np.round(slow / 0.3) * 0.3) == pytest.approx(0.3)
    assert coarse_step(np.round(slow / 0.01) * 0.01) is None
    assert coarse_step(np.repeat(rng.uniform(0, 100, 50).round(), 10)) is None
