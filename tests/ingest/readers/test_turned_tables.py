"""Tables whose head is numbers, that lie on their side or beside each other, and arrays that are no tables."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

import sysid
from sysid.errors import ReaderError
from sysid.ingest import inspect_file, read_table
from sysid.traces import Trace

N = 60
T = np.arange(N) / 10
U = np.repeat([1.0, 3.0, 1.0, 3.0, 3.0, 1.0], 10)
Y = np.round(np.convolve(U, 0.2 * 0.8 ** np.arange(N))[:N], 6)
TABLE = np.column_stack([T, U, Y])


def loaded(path: Path, *, u: str, y: str, step: float = 0.1) -> Trace:
    """The one record of a file, which is this one."""
    with pytest.warns(UserWarning):
        (trace,) = sysid.load(path).traces
    assert trace.sample_time == pytest.approx(step)
    np.testing.assert_allclose(trace[u], U)
    np.testing.assert_allclose(trace[y], Y)
    return trace


@pytest.mark.parametrize("options", [{}, {"index": False}, {"index": False, "sep": ";", "decimal": ","}])
def test_a_head_of_numbers_is_no_sample(tmp_path: Path, options: dict[str, object]) -> None:
    pd.DataFrame(TABLE).to_csv(tmp_path / "a.csv", **options)
    loaded(tmp_path / "a.csv", u="1", y="2")


def test_whole_numbers_behind_an_empty_cell_are_names(tmp_path: Path) -> None:
    pd.DataFrame({"10": U, "25": Y}).to_csv(tmp_path / "a.csv")
    loaded(tmp_path / "a.csv", u="10", y="25", step=1.0)


def test_samples_that_are_0_1_2_are_samples(tmp_path: Path) -> None:
    table = TABLE.copy()
    table[0] = 0.0, 1.0, 2.0
    np.savetxt(tmp_path / "a.csv", table, fmt="%g", delimiter=",")
    assert inspect_file(tmp_path / "a.csv").samples == N


SIDEWAYS: dict[str, tuple[Callable[[Path], None], str, str]] = {
    "a turned frame": (
        pd.DataFrame({"t": T, "u": U, "y": Y}).set_index("t").T.to_csv, "u", "y",
    ),
    "a turned frame of dates": (
        pd.DataFrame({"u": U, "y": Y}, index=pd.date_range("2024-03-12 08:15", periods=N, freq="100ms")).T.to_csv,
        "u", "y",
    ),
    "a turned frame of lengths of time": (
        pd.DataFrame({"u": U, "y": Y}, index=pd.to_timedelta(T, unit="s")).T.to_csv, "u", "y",
    ),
    "numbers alone": (lambda path: np.savetxt(path, TABLE.T), "column_2", "column_3"),
    "numbers and commas": (lambda path: np.savetxt(path, TABLE.T, delimiter=","), "column_2", "column_3"),
}  # fmt: skip


@pytest.mark.parametrize(("make", "u", "y"), SIDEWAYS.values(), ids=SIDEWAYS)
def test_lines_that_are_channels(tmp_path: Path, make: Callable[[Path], None], u: str, y: str) -> None:
    make(tmp_path / "a.csv")
    loaded(tmp_path / "a.csv", u=u, y=y)


def test_a_sheet_that_lies_on_its_side(tmp_path: Path) -> None:
    pd.DataFrame(TABLE.T, index=["t", "u", "y"]).to_excel(tmp_path / "a.xlsx", header=False)
    loaded(tmp_path / "a.xlsx", u="u", y="y")


def test_many_columns_of_few_samples_are_told(tmp_path: Path) -> None:
    pd.DataFrame(TABLE.T).to_csv(tmp_path / "a.csv")
    assert any("if channels stand in its rows" in one for one in inspect_file(tmp_path / "a.csv").problems)


def test_rows_by_name_and_columns_beside_values_are_tables(tmp_path: Path) -> None:
    frame = pd.DataFrame({"t": T, "u": U, "y": Y})
    (tmp_path / "index.json").write_text(frame.to_json(orient="index"), encoding="utf-8")
    series = {"columns": ["t", "u", "y"], "values": TABLE.tolist(), "name": "rig"}
    (tmp_path / "influx.json").write_text(json.dumps({"results": [{"series": [series]}]}), encoding="utf-8")
    for name in ("index.json", "influx.json"):
        loaded(tmp_path / name, u="u", y="y")


@pytest.mark.parametrize("apart", [0.0, 0.04])
def test_answers_of_data_bases_of_time_series_are_series(tmp_path: Path, apart: float) -> None:
    stamps = 1710231300.0 + T
    prometheus = [
        {"metric": {"__name__": name}, "values": [[t + late, repr(x)] for t, x in zip(stamps, values, strict=True)]}
        for name, values, late in (("u", U.tolist(), 0.0), ("y", Y.tolist(), apart))
    ]
    answer = {"status": "success", "data": {"resultType": "matrix", "result": prometheus}}
    (tmp_path / "prometheus.json").write_text(json.dumps(answer), encoding="utf-8")
    if apart:
        assert any("interpolated" in one for one in inspect_file(tmp_path / "prometheus.json").problems)
        return
    panel = [
        {"target": name, "datapoints": [[x, round(1e3 * t)] for t, x in zip(stamps, values.tolist(), strict=True)]}
        for name, values in (("u", U), ("y", Y))
    ]
    (tmp_path / "grafana.json").write_text(json.dumps(panel), encoding="utf-8")
    for name in ("prometheus.json", "grafana.json"):
        loaded(tmp_path / name, u="u", y="y")


def test_a_clock_beside_a_group_of_signals_is_not_simulinks(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["rec/time"], file["rec/signals/u"], file["rec/signals/y"] = T, U, Y
    loaded(tmp_path / "a.h5", u="rec/signals/u", y="rec/signals/y")


def test_a_channel_that_is_called_as_yaml_writes_true_is_one(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": T, "on": U, "off": Y})
    loaded(tmp_path / "a.mat", u="on", y="off")


def test_colheaders_name_columns_and_a_time_unit_scales_the_sample_time(tmp_path: Path) -> None:
    names = np.array([["time", "valve", "level"]], dtype=object)
    savemat(tmp_path / "a.mat", {"data": TABLE, "colheaders": names})
    loaded(tmp_path / "a.mat", u="valve", y="level")
    savemat(tmp_path / "b.mat", {"z": {"u": U, "y": Y, "Ts": 5.0, "TimeUnit": "milliseconds"}})
    loaded(tmp_path / "b.mat", u="u1", y="y1", step=0.005)


@pytest.mark.parametrize(("name", "step"), [("hours", 7200.0), ("ElapsedMillis", 0.002), ("time_h", 7200.0)])
def test_a_clock_that_is_called_by_its_unit_has_it(tmp_path: Path, name: str, step: float) -> None:
    pd.DataFrame({name: 2 * np.arange(N), "u": U, "y": Y}).to_csv(tmp_path / "a.csv", index=False)
    loaded(tmp_path / "a.csv", u="u", y="y", step=step)


def test_a_remedy_names_a_command_that_works(tmp_path: Path) -> None:
    rows = [f"{t:.1f};{u:.1f};{y:.3f}".replace(".", ",", 2) for t, u, y in TABLE]
    (tmp_path / "a.csv").write_text("\n".join(["t;u;y", *rows]), encoding="utf-8")
    with pytest.raises(ReaderError, match="decimal comma") as refused:
        sysid.load(tmp_path / "a.csv")
    assert "which proposes these options" not in str(refused.value.remedy)  # that command comes to the same error
    assert "Options are typed behind sysid ingest" in str(refused.value.remedy)


def beside(head: str, second: list[str]) -> str:
    """Two records side by side, of which the second may be shorter."""
    rows = [f"{t:.1f},{u},{y},{again}" for t, u, y, again in zip(T, U, Y, second, strict=True)]
    return "\n".join([head, *rows]) + "\n"


SHORTER = [f"{t:.1f},{y},{u}" if k < 40 else ",," for k, (t, u, y) in enumerate(zip(T, U, Y, strict=True))]


@pytest.mark.parametrize("head", ["t1,u1,y1,t2,u2,y2", "t [s],u [V],y [V],t [s],u [V],y [V]"])
def test_records_side_by_side_have_a_clock_each(tmp_path: Path, head: str) -> None:
    (tmp_path / "a.csv").write_text(beside(head, SHORTER), encoding="utf-8")
    with pytest.warns(UserWarning, match="2 records"):
        one, two = sysid.load(tmp_path / "a.csv").traces
    np.testing.assert_allclose(one["y"], Y)
    np.testing.assert_allclose(two["u"], Y[:40])


@pytest.mark.parametrize(
    ("head", "second"),
    [
        ("t1,u1,y1,t2,u2,y2", [f"{t:.1f},{y},{u}" for t, u, y in TABLE]),  # one clock, written again
        ("t,u1,y1,u2,y2,v", [f"{y},{u},{t}" for t, u, y in TABLE]),
    ],
)
def test_channels_of_one_clock_are_one_record(tmp_path: Path, head: str, second: list[str]) -> None:
    (tmp_path / "a.csv").write_text(beside(head, second), encoding="utf-8")
    assert read_table(tmp_path / "a.csv").records == ()
