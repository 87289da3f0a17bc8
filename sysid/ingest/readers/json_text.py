"""The reader of JSON and JSON lines; what makes tables of their values is imported with the first."""

from __future__ import annotations

import re
from pathlib import Path

from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable

_OPENS = re.compile(rb'(?:\xef\xbb\xbf)?\s*(?:\{\s*"|\[\s*(?:\{\s*"|\[\s*["\d\[-]))')


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.json_tree import read  # here: most files are none of such

    return read(path, options)


READER = Reader(
    name="json",
    suffixes=(".json", ".jsonl", ".ndjson"),
    read=_read,
    options=frozenset({"group", "transpose"}),
    is_mine=lambda head: _OPENS.match(head) is not None,
)
