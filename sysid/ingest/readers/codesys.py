"""The reader of CODESYS's traces; what takes them apart is imported with the first."""

from __future__ import annotations

import re
from pathlib import Path

from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable

_MARK = re.compile(rb"(?m)^0\.Variable\s*;")


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.codesys_trace import read  # here: most files are none of such

    return read(path, options)


READER = Reader(
    name="codesys",
    suffixes=(),
    read=_read,
    options=frozenset({"encoding"}),
    is_mine=lambda head: _MARK.search(head) is not None,
)
