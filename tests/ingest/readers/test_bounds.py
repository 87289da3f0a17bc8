"""Files that claim far more than they hold, or hold what is never read: refused in words, before memory is taken."""

from __future__ import annotations

import json
import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sysid.errors import ReaderError, TraceError
from sysid.ingest import inspect_file, propose_dataset, read_table
from sysid.ingest.readers import bounds, json_tree
from tests.ingest.readers.test_zoo_binary import proposed
from tests.ingest.readers.zoo_binary import TIME, U, Y, cells, hdf5, iddata, mat, npz, packed, workbook

MEGABYTE = 2**20


def endless_hdf5(path: Path) -> None:
    """A data set of 8 TB of which nothing was ever written."""
    hdf5(lambda file: file.create_dataset("u", shape=(10**12,), dtype="f8", chunks=(1024,)))(path)


def endless_npz(path: Path) -> None:
    """An array whose head claims 8 TB."""
    import zipfile

    head = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }".ljust(117) + "\n"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("u.npy", b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode())


def endless_mat4(path: Path) -> None:
    """A matrix whose head claims 8 TB."""
    path.write_bytes(np.array([0, 10**6, 10**6, 0, 2], dtype="<i4").tobytes() + b"u\0")


def brackets(path: Path) -> None:
    path.write_text("[" * 100_000)


@pytest.mark.parametrize(
    ("name", "make"),
    [("a.h5", endless_hdf5), ("a.npz", endless_npz), ("a.mat", endless_mat4), ("a.json", brackets)],
    ids=["HDF5", "npz", "MAT 4", "JSON of brackets"],
)
def test_what_a_file_claims_is_not_allocated(tmp_path: Path, name: str, make: Callable[[Path], None]) -> None:
    make(tmp_path / name)
    tracemalloc.start()
    try:
        with pytest.raises(ReaderError, match="remedy"):
            read_table(tmp_path / name)
        assert tracemalloc.get_traced_memory()[1] < 50 * MEGABYTE
    finally:
        tracemalloc.stop()


def zeros_in_mat(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"u": cells(np.zeros(2**20), np.zeros(2**20))}, do_compression=True)


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("a.mat", zeros_in_mat),
        ("a.npz", npz(u=np.zeros(2**21))),
        ("a.h5", hdf5(lambda file: file.create_dataset("u", data=np.zeros(2**21), compression="gzip"))),
        ("a.xlsx", workbook(*(f"run {index}" for index in range(3)))),
    ],
    ids=["MAT 5", "npz", "HDF5", "xlsx"],
)
def test_what_unpacks_to_more_than_a_file_may_hold_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, make: Callable[[Path], None]
) -> None:
    make(tmp_path / name)
    assert len(read_table(tmp_path / name)) > 1
    monkeypatch.setattr(bounds, "MOST_BYTES", 2**10)
    monkeypatch.setattr(bounds, "MOST_TIMES", 0.01)
    with pytest.raises(ReaderError, match=r"(?s)far more than its size.*export it uncompressed or in several files"):
        read_table(tmp_path / name)


def test_a_lone_cell_far_out_does_not_make_a_sheet_of_empty_ones(tmp_path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active["A1"], book.active["A2"], book.active["XFD50000"] = "u", 1.0, 2.0
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(ReaderError, match=r"8\.19e\+08 cells in the sheet Sheet"):
        read_table(tmp_path / "a.xlsx")


def test_a_link_into_another_file_is_not_followed(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["secret"] = U
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["u"], file["link"] = U, h5py.ExternalLink(str(tmp_path / "other.h5"), "/secret")
    assert read_table(tmp_path / "a.h5").names == ("u",)


def test_json_is_counted_before_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.json").write_text(json.dumps([[]] * 10_000))
    monkeypatch.setattr(json_tree, "_MOST_BYTES", 10_000)
    with pytest.raises(ReaderError, match="lists and numbers"):
        read_table(tmp_path / "a.json")


def test_a_time_stamp_that_is_nonsense_does_not_make_a_grid_without_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    npz(t=np.append(TIME, 1e15), u=np.append(U, 1.0), y=np.append(Y, 0.0))(tmp_path / "a.npz")
    text = propose_dataset(inspect_file(tmp_path / "a.npz"))
    with pytest.raises(TraceError, match="far too long for its samples") as caught:
        proposed(tmp_path / "a.npz")
    stop = re.search(r"stop: [0-9.e+]+", caught.value.remedy or "")
    assert stop is not None
    (tmp_path / "dataset.yaml").write_text(text.replace("file: a.npz", f"file: a.npz, {stop[0]}"))
    from sysid.ingest import load_dataset

    np.testing.assert_array_equal(load_dataset(tmp_path)["a"]["u"], U)


def frequency(path: Path) -> None:
    mat("5", z=iddata(U[:, None], Y[:, None], Domain="Frequency"))(path)


class Thing:
    """Anything but numbers."""


def pickled(**more: Any) -> Callable[[Path], None]:
    return lambda path: np.savez(path, thing=np.array([Thing(), Thing()], dtype=object), **more)


def test_a_pickle_in_an_archive_is_refused_and_its_remedy_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    pickled()(tmp_path / "a.npz")
    with pytest.raises(ReaderError, match=r"(?s)Python objects.*savez\('plain\.npz', t=\.{3}, u=\.{3}, y=\.{3}\)"):
        read_table(tmp_path / "a.npz")
    np.savez("plain.npz", t=TIME, u=U, y=Y)
    np.testing.assert_array_equal(proposed(tmp_path / "plain.npz")["plain"]["y"], Y)


def test_a_pickle_beside_numbers_does_no_harm_until_it_is_asked_for(tmp_path: Path) -> None:
    pickled(t=TIME, u=U)(tmp_path / "a.npz")
    table = read_table(tmp_path / "a.npz")
    np.testing.assert_array_equal(table.find("u").values, U)
    with pytest.raises(ReaderError, match="never loaded"):
        table.find("thing")


def test_iddata_over_frequency_is_refused_by_name(tmp_path: Path) -> None:
    frequency(tmp_path / "a.mat")
    with pytest.raises(ReaderError, match=r"(?s)frequency-domain.*ifft"):
        read_table(tmp_path / "a.mat")


def test_packed_numbers_are_unpacked_and_those_that_stand_for_nothing_are_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    hdf5(packed)(tmp_path / "a.h5")
    trace = proposed(tmp_path / "a.h5")["a"]
    assert [channel.unit for channel in trace.channels] == ["A", "V"]
    assert np.flatnonzero(~trace.usable_samples).tolist() == [7]
    kept = trace.usable_samples
    np.testing.assert_allclose(trace["y"][kept], Y[kept], atol=5e-4)
