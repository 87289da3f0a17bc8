"""The inputs of a free run: columns in the order of the mapping, and what cannot be run is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ConfigError, UserError
from sysid.ingest.run_inputs import inputs_of

T = np.arange(20) * 0.5
U = np.where((np.arange(20) // 5) % 2, 3.0, 1.0)


def test_inputs_stand_in_the_order_of_the_mapping() -> None:
    assert_array_equal(inputs_of({"b": [2.0], "a": [1.0]}, ("a", "b")), [[1.0, 2.0]])
    assert inputs_of(7, ()).shape == (7, 0)


def test_inputs_are_told_by_their_names_without_units_and_by_their_clock() -> None:
    frame = pd.DataFrame({"time [ms]": 1000 * T, "pump [V]": U})
    assert_array_equal(inputs_of(frame, ("pump",), sample_time=0.5)[:, 0], U)
    assert_array_equal(inputs_of(pd.Series(U, index=T, name="other"), ("pump",), sample_time=0.5)[:, 0], U)
    with pytest.raises(ConfigError, match="another distance"):
        inputs_of(frame, ("pump",), sample_time=0.1)
    assert_allclose(inputs_of(pd.DataFrame({"a": T}), ()).shape, (20, 0))


@pytest.mark.parametrize("u", [U[:0], np.where(U > 2, np.nan, U), np.where(U > 2, np.inf, U), U * 1j, ["a", "b"]])
def test_inputs_that_cannot_be_run_are_refused(u: Any) -> None:
    with pytest.raises(UserError) as caught:
        inputs_of(u, ("u",))
    assert caught.value.remedy
