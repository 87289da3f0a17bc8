"""TDMS files: groups of channels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sysid.errors import ReaderError
from sysid.ingest import FileOptions, read_table
from tests.ingest.recordings import PIPE, TIME, VOLT


def test_tdms_groups_must_be_chosen(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([ChannelObject("a", "time", TIME), ChannelObject("a", "u", VOLT)])
        file.write_segment([ChannelObject("b", "time", TIME), ChannelObject("b", "u", PIPE)])
    with pytest.raises(ReaderError, match=r"(?s)several groups.*one of a, b"):
        read_table(tmp_path / "run.tdms")
    table = read_table(tmp_path / "run.tdms", files=FileOptions(group="b"))
    np.testing.assert_array_equal(table.find("u").values, PIPE)
