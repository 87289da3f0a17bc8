"""The reader of LabVIEW measurement files; what takes them apart is imported with the first."""

from __future__ import annotations

from pathlib import Path

from sysid.ingest.readers.marks import LABVIEW
from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.lvm_segments import read  # here: most files are none of such

    return read(path, options)


READER = Reader(
    name="lvm",
    suffixes=(".lvm",),
    read=_read,
    options=frozenset({"group", "encoding"}),
    is_mine=lambda head: head.removeprefix(b"\xef\xbb\xbf").startswith(LABVIEW.encode()),
)
