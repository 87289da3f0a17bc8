"""HDF5 files: groups and tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, read_table
from tests.ingest.recordings import TIME, VOLT


def test_hdf5_groups_are_chosen_by_name(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        for group, factor in (("a", 1.0), ("b", 2.0)):
            file[f"{group}/time"], file[f"{group}/u"] = TIME, factor * VOLT
        file["text"] = "a remark"
    table = read_table(tmp_path / "run.h5", files=FileOptions(group="b"))
    np.testing.assert_array_equal(table.find("u").values, 2.0 * VOLT)
    with pytest.raises(ReaderError, match=r"(?s)no group c.*one of a, b"):
        read_table(tmp_path / "run.h5", files=FileOptions(group="c"))


def test_hdf5_tables_give_a_column_per_field(tmp_path: Path) -> None:
    import h5py

    table = np.zeros(5, dtype=[("time", "f8"), ("u", "i4")])
    table["time"], table["u"] = np.arange(5) / 10, np.arange(5)
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["log"] = table
    assert read_table(tmp_path / "run.h5").find("u").values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
