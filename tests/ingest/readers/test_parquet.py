"""Parquet files: calendar time, missing values, and integers that float64 cannot hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import read_table
from tests.ingest.recordings import TIME, VOLT


def test_parquet_calendar_time_becomes_seconds(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    stamps = np.datetime64("2024-05-01T10:00:00") + (1000 * TIME).round().astype("timedelta64[ms]")
    parquet.write_table(pa.table({"time": stamps, "u": VOLT, "remark": ["x"] * len(TIME)}), tmp_path / "run.parquet")
    table = read_table(tmp_path / "run.parquet")
    assert table.find("time").unit == "s"
    np.testing.assert_allclose(table.find("time").values, TIME, atol=1e-12)
    with pytest.raises(ReaderError, match="holds words"):
        table.find("remark")


def test_parquet_nulls_are_missing_values(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    parquet.write_table(pa.table({"t": [0.0, 1.0, 2.0], "n": pa.array([1, None, 3])}), tmp_path / "run.parquet")
    np.testing.assert_array_equal(read_table(tmp_path / "run.parquet").find("n").values, [1.0, np.nan, 3.0])


def test_integers_beyond_float64_are_refused_not_rounded(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    parquet.write_table(pa.table({"t": [0.0, 1.0], "n": [2**60 + 1, 5]}), tmp_path / "run.parquet")
    with pytest.raises(ReaderError, match="53 bits"):
        read_table(tmp_path / "run.parquet").find("n")


def test_columns_of_structures_are_a_column_for_each_field(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    inner = pa.array([{"gyro": {"x": value}, "n": 1.0} for value in VOLT])
    parquet.write_table(pa.table({"time": TIME, "imu": inner}), tmp_path / "run.parquet")
    np.testing.assert_array_equal(read_table(tmp_path / "run.parquet").find("imu.gyro.x").values, VOLT)
