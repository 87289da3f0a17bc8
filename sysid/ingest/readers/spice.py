"""The reader of waveforms of circuit simulators; what takes them apart is imported with the first."""

from __future__ import annotations

from pathlib import Path

from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.spice_waveforms import read  # here: most files are none of such

    return read(path)


def _is_mine(head: bytes) -> bool:
    plain = head.replace(b"\0", b"")
    return plain.startswith(b"Title:") and b"\nPlotname:" in plain


READER = Reader(name="spice", suffixes=(".raw",), read=_read, is_mine=_is_mine)
