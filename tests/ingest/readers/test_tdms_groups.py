"""TDMS files: groups of channels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ChannelError, ReaderError
from sysid.ingest import FileOptions, read_table
from tests.ingest.recordings import PIPE, TIME, VOLT


def test_tdms_groups_with_the_same_channels_are_told_apart_by_name(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([ChannelObject("a", "time", TIME), ChannelObject("a", "u", VOLT)])
        file.write_segment([ChannelObject("b", "time", TIME + 1.0), ChannelObject("b", "u", PIPE)])
    table = read_table(tmp_path / "run.tdms")
    assert [record.options for record in table.records] == [{"group": "a"}, {"group": "b"}]
    with pytest.raises(ChannelError, match="one of a/time, a/u"):
        table.find("u")
    table = read_table(tmp_path / "run.tdms", files=FileOptions(group="b"))
    np.testing.assert_array_equal(table.find("u").values, PIPE)
    with pytest.raises(ReaderError, match=r"(?s)no group c.*one of a, b"):
        read_table(tmp_path / "run.tdms", files=FileOptions(group="c"))


def test_tdms_channels_with_clocks_of_their_own_are_joined(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    begin = np.datetime64("2024-05-01T10:00:00.000", "us")
    fast = {"wf_increment": 0.05, "wf_start_time": begin}
    late = {"wf_increment": 0.1, "wf_start_time": begin + np.timedelta64(100, "ms")}
    with TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([ChannelObject("a", "u", PIPE, properties=fast)])
        file.write_segment([ChannelObject("a", "y", 10.0 * (0.1 + 0.1 * np.arange(19)), properties=late)])
    table = read_table(tmp_path / "run.tdms")
    np.testing.assert_array_equal(table.find("u").values, PIPE)
    expected = 10.0 * np.minimum(TIME, 1.9)
    expected[TIME < 0.099] = np.nan
    np.testing.assert_allclose(table.find("y").values, expected, rtol=1e-12)


def test_tdms_units_as_ni_daqmx_writes_them(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment([ChannelObject("g", "p", VOLT, {"wf_increment": 0.1, "NI_UnitDescription": "bar"})])
    assert read_table(tmp_path / "a.tdms").find("p").unit == "bar"
