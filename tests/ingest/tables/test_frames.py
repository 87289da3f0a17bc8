"""Columns from memory: what is a number is one whatever holds it; what cannot be known is not guessed."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from decimal import Decimal
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
import torch
from numpy.testing import assert_array_equal

from sysid.errors import UserError
from sysid.ingest.memory.arrays import data

T = np.arange(20) * 0.5
U = np.where((np.arange(20) // 5) % 2, 3.0, 1.0)
Y = np.cumsum(U)
FRAME = pd.DataFrame({"t": T, "u": U, "y": Y})
NOW = datetime(2024, 5, 1, tzinfo=UTC)
RUNS = pd.MultiIndex.from_product([["a", "b"], range(10)])

SAME: dict[str, Any] = {
    "objects": FRAME.astype(object),
    "decimals": FRAME.assign(u=[Decimal(str(value)) for value in U]),
    "an Arrow table": pa.table({"t": T, "u": U, "y": Y}),
    "Arrow types": FRAME.convert_dtypes(dtype_backend="pyarrow"),
    "what loadmat gives": {"__header__": b"MATLAB", "t": T[:, None], "u": U[:, None], "y": Y[:, None]},
    "a MATLAB file of rows": {"t": T[None], "u": U[None], "y": Y[None]},
    "durations as objects": FRAME.assign(t=pd.Series([timedelta(seconds=s) for s in T], dtype=object)),
    "times of day": FRAME.assign(t=[(NOW.replace(hour=1) + timedelta(seconds=s)).time() for s in T]),
    "series with labels of time": {"u": pd.Series(U, index=T), "y": pd.Series(Y, index=T)},
    "periods": pd.DataFrame({"u": U, "y": Y}, index=pd.period_range("2024-01-01", periods=20, freq="500ms")),
    "times as objects": FRAME.assign(t=pd.Series([NOW + timedelta(seconds=s) for s in T], dtype=object)),
    "ns since 1970": FRAME.assign(t=(1_700_000_000_000_000_000 + (T * 1e9).astype(np.int64))),
    "ms since 1970": FRAME.assign(t=1.7e12 + 1000 * T),
    "days since 1900": FRAME.assign(t=45_363 + T / 86_400),
    "an index that says its unit": pd.DataFrame({"u": U, "y": Y}, index=pd.Index(1e3 * T, name="t [ms]")),
    "an index with a unit in its name": pd.DataFrame({"u": U, "y": Y}, index=pd.Index(1e3 * T, name="t_ms")),
    "a column with a unit in its name": pd.DataFrame({"u": U, "y": Y, "t_ms": 1e3 * T}),
    "an index in ns": pd.DataFrame({"u": U, "y": Y}, index=1.7e18 + 1e9 * T),
}


@pytest.mark.parametrize("kind", SAME)
def test_numbers_and_times_are_known_whatever_holds_them(kind: str) -> None:
    (trace,) = data(SAME[kind], inputs="u", outputs="y")
    assert_array_equal(trace.values, np.column_stack([U, Y]))
    assert trace.sample_time == pytest.approx(0.5, rel=1e-6)


def test_tensors_of_types_that_numpy_has_not() -> None:
    (trace,) = data((torch.tensor(U).to_sparse(), torch.tensor(U, dtype=torch.bfloat16)), sample_time=0.5)
    assert_array_equal(trace.values, np.column_stack([U, U]))


@pytest.mark.parametrize("nothing", [None, pd.NA, float("nan"), pd.NaT])
def test_an_empty_cell_is_a_missing_value(nothing: Any) -> None:
    cells = [*Y[:7].tolist(), nothing, *Y[8:].tolist()]
    (trace,) = data({"u": U, "y": np.array(cells, dtype=object)}, sample_time=0.5, repairs={"nan": "mask"})
    assert_array_equal(np.flatnonzero(~trace.usable_samples), [7])


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "a name twice": (lambda: data(pd.concat([FRAME, FRAME[["u"]]], axis=1)), "two columns are named u"),
    "a name twice as text": (lambda: data(pd.DataFrame({"t": T, 1: U, "1": Y})), "two columns are named 1"),
    "a name in two units": (lambda: data(pd.DataFrame({"t": T, "u [V]": U, "u [A]": Y})), "two columns are named u"),
    "a channel on both sides": (lambda: data(FRAME, inputs="u", outputs="u"), "two columns are named u"),
    "an index of way": (lambda: data(FRAME[["u"]].set_index(pd.Index(T, name="x [mm]"))), "sample_time=0.1"),
    "two columns for a pair": (lambda: data([U, Y], sample_time=1), "sysid.data((u, y), ...)"),
    "rows dropped": (lambda: data(FRAME[["u"]].drop(index=[7, 8]), sample_time=1), "frame.reindex"),
    "rows shuffled": (lambda: data(FRAME[["u"]].sample(frac=1, random_state=0), sample_time=1), "frame.sort_index"),
    "rows backwards": (lambda: data(FRAME[["u"]].iloc[::-1], sample_time=1), "frame.sort_index"),
    "a row a dict": (lambda: data(FRAME.to_dict("records")), "pd.DataFrame(rows)"),
    "complex numbers": (lambda: data((U, Y + 1j), sample_time=1), "array.real"),
    "names in one word": (lambda: data(FRAME, inputs="u+y", outputs="y"), "['u', 'y'] where a list"),
    "two records as one": (lambda: data(pd.concat([FRAME, FRAME])[["u"]], sample_time=1), "a list of frames"),
    "levels of rows": (lambda: data(pd.DataFrame({"y": Y}, index=RUNS), sample_time=1), "frame.groupby"),
    "stamps as text": (lambda: data(FRAME[["u"]].set_index(np.array(["2024-01-01 00:00:00"] * 20))), "pd.to_datetime"),
    "rows dropped of a dict": (lambda: data({"u": FRAME["u"].drop(index=[7])}, sample_time=1), "frame.reindex"),
    "labels of a dict": (
        lambda: data({"u": FRAME["u"], "y": FRAME["y"][::-1]}, sample_time=1),
        "u and y have different indexes",
    ),
    "numbers as text": (lambda: data(FRAME.assign(u=[f"{x:.1f}".replace(".", ",") for x in U])), "pd.to_numeric"),
    "states as text": (lambda: data(FRAME.assign(u=np.where(U > 2, "ON", "OFF"))), "'OFF', 'OFF', 'OFF'"),
    "a tuple of three": (lambda: data((T, U, Y)), '{"t": t, "u": u, "y": y}'),
    "a column of columns": (lambda: data({"u": np.column_stack([U, U]), "y": Y}, sample_time=1), '"u1": u[:, 0]'),
    "a number beside columns": (lambda: data({"u": 1.0, "y": Y}, sample_time=1), "np.full(n, value)"),
    "no rows": (lambda: data(FRAME[FRAME.u > 9], inputs="u", outputs="y"), "the record holds no samples"),
    "ragged lists": (lambda: data(([1, [2, 3]], [1, 2]), sample_time=1), "lists of different lengths"),
    "a negative step": (lambda: data((U, Y), sample_time=-1), "greater than 0"),
    "an unknown repair": (lambda: data((U, Y), sample_time=1, repairs={"nans": "mask"}), "did you mean nan?"),
    "an unknown method": (lambda: data((U, Y), sample_time=1, grid={"method": "cubic"}), "linear"),
    "a word for a grid": (lambda: data((U, Y), sample_time=1, grid="linear"), "grid={"),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_known_is_refused_with_what_to_do(case: str) -> None:
    make, words = REFUSED[case]
    with pytest.raises(UserError) as caught:
        make()
    assert words in str(caught.value)


def test_each_remedy_for_rows_leads_on() -> None:
    dropped = FRAME[["u"]].drop(index=[7, 8])
    (trace,) = data(dropped.reindex(range(20)), sample_time=1, repairs={"nan": "mask"})
    assert trace.usable_samples.sum() == 18
    assert len(data(FRAME[["u"]].sample(frac=1, random_state=0).sort_index(), sample_time=1)["record"]) == 20
    frame = pd.DataFrame({"y": Y}, index=RUNS)
    runs = data({str(key): part.droplevel(0) for key, part in frame.groupby(level=0)}, sample_time=1)
    assert [(one.name, len(one)) for one in runs] == [("a", 10), ("b", 10)]


def test_a_pair_of_series_with_labels_of_time_needs_no_sample_time() -> None:
    trace = data((pd.Series(U, index=T), pd.Series(Y, index=T))).traces[0]
    assert trace.sample_time == pytest.approx(T[1] - T[0])
    assert_array_equal(trace["y"], Y)
