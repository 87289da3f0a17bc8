"""The reader of ASAM MDF measurement files; what takes them apart is imported with the first."""

from __future__ import annotations

from pathlib import Path

from sysid.ingest.readers.marks import MDF_MARKS
from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.mdf_groups import read  # here: most files are none of such

    return read(path, options)


READER = Reader(
    name="mdf4",
    suffixes=(".mf4", ".mdf", ".mf3", ".md3"),
    read=_read,
    options=frozenset({"group"}),
    is_mine=lambda head: head[:8] in MDF_MARKS and head[8:9].isdigit(),
)
