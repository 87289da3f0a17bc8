"""MDF4 files: groups of channels, each with time stamps of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, read_table
from tests.ingest.recordings import PIPE, TIME, VOLT


def test_mdf_groups_of_several_rates_are_joined_at_the_fastest(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(PIPE, TIME, name="BP", unit="kPa")], acq_name="fast")
        file.append([Signal(2.0 * TIME[::4], TIME[::4], name="ramp", unit="V")], acq_name="slow")
        file.append([Signal(np.arange(10), TIME[::4], name="gear")], acq_name="states")
        file.save(tmp_path / "run.mf4", overwrite=True)
    table = read_table(tmp_path / "run.mf4")
    np.testing.assert_array_equal(table.find("BP").values, PIPE)
    np.testing.assert_allclose(table.find("ramp").values[:37], 2.0 * TIME[:37], rtol=1e-12)
    assert table.find("ramp").values[37:].tolist() == [2.0 * TIME[36]] * 3  # held for its own step after its last
    assert table.find("gear").values.tolist() == np.repeat(np.arange(10.0), 4).tolist()
    assert table.notes == (
        "ramp: interpolated from 0.2 s onto the time stamps of BP, 0.05 s",
        "gear: held from 0.2 s onto the time stamps of BP, 0.05 s",
    )
    slow = read_table(tmp_path / "run.mf4", files=FileOptions(group="slow"))
    np.testing.assert_array_equal(slow.find("ramp").values, 2.0 * TIME[::4])
    with pytest.raises(ReaderError, match=r"(?s)no channel group c.*one of fast, slow"):
        read_table(tmp_path / "run.mf4", files=FileOptions(group="c"))


def test_mdf_groups_that_do_not_overlap_must_be_chosen(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(PIPE, TIME, name="BP")], acq_name="morning")
        file.append([Signal(VOLT, TIME + 100.0, name="u")], acq_name="evening")
        file.save(tmp_path / "run.mf4", overwrite=True)
    with pytest.raises(ReaderError, match=r"(?s)do not overlap.*morning \(0 to 1.95 s\).*files: \{group: morning\}"):
        read_table(tmp_path / "run.mf4")
    assert len(read_table(tmp_path / "run.mf4", files=FileOptions(group="morning"))) == 40


@pytest.mark.parametrize("name", ["run.mdf", "run.dat", "run.mf3", "run.x"])
def test_mdf_3_is_read_whatever_its_suffix(tmp_path: Path, name: str) -> None:
    from asammdf import MDF, Signal

    with MDF(version="3.30") as file:
        file.append([Signal(PIPE, TIME, name="BP", unit="kPa")])
        file.save(tmp_path / "made.mdf", overwrite=True)
    (tmp_path / "made.mdf").rename(tmp_path / name)
    np.testing.assert_array_equal(read_table(tmp_path / name).find("BP").values, PIPE)
