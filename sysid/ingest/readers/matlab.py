"""The reader of MATLAB files; what goes through their variables is imported with the first."""

from __future__ import annotations

import struct
from pathlib import Path

from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.matlab_values import read  # here: most files are none of such

    return read(path, options)


def _is_mine(head: bytes) -> bool:
    if head.startswith(b"MATLAB 5.0 MAT-file") or head.startswith(b"MATLAB 7.3 MAT-file"):
        return True
    if len(head) < 20:
        return False
    # Version 4 has no mark: type, rows, columns, whether complex, length of the name that follows.
    for order in "<>":
        kind, rows, columns, imaginary, length = struct.unpack(f"{order}5i", head[:20])
        name = head[20 : 20 + length] if 1 < length < 64 else b""
        if (
            0 <= kind < 5000
            and kind % 10 < 3
            and kind // 10 % 10 < 6
            and rows >= 0
            and columns >= 0
            and imaginary in {0, 1}
            and name.endswith(b"\0")
            and name[:-1].replace(b"_", b"a").isalnum()
        ):
            return True
    return False


READER = Reader(
    name="matlab", suffixes=(".mat",), read=_read, options=frozenset({"group", "transpose"}), is_mine=_is_mine
)
