"""The reader of National Instruments TDMS files; what takes them apart is imported with the first."""

from __future__ import annotations

from pathlib import Path

from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.tdms_groups import read  # here: most files are none of such

    return read(path, options)


READER = Reader(
    name="tdms",
    suffixes=(".tdms",),
    read=_read,
    options=frozenset({"group"}),
    is_mine=lambda head: head.startswith(b"TDSm"),
)
