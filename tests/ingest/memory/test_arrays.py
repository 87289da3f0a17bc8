"""Data that is in memory already: every kind of table becomes the same data set."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from sysid.errors import ChannelError, ConfigError, TraceError, UnitError
from sysid.ingest.memory.arrays import data
from sysid.traces import Role

T = np.arange(20) * 0.1
U = np.where((np.arange(20) // 5) % 2, 3.0, 1.0)
Y = np.cumsum(U)


class Tensor:
    """As a torch tensor behaves: it has to let go of its gradients before it is an array."""

    def __init__(self, values: Any) -> None:
        self.values = values

    def detach(self) -> Tensor:
        return self

    def cpu(self) -> Any:
        return self.values


class Polars:
    """As a polars frame behaves, as far as it is asked."""

    def __init__(self, **columns: Any) -> None:
        self.columns = columns

    def get_columns(self) -> list[pd.Series[Any]]:
        return [pd.Series(values, name=name) for name, values in self.columns.items()]


class XarrayVariable:
    def __init__(self, values: Any) -> None:
        self.values, self.ndim = np.asarray(values), np.ndim(values)


class Xarray:
    """As an xarray data set behaves, as far as it is asked."""

    def __init__(self, coords: dict[str, Any], **variables: Any) -> None:
        self.coords, self.data_vars, self._all = coords, variables, {**coords, **variables}

    def __getitem__(self, name: str) -> XarrayVariable:
        return XarrayVariable(self._all[name])


STRUCTURED = np.array(list(zip(T, U, Y, strict=True)), dtype=[("t", float), ("u", float), ("y", float)])

TABLES: dict[str, Callable[[], Any]] = {
    "calendar index": lambda: data(
        pd.DataFrame({"u": U, "y": Y}, index=pd.date_range("2024-10-27 01:59", periods=20, freq="100ms"))
    ),
    "index with a zone": lambda: data(
        pd.DataFrame(
            {"u": U, "y": Y}, index=pd.date_range("2024-10-27 00:59:59", periods=20, freq="100ms", tz="Europe/Berlin")
        )
    ),
    "timedelta index": lambda: data(pd.DataFrame({"u": U, "y": Y}, index=pd.to_timedelta(T, unit="s"))),
    "float index": lambda: data(pd.DataFrame({"u": U, "y": Y}, index=T)),
    "integer index named t [ms]": lambda: data(
        pd.DataFrame({"u": U, "y": Y}, index=pd.Index(range(0, 2000, 100), name="t")).rename_axis("t"),
        sample_time=100.0,
    ),
    "time column": lambda: data(pd.DataFrame({"time [ms]": 1000 * T, "u": U, "y": Y})),
    "counted index": lambda: data(pd.DataFrame({"u": U, "y": Y}), sample_time=0.1),
    "levels of columns": lambda: data(pd.DataFrame({("rig", "u"): U, ("rig", "y"): Y}), sample_time=0.1),
    "nullable numbers": lambda: data(
        pd.DataFrame({"u": U, "y": Y}, dtype="float32").astype("Float64"), sample_time=0.1
    ),
    "polars": lambda: data(Polars(t=T, u=U, y=Y)),
    "xarray": lambda: data(Xarray({"time": T}, u=U, y=Y)),
    "dict": lambda: data({"t": T, "u": U.tolist(), "y": Y}),
    "structured array": lambda: data(STRUCTURED),
    "array": lambda: data(np.column_stack([U, Y]), inputs="u", outputs="y", sample_time=0.1),
    "pair": lambda: data((U, Y), sample_time=0.1),
    "pair of columns": lambda: data((U[:, None], Y[:, None]), sample_time=0.1),
    "pair of lists": lambda: data((U.tolist(), Y.tolist()), sample_time=0.1),
    "tensors": lambda: data((Tensor(U), Tensor(Y)), sample_time=0.1),
}


@pytest.mark.parametrize("table", TABLES)
def test_every_kind_of_table_is_the_same_data_set(table: str) -> None:
    traces = TABLES[table]()
    (trace,) = traces
    assert_array_equal(trace.values, np.column_stack([U, Y]))
    assert [name.removeprefix("rig.") for name in trace.channel_names] == ["u", "y"]
    assert traces.sample_time == pytest.approx(100.0 if "[ms]" in table and "index" in table else 0.1, rel=1e-9)
    assert traces.roles == {"record": Role.ESTIMATION}


def test_one_column_is_an_output() -> None:
    assert data(Y, sample_time=0.1).channels[0].name == "y"
    assert data(pd.Series(Y, index=T, name="level")).channels[0].name == "level"


def test_several_columns_are_numbered() -> None:
    traces = data((np.column_stack([U, U + 1]), np.column_stack([Y, Y])), sample_time=1)
    assert traces["record"].channel_names == ("u1", "u2", "y1", "y2")


def test_units_come_from_names_or_are_given() -> None:
    frame = pd.DataFrame({"pump [V]": U, "level": Y})
    named = data(frame, inputs="pump", outputs="level", units={"level": "cm"}, sample_time=1.0)
    assert [channel.label for channel in named.channels] == ["pump [V]", "level [cm]"]
    assert [c.unit for c in data((U, Y), units=["V", "bar"], sample_time=1).channels] == ["V", "bar"]
    assert {c.unit for c in data((U, Y), units="V", sample_time=1).channels} == {"V"}


def test_experiments_stay_apart_and_may_differ_in_length() -> None:
    traces = data([(U, Y), (U[:12], Y[:12])], sample_time=0.1, split=["train", "val"])
    assert [len(trace) for trace in traces] == [20, 12]
    assert list(traces.roles.values()) == [Role.ESTIMATION, Role.VALIDATION]
    assert data({"monday": (U, Y), "tuesday": (U, Y)}, sample_time=0.1).names == ("monday", "tuesday")
    both = data({"monday": (np.column_stack([U, U]), Y), "tuesday": (np.column_stack([U, U]), Y)}, sample_time=0.1)
    assert both.names == ("monday", "tuesday")


def test_where_the_numbers_come_from_is_said() -> None:
    (trace,) = data((U, Y), sample_time=0.1)
    assert trace.provenance[0].startswith("given from memory (SHA-256 ")


REFUSED: dict[str, tuple[type[Exception], Callable[[], Any]]] = {
    "no sample time": (ConfigError, lambda: data((U, Y))),
    "array on its side": (
        ConfigError,
        lambda: data(np.vstack([U, Y]), inputs="u", outputs="y", sample_time=1),
    ),
    "nameless columns": (ConfigError, lambda: data(np.column_stack([U, Y]), sample_time=1)),
    "too few names": (ConfigError, lambda: data(np.column_stack([U, Y, Y]), inputs="u", outputs="y", sample_time=1)),
    "text": (ConfigError, lambda: data("file.csv", sample_time=1)),
    "three dimensions": (ConfigError, lambda: data(np.zeros((9, 2, 2)), sample_time=1)),
    "complex": (ConfigError, lambda: data((U, Y * 1j), sample_time=1)),
    "no such channel": (ChannelError, lambda: data({"u": U, "y": Y}, inputs="v", sample_time=1)),
    "unit of a stranger": (ChannelError, lambda: data((U, Y), units={"v": "V"}, sample_time=1)),
    "unknown unit": (UnitError, lambda: data((U, Y), units={"u": "Vo lt"}, sample_time=1)),
    "missing value": (TraceError, lambda: data((U, np.where(T[4] == T, np.nan, Y)), sample_time=1)),
    "uneven index": (TraceError, lambda: data(pd.DataFrame({"y": Y}, index=T**1.5))),
    "another sample time": (TraceError, lambda: data(pd.DataFrame({"y": Y}, index=T), sample_time=0.2)),
    "empty": (ConfigError, lambda: data((U[:0], Y[:0]), sample_time=1)),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_meant_is_refused(case: str) -> None:
    kind, make = REFUSED[case]
    with pytest.raises(kind) as caught:
        make()
    assert caught.value.remedy  # type: ignore[attr-defined]


def test_a_missing_value_may_be_masked() -> None:
    (trace,) = data((U, np.where(T[4] == T, np.nan, Y)), sample_time=1, repairs={"nan": "mask"})
    assert_array_equal(np.flatnonzero(~trace.usable_samples), [4])


@given(st.integers(2, 60), st.floats(0.05, 0.95))
def test_a_share_cuts_a_record_in_two_and_loses_nothing(n: int, share: float) -> None:
    y = np.arange(float(n))
    try:
        traces = data(y, sample_time=0.5, split=share)
    except (ConfigError, TraceError):
        assert min(round(share * n), n - round(share * n)) < 1
        return
    assert_array_equal(np.concatenate([trace["y"] for trace in traces]), y)
    assert traces.traces[1].start_time == 0.5 * len(traces.traces[0])


def test_what_a_masked_array_masks_is_missing_and_not_its_number() -> None:
    y = np.ma.masked_equal(np.where(np.arange(30) == 7, -1, np.arange(30)), -1)
    with pytest.raises(TraceError, match="a value is missing"):
        data((np.arange(30.0) % 4, y), sample_time=0.1)
    (trace,) = data((np.arange(30.0) % 4, y), sample_time=0.1, repairs={"nan": "interpolate"})
    assert trace["y"].tolist() == list(range(30))


@pytest.mark.parametrize("give", [lambda u, y: (u, y), lambda u, y: {"u": u, "y": y}])
def test_channels_of_different_lengths_are_said_to_be_so(give: Callable[..., object]) -> None:
    with pytest.raises(ConfigError, match="differ in length") as caught:
        data(give(np.arange(30.0), np.arange(29.0)), sample_time=0.1)
    assert "29 in y" in str(caught.value)


def test_two_series_whose_labels_differ_are_not_put_side_by_side() -> None:
    u, y = pd.Series(np.arange(30.0)), pd.Series(np.arange(30.0), index=np.arange(30)[::-1])
    with pytest.raises(ConfigError, match="different indexes"):
        data((u, y), sample_time=0.1)
    (trace,) = data(pd.DataFrame({"u": u, "y": y}), sample_time=0.1)
    assert trace["y"].tolist() == list(range(29, -1, -1))


def test_columns_are_named_by_their_numbers_and_by_their_levels() -> None:
    frame = pd.DataFrame(np.column_stack([U, Y]))
    for chosen in ({"inputs": [0], "outputs": [1]}, {"inputs": 0, "outputs": np.int64(1)}):
        assert data(frame, sample_time=0.1, **chosen).traces[0].channel_names == ("0", "1")
    frame.columns = pd.MultiIndex.from_tuples([("rig", "u"), ("rig", "y")])
    assert data(frame, inputs=[("rig", "u")], outputs=["rig.y"], sample_time=0.1).traces[0].channel_names == (
        "rig.u",
        "rig.y",
    )


@pytest.mark.parametrize(
    "step", [datetime.timedelta(milliseconds=100), np.timedelta64(100, "ms"), pd.Timedelta("0.1s")]
)
def test_a_sample_time_may_be_a_duration(step: object) -> None:
    assert data((np.arange(9.0), np.arange(9.0)), sample_time=step).traces[0].sample_time == 0.1


def test_a_sample_time_in_single_precision_is_the_number_that_was_written() -> None:
    assert data((U, Y), sample_time=np.float32(0.1)).sample_time == 0.1


def test_units_may_be_those_of_a_library() -> None:
    pint = pytest.importorskip("pint")
    registry = pint.UnitRegistry()
    for units in ({"u": registry.volt, "y": None}, [registry.volt, None]):
        assert [channel.unit for channel in data((U, Y), sample_time=1, units=units).channels] == ["volt", "1"]
    with pytest.raises(UnitError):
        data((U, Y), sample_time=1, units={"u": 5})  # type: ignore[dict-item]


@pytest.mark.parametrize("name", ["t", "Time", "seconds", "date", "T", "zeit"])
def test_a_channel_that_is_called_as_time_is_a_channel_where_it_is_asked_for(name: str) -> None:
    rng = np.random.default_rng(0)
    u, level = rng.uniform(-1, 1, 50), rng.uniform(18, 22, 50)
    for frame in ({"u": u, name: level}, {"clock [s]": 0.5 * np.arange(50), "u": u, name: level}):
        step = None if "clock [s]" in frame else 0.5
        (trace,) = data(frame, inputs="u", outputs=name, sample_time=step, units={name: "degC"})
        assert trace.sample_time == 0.5
        assert_array_equal(trace[name], level)
    stamps = {"u": u, name: 0.5 * np.arange(50)}  # one that is both, as a ramp is
    (trace,) = data(stamps, inputs=name, outputs="u")
    assert trace.sample_time == 0.5


def test_a_column_that_rises_evenly_is_named_where_nothing_tells_the_sample_time() -> None:
    frame = pd.DataFrame({"sampling": 0.25 * np.arange(len(U)), "u": U, "y": Y})
    with pytest.raises(ConfigError, match=r"sampling rises evenly: .* write sample_time=0\.25$"):
        data(frame, inputs="u", outputs="y")
    with pytest.raises(ConfigError, match=r"write for example sample_time=0\.1$"):
        data(frame.drop(columns="sampling"), inputs="u", outputs="y")


@pytest.mark.parametrize(
    ("named", "expected"),
    [
        pytest.param({"outputs": ["a", "b"]}, ("u1", "u2", "a", "b"), id="outputs"),
        pytest.param({"inputs": ["c", "d"]}, ("c", "d", "y1", "y2"), id="inputs"),
    ],
)
def test_who_names_one_half_of_a_pair_has_the_other_too(named: dict[str, list[str]], expected: tuple[str, ...]) -> None:
    """The half that was not named had been left out without a word."""
    pair = np.arange(40.0).reshape(20, 2), -np.arange(40.0).reshape(20, 2)
    trace = data(pair, sample_time=0.1, **named).traces[0]
    assert trace.channel_names == expected
    np.testing.assert_array_equal(trace.values, np.column_stack(pair))
