"""The reader of COMTRADE (IEEE C37.111), in which relays and fault recorders save; what takes it apart comes later."""

from __future__ import annotations

import re
from pathlib import Path

from sysid.ingest.readers.reader import Reader
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable

_COUNTS = re.compile(rb"[^\r\n]*\r?\n\s*\d+\s*,\s*\d+[Aa]\s*,\s*\d+[Dd]\s*\r?\n")
"""A station, then how many channels there are, analogue ones and states."""
_ONE_FILE = b"--- file type:"


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    from sysid.ingest.readers.comtrade_record import read  # here: most files are none of such

    return read(path, described=described_by(path))


def described_by(path: Path) -> Path | None:
    """The file beside one of samples that says what they are.

    Args:
        path: Any file.

    Returns:
        The ``.cfg`` of a ``.dat``; ``None`` where there is none, or it is of another kind.
    """
    if path.suffix.lower() != ".dat":
        return None
    for suffix in (".cfg", ".CFG", ".Cfg"):
        beside = path.with_suffix(suffix)
        if beside.is_file():
            with beside.open("rb") as file:
                return beside if _is_mine(file.read(4096)) else None
    return None


def _is_mine(head: bytes) -> bool:
    return _COUNTS.match(head) is not None or head.lstrip(b"\xef\xbb\xbf \r\n").startswith(_ONE_FILE)


READER = Reader(
    name="comtrade",
    suffixes=(".cfg", ".cff"),
    read=_read,
    is_mine=_is_mine,
    is_of=lambda path: described_by(path) is not None,
)
