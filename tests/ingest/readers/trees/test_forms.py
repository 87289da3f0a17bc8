"""Cells in cells, sheets in cells, and matrices that bring their clock."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import sysid
from sysid.ingest.inspecting.undescribed import GuessedWarning
from sysid.traces import Trace

N = 30
T = np.arange(N) / 10
U = np.repeat([1.0, 3.0, 2.0], 10)
Y = np.round(np.convolve(U, 0.2 * 0.8 ** np.arange(N))[:N], 4)


def loaded(path: Path) -> tuple[Trace, ...]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GuessedWarning)
        return sysid.load(path).traces


def of_matlab(path: Path, **variables: Any) -> tuple[Trace, ...]:
    savemat(path / "a.mat", variables)
    return loaded(path / "a.mat")


def cell(*parts: Any) -> np.ndarray:
    found = np.empty(len(parts), dtype=object)
    for index, part in enumerate(parts):
        found[index] = part
    return found


def test_cells_in_cells_are_records_of_columns_without_names(tmp_path: Path) -> None:
    pairs = [cell(U[:size, None], Y[:size, None]) for size in (20, N)]
    first, second = of_matlab(tmp_path, runs=cell(*pairs), Ts=0.1)
    np.testing.assert_array_equal(first["column_2"], Y[:20])
    np.testing.assert_array_equal(second["column_1"], U)


def test_a_sheet_in_a_cell_array_is_a_table(tmp_path: Path) -> None:
    sheet = np.array(
        [["t", "u", "y"], *([float(t), float(u), float(y)] for t, u, y in zip(T, U, Y, strict=True))], object
    )
    (trace,) = of_matlab(tmp_path, raw=sheet)
    np.testing.assert_array_equal(trace["y"], Y)
    assert trace.sample_time == pytest.approx(0.1)


def test_a_list_of_units_beside_the_names_is_theirs(tmp_path: Path) -> None:
    (trace,) = of_matlab(tmp_path, data=np.stack([T, U, Y]), names=cell("t", "u", "y"), units=cell("ms", "V", "bar"))
    assert [channel.unit for channel in trace.channels] == ["V", "bar"]
    assert trace.sample_time == pytest.approx(1e-4)


def test_the_clock_in_front_of_each_matrix_is_one_time(tmp_path: Path) -> None:
    (trace,) = of_matlab(tmp_path, u=np.stack([T, U, U + 1], 1), y=np.stack([T, Y], 1))
    assert [channel.name for channel in trace.channels] == ["u_2", "u_3", "y"]
    np.testing.assert_array_equal(trace["y"], Y)


def test_matrices_of_numbered_runs_are_no_signals_of_one_record(tmp_path: Path) -> None:
    traces = of_matlab(tmp_path, run1=np.stack([T, U], 1), run2=np.stack([T, Y], 1))
    assert len(traces) == 2


def test_rows_by_their_stamps(tmp_path: Path) -> None:
    rows = {f"{t:.1f}": {"u": u, "y": y} for t, u, y in zip(T, U, Y, strict=True)}
    (tmp_path / "a.json").write_text(json.dumps(rows))
    (trace,) = loaded(tmp_path / "a.json")
    np.testing.assert_array_equal(trace["y"], Y)
    assert trace.sample_time == pytest.approx(0.1)
