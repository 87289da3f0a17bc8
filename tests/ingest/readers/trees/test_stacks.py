"""Records that are stacked in arrays of three dimensions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

import sysid
from sysid.errors import ReaderError
from sysid.ingest import inspect_file, read_table

N, R = 40, 3
T = np.arange(N) / 10
RNG = np.random.default_rng(0)
U, Y = RNG.standard_normal((R, N, 1)), RNG.standard_normal((R, N, 2))


def npz(path: Path, **arrays: Any) -> Path:
    np.savez(path / "a.npz", **arrays)
    return path / "a.npz"


def mat(path: Path, **arrays: Any) -> Path:
    savemat(path / "a.mat", arrays)
    return path / "a.mat"


def hdf5(path: Path, **arrays: Any) -> Path:
    with h5py.File(path / "a.h5", "w") as file:
        for name, array in arrays.items():
            file[name] = array
    return path / "a.h5"


def along_the_last(array: np.ndarray) -> np.ndarray:
    return np.moveaxis(array, 0, -1)


LAYOUTS: dict[str, dict[str, Any]] = {
    "experiments, samples, channels": {"T": T, "U": U, "Y": Y},
    "no clock: samples are the most": {"Ts": 0.1, "U": U, "Y": Y},
    "an input that is a matrix": {"Ts": 0.1, "U": U[:, :, 0], "Y": Y},
    "experiments last, as cat(3, ...) has them": {"T": T, "U": along_the_last(U), "Y": along_the_last(Y)},
    "fewer samples than experiments, with a clock": {
        "T": T[:5], "U": np.repeat(U[:, :5], 2, axis=0), "Y": np.repeat(Y[:, :5], 2, axis=0)
    },
    "derivatives of a sample less beside them": {"T": T, "U": U, "Y": Y, "dydt": Y[:, 1:]},
}  # fmt: skip


@pytest.mark.parametrize("write", [npz, mat, hdf5])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_stacked_arrays_are_records(tmp_path: Path, write: Callable[..., Path], layout: str) -> None:
    path = write(tmp_path, **LAYOUTS[layout])
    records = read_table(path).records
    repeated = 2 if layout.startswith("fewer") else 1
    assert [record.name for record in records] == [f"record_{k + 1}" for k in range(R * repeated)]
    for k, record in enumerate(records):
        columns = {column.name: column.values for column in record.table.columns}
        samples = len(record.table)
        np.testing.assert_array_equal(columns["U"], U[k // repeated, :samples, 0])
        np.testing.assert_array_equal(np.column_stack([columns["Y_1"], columns["Y_2"]]), Y[k // repeated, :samples])
    assert any("records along the" in note for note in inspect_file(path).problems)


def test_they_are_loaded_one_case_each(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="3 records along the first side, as U is 3 x 40 x 1"):
        traces = sysid.load(npz(tmp_path, T=T, U=U, Y=Y))
    assert len(traces.traces) == R
    np.testing.assert_array_equal(traces["record_2"]["Y_2"], Y[1, :, 1])


REFUSED: dict[str, Any] = {
    "samples first, and either side may be records": RNG.standard_normal((N, 2, 3)),
    "samples last, as a signal that is a matrix": RNG.standard_normal((2, 3, N)),
    "no side is the longest": RNG.standard_normal((9, 9, 2)),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_may_be_anything_is_refused_and_the_remedy_works(tmp_path: Path, case: str) -> None:
    np.save(tmp_path / "a.npy", REFUSED[case])
    with pytest.raises(ReaderError, match="an array of 3 dimensions") as refused:
        sysid.load(tmp_path / "a.npy")
    assert "called run_1, run_2" in str(refused.value.remedy)
    path = npz(tmp_path, run_1=Y[0], run_2=Y[1])
    assert [len(record.table) for record in read_table(path).records] == [N, N]


def test_from_memory_the_remedy_for_stacks_works() -> None:
    with pytest.raises(sysid.errors.ConfigError) as refused:
        sysid.data((U, Y), sample_time=0.1)
    assert "list(zip(u, y))" in str(refused.value.remedy)
    assert len(sysid.data(list(zip(U, Y, strict=True)), sample_time=0.1).traces) == R
