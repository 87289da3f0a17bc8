"""Columns in the units asked for, and time in seconds: what is said is used, what is not said is not invented."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import UnitError
from sysid.ingest.assembling.in_units import clock_by_its_steps, in_unit, stamps_in_seconds
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import ColumnOptions, FileOptions
from sysid.ingest.tables.table import RawTable
from sysid.traces import Channel

FILE = Path("x.csv")


def clock(step: float, unit: str | None = None) -> RawTable:
    return RawTable(
        source=FILE, reader="csv", columns=(RawColumn(name="t", values=step * np.arange(9.0), unit=unit),), time="t"
    )


@pytest.mark.parametrize("declared", [{"column": "t [ms]"}, {"column": "t", "unit": "ms"}, "t [ms]"])
def test_a_unit_behind_the_name_of_the_time_column_is_its_unit(declared: object) -> None:
    files = FileOptions.model_validate({"time": declared})
    np.testing.assert_allclose(stamps_in_seconds(clock(20.0), files), 0.02 * np.arange(9))


@pytest.mark.parametrize(("step", "unit"), [(0.02, "s"), (20.0, "ms"), (2e4, "us"), (0.02 / 60.0, "min")])
def test_steps_that_are_a_models_tell_the_unit(step: float, unit: str) -> None:
    files, told = clock_by_its_steps(clock(step), FileOptions(), 0.02)
    assert files.time.unit == unit and told is not None and f"in {unit}" in told
    np.testing.assert_allclose(stamps_in_seconds(clock(step), files), 0.02 * np.arange(9))


@pytest.mark.parametrize("table", [clock(0.03), clock(0.02, "min"), clock(0.0)])
def test_other_steps_and_units_that_are_said_tell_nothing(table: RawTable) -> None:
    assert clock_by_its_steps(table, FileOptions(), 0.02) == (FileOptions(), None)


def test_a_column_without_a_unit_is_a_pure_number_or_refused() -> None:
    column = RawColumn(name="u", values=np.arange(3.0))
    values, note = in_unit(column, Channel(name="u", unit="1"), ColumnOptions(column="u"), FileOptions(), FILE)
    assert values.tolist() == [0.0, 1.0, 2.0] and note is None
    with pytest.raises(UnitError, match=r"(?s)no unit.*'u \[V\]'"):
        in_unit(column, Channel(name="u", unit="V"), ColumnOptions(column="u"), FileOptions(), FILE)
