"""The inputs of a free run: columns in the order of the mapping, and what cannot be run is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sysid.errors import ConfigError, UserError
from sysid.ingest.memory.arrays import data
from sysid.ingest.memory.run_inputs import inputs_of

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


@pytest.mark.parametrize("name", ["t", "time"])
def test_an_input_that_is_called_as_time_is_has_its_own_unit(name: str) -> None:
    """A surrogate with a torque t was searched for minutes, and could not be proven: N*m are no seconds."""
    for u in ({name: U}, pd.DataFrame({name: U, "y": U}), {f"{name} [kN*m]": U / 1e3}):
        assert_allclose(inputs_of(u, (name,), sample_time=0.5, units={name: "N*m"})[:, 0], U)


@pytest.mark.parametrize("u", [U[:0], np.where(U > 2, np.nan, U), np.where(U > 2, np.inf, U), U * 1j, ["a", "b"]])
def test_inputs_that_cannot_be_run_are_refused(u: Any) -> None:
    with pytest.raises(UserError) as caught:
        inputs_of(u, ("u",))
    assert caught.value.remedy


STAMPS = pd.date_range("2024-01-01", periods=20, freq="500ms", tz="Europe/Berlin")
UNEVEN = {
    "a gap": [0, 1, 2, *range(5, 20)],
    "a sample twice": [0, 1, 2, 2, *range(3, 20)],
    "two samples changed over": [1, 0, *range(2, 20)],
    "jitter": None,
}


@pytest.mark.parametrize("rows", UNEVEN)
@pytest.mark.parametrize("labels", ["stamps", "a column", "numbers"])
def test_a_run_over_samples_that_are_not_one_after_the_other_is_refused(labels: str, rows: str) -> None:
    """It would be computed as if they were."""
    frame = pd.DataFrame({"t": T, "u": U})
    picked = frame.iloc[UNEVEN[rows] or range(20)].copy()
    if rows == "jitter":
        picked["t"] += 0.1 * np.random.default_rng(0).uniform(-1.0, 1.0, 20)
    if labels == "stamps":
        picked.index = STAMPS[0] + pd.to_timedelta(picked.pop("t"), unit="s")
    elif labels == "numbers":
        picked.pop("t")
    if rows == "jitter" and labels == "numbers":
        return  # rows that are counted have none
    with pytest.raises(UserError) as caught:
        inputs_of(picked, ("u",), sample_time=0.5)
    assert caught.value.remedy
    assert labels == "numbers" or "sysid.data(table, ...).traces[0]" in caught.value.remedy


def test_the_remedy_for_a_gap_works() -> None:
    picked = pd.DataFrame({"u": U}, index=STAMPS).iloc[UNEVEN["a gap"] or []]
    trace = data(picked, repairs={"gaps": "hold"}).traces[0]
    assert_array_equal(inputs_of(trace, ("u",), sample_time=0.5)[:, 0], U)


@pytest.mark.parametrize("count", [1, 2, 20])
def test_stamps_far_from_zero_are_even(count: int) -> None:
    frame = pd.DataFrame({"time": 1.7e9 + 1e-3 * np.arange(count), "u": U[:count]})
    assert_array_equal(inputs_of(frame, ("u",), sample_time=1e-3)[:, 0], U[:count])


def test_stamps_as_text_are_no_labels_without_a_meaning() -> None:
    with pytest.raises(ConfigError, match=r"pd\.to_datetime"):
        inputs_of(pd.DataFrame({"u": U}, index=STAMPS.strftime("%d.%m.%Y %H:%M:%S.%f")), ("u",), sample_time=0.5)
