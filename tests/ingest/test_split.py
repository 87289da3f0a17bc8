"""Roles by share, by time, by a column, or experiment by experiment."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sysid.errors import ChannelError, ConfigError
from sysid.ingest.memory.arrays import data
from sysid.traces import Role

Y = np.arange(20.0)
SETS = ["train"] * 8 + ["select"] * 4 + ["test"] * 8

SPLITS: dict[str, tuple[Any, list[tuple[str, str, int, float]]]] = {
    "all is for estimation": (None, [("record", "estimation", 20, 0.0)]),
    "one share": (0.6, [("estimation", "estimation", 12, 0.0), ("validation", "validation", 8, 1.2)]),
    "three shares": (
        (0.5, 0.25, 0.25),
        [
            ("estimation", "estimation", 10, 0.0),
            ("selection", "selection", 5, 1.0),
            ("validation", "validation", 5, 1.5),
        ],
    ),
    "spans of time": (
        {"train": (0.0, 1.0), "test": (1.5, 2.0)},
        [("train", "estimation", 10, 0.0), ("test", "test", 5, 1.5)],
    ),
    "a column": (
        "set",
        [("train", "estimation", 8, 0.0), ("select", "selection", 4, 0.8), ("test", "test", 8, 1.2)],
    ),
}


@pytest.mark.parametrize(
    "split",
    [
        {Role.ESTIMATION: (0.0, 1.0), Role.VALIDATION: (1.0, 2.0)},
        {"estimation": (None, pd.Timedelta("1s")), "validation": (timedelta(seconds=1), None)},
        {"train": (np.timedelta64(0, "ms"), np.timedelta64(1000, "ms")), "val": (np.float32(1.0), None)},
    ],
)
def test_spans_are_roles_with_numbers_durations_or_open_ends(split: Any) -> None:
    parts = data(Y, sample_time=0.1, split=split)
    assert [(parts.roles[part.name], len(part)) for part in parts] == [(Role.ESTIMATION, 10), (Role.VALIDATION, 10)]


@pytest.mark.parametrize("split", [[Role.ESTIMATION, "test"], {"b": Role.TEST, "a": "train"}], ids=["list", "dict"])
def test_each_experiment_has_its_role_in_order_or_by_name(split: Any) -> None:
    assert data({"a": {"y": Y}, "b": {"y": Y}}, sample_time=0.1, split=split).roles == {
        "a": Role.ESTIMATION,
        "b": Role.TEST,
    }


def test_a_role_by_the_name_of_no_experiment_is_refused() -> None:
    with pytest.raises(ConfigError, match="roles and experiments"):
        data({"a": {"y": Y}, "b": {"y": Y}}, sample_time=0.1, split={"a": "train", "c": "test"})


@pytest.mark.parametrize("case", SPLITS)
def test_a_split_gives_parts_and_roles(case: str) -> None:
    split, parts = SPLITS[case]
    traces = data(pd.DataFrame({"y": Y, "set": SETS}), outputs="y", sample_time=0.1, split=split)
    found = [(one.name, traces.roles[one.name].value, len(one), pytest.approx(one.start_time)) for one in traces]
    assert found == parts


def test_stretches_of_the_same_role_are_experiments_of_their_own() -> None:
    marks = ["train"] * 5 + ["val"] * 5 + ["train"] * 10
    traces = data({"y": Y, "set": np.array(marks)}, outputs="y", sample_time=0.1, split="set")
    assert traces.names == ("train", "val", "train-2")


def test_of_several_experiments_whole_ones_go_to_each_role() -> None:
    traces = data([Y, Y, Y, Y], outputs="y", sample_time=0.1, split=0.75)
    assert [role.value for role in traces.roles.values()] == ["estimation"] * 3 + ["validation"]


@pytest.mark.parametrize(
    "split",
    [
        *(0.0, 1.0, -0.5, (0.5, 0.6), (0.5, 0.2), (0.25,) * 4, 0.001, {"val": (5.0, 6.0)}, ["x"]),
        *({"train": 1.0}, {"train": (0.0, 1.0, 2.0)}, {"train": ("a", "b")}, [("train", 0, 1)]),
        {"train": (0.0, 1.5), "test": (1.0, 2.0)},  # what is fitted cannot test the fit
    ],
)
def test_a_split_that_cannot_be_meant_is_refused(split: Any) -> None:
    with pytest.raises(ConfigError):
        data(Y, sample_time=0.1, split=split)


def test_a_column_that_is_not_there_is_refused_by_name() -> None:
    with pytest.raises(ChannelError):
        data({"y": Y}, sample_time=0.1, split="set")


@pytest.mark.parametrize("split", [timedelta(hours=50), datetime(2024, 1, 3)])
def test_one_time_is_no_split(split: Any) -> None:
    """It had been refused with a traceback."""
    with pytest.raises(ConfigError, match="not a split") as refused:
        data((Y, Y), sample_time=60.0, split=split)
    assert "in durations" in str(refused.value.remedy)
