"""The reader of workbooks of Excel; what goes through their sheets is imported with the first."""

from __future__ import annotations

from pathlib import Path

from sysid.ingest.readers.marks import ZIP
from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable

_OLD = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_FIRST = (b"[Content_Types].xml", b"_rels/", b"docProps/", b"xl/")


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:
    from sysid.ingest.readers.workbook import read  # here: most files are none of such

    return read(path, options, repairs)


def _is_mine(head: bytes) -> bool:
    length = int.from_bytes(head[26:28], "little")
    return head.startswith(_OLD) or (head.startswith(ZIP) and head[30 : 30 + length].startswith(_FIRST))


READER = Reader(
    name="excel",
    suffixes=(".xlsx", ".xls", ".xlsm"),
    read=_read,
    options=frozenset({"sheet", "decimal", "thousands", "skip_lines", "header", "units_line", "names", "missing"}),
    is_mine=_is_mine,
)
