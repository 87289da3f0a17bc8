"""HDF5 files: groups and tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, inspect_file, read_table
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


def test_attributes_say_sample_time_and_names_of_columns(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        item = file.create_dataset("x", data=np.column_stack([TIME, VOLT]))
        item.attrs["columns"], item.attrs["fs"] = ["u", "y"], 20.0
        item.attrs["units"] = ["mV", "V"]
    table = read_table(tmp_path / "run.h5")
    assert [column.unit for column in table.columns] == ["mV", "V"]
    assert (table.names, table.step) == (("u", "y"), 0.05)


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ({"scale_factor": 0.5}, [1.0, 1.5, -0.5, 4.0]),
        ({"add_offset": 10.0}, [12.0, 13.0, 9.0, 18.0]),
        ({"missing_value": np.int16(-1)}, [2.0, 3.0, np.nan, 8.0]),
        ({"_FillValue": np.int16(-1), "scale_factor": 0.1, "add_offset": 1.0}, [1.2, 1.3, np.nan, 1.8]),
        ({"valid_range": np.array([0, 7], dtype="i2")}, [2.0, 3.0, np.nan, np.nan]),
        ({"valid_min": np.int16(3)}, [np.nan, 3.0, np.nan, 8.0]),
    ],
    ids=lambda given: "+".join(given) if isinstance(given, dict) else "",
)
def test_packed_numbers_are_unpacked(tmp_path: Path, attributes: dict[str, object], expected: list[float]) -> None:
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["y"] = np.array([2, 3, -1, 8], dtype=np.int16)
        file["y"].attrs.update(attributes)
    np.testing.assert_allclose(read_table(tmp_path / "run.h5").find("y").values, expected, rtol=1e-12)


def test_units_of_cf_and_time_since_a_date(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "run.nc", "w") as file:
        file["t"], file["q"] = TIME / 60.0, VOLT
        file["t"].attrs["units"], file["q"].attrs["units"] = "minutes since 2000-01-01 00:00", "kg m-3 s-1"
    table = read_table(tmp_path / "run.nc")
    assert (table.find("t").unit, table.find("q").unit) == ("min", "kg * m**-3 * s**-1")
    assert "t: minutes since 2000-01-01 00:00" in table.notes


def test_a_stand_in_of_fewer_digits_than_the_values_is_missing(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["time"], file["u"] = TIME, np.where(np.arange(len(VOLT)) == 1, 1e20, VOLT)
        file["u"].attrs["missing_value"] = np.float32(1e20)
    missing = np.isnan(read_table(tmp_path / "run.h5").find("u").values)
    assert np.flatnonzero(missing).tolist() == [1]


@pytest.mark.parametrize("kind", ["fixed", "of any length", "a table"])
def test_stamps_and_words_as_text_are_read(tmp_path: Path, kind: str) -> None:
    """A clock of text was left out without a word, and 1 s between samples was guessed."""
    import h5py

    n = 30
    stamps = [f"2024-01-01T00:00:{0.5 * k:06.3f}" for k in range(n)]
    valve, y = ["open" if k % 7 > 3 else "closed" for k in range(n)], np.arange(n) ** 2.0
    with h5py.File(tmp_path / "run.h5", "w") as file:
        if kind == "a table":
            rows = list(zip(*(map(str.encode, some) for some in (stamps, valve)), y, strict=True))
            file["log"] = np.array(rows, dtype=[("time", "S23"), ("valve", "S6"), ("y", "f8")])
        else:
            text = "S23" if kind == "fixed" else h5py.string_dtype()
            for name, some in (("time", stamps), ("valve", valve)):
                file.create_dataset(name, data=np.array(some, dtype=object if kind != "fixed" else "S23"), dtype=text)
            file["y"] = y
    read = inspect_file(tmp_path / "run.h5")
    assert read.sample_time == pytest.approx(0.5)
    table = read_table(tmp_path / "run.h5", files=FileOptions(states={"open": 1.0, "closed": 0.0}))
    assert table.find("valve").values.tolist() == [float(k % 7 > 3) for k in range(n)]
    assert table.find("y").values.tolist() == y.tolist()


def test_scales_of_no_convention_are_told_and_not_applied(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["t"] = TIME
        file["y"] = np.round(1000 * VOLT).astype(np.int16)
        file["y"].attrs.update({"gain": 0.001, "offset": 1.0})
    table = read_table(tmp_path / "a.h5")
    assert any("gain = 0.001, offset = 1" in note for note in table.notes)
    np.testing.assert_array_equal(table.find("y").values, np.round(1000 * VOLT))
