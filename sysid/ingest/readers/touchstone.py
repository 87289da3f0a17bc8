"""The reader of Touchstone files (``.s1p``, ``.s2p`` ...) of network analysers; what takes them apart comes later."""

from __future__ import annotations

from pathlib import Path

from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.touchstone_ports import read  # here: most files are none of such

    return read(path)


READER = Reader(name="touchstone", suffixes=tuple(f".s{ports}p" for ports in range(1, 5)), read=_read)
