"""MDF4 files: groups of channels, each with time stamps of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, read_table
from tests.ingest.recordings import PIPE, TIME, VOLT


def test_mdf4_groups_with_different_time_bases_must_be_chosen(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(PIPE, TIME, name="BP", unit="kPa")], acq_name="slow")
        file.append([Signal(VOLT[:9], 2.0 * TIME[:9], name="u", unit="V")], acq_name="fast")
        file.save(tmp_path / "run.mf4", overwrite=True)
    with pytest.raises(ReaderError, match=r"(?s)different time stamps.*slow \(40 samples\), fast \(9 samples\)"):
        read_table(tmp_path / "run.mf4")
    table = read_table(tmp_path / "run.mf4", files=FileOptions(group="fast"))
    np.testing.assert_array_equal(table.find("u").values, VOLT[:9])
