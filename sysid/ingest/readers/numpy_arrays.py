"""NumPy's own files: ``.npy`` (a vector, a matrix or a table) and ``.npz`` (several of them by name).

Nothing is unpickled: an array of objects is refused.
"""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.readers.bounds import check_claim
from sysid.ingest.readers.late import table_of
from sysid.ingest.readers.reader import Reader, damaged
from sysid.ingest.readers.trees.leaves import refused
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable

_MARK = b"\x93NUMPY"
_DAMAGES = (
    ValueError, OSError, EOFError, KeyError, TypeError, SyntaxError, OverflowError, RuntimeError,
    NotImplementedError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:  # noqa: ARG001 - one signature for all readers
    with path.open("rb") as file:
        single = file.read(6) == _MARK
    try:
        if single:
            # Mapped, not read: what the head claims beyond the end of the file is an error by itself.
            array = np.load(path, mmap_mode="r", allow_pickle=False)
            check_claim(path, [("the array", (*array.shape, len(array.dtype.names or ()) or 1))])
            tree = _named("column", array)
        else:
            _check_members(path)
            with np.load(path, allow_pickle=False) as arrays:
                tree = {name: _member(arrays, name, path) for name in arrays.files}
    except ReaderError:
        raise
    except _DAMAGES as error:
        if "allow_pickle" in str(error) or "Array can't be memory-mapped: Python objects" in str(error):
            raise _objects(path, "the array") from error
        raise damaged(path, "NumPy", error) from error
    return table_of(tree, path=path, reader="numpy", options=options)


def _member(arrays: Any, name: str, path: Path) -> Any:
    try:
        return _node(arrays[name])
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        return refused(_objects(path, name))


def _check_members(path: Path) -> None:
    """Refuse an archive whose arrays claim more than a file may hold, by their heads alone."""
    shapes: list[tuple[str, tuple[int, ...]]] = []
    with zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            shapes.append((member.filename, (member.file_size // 8,)))
            with archive.open(member) as file:
                version = np.lib.format.read_magic(file)
                read = {(1, 0): np.lib.format.read_array_header_1_0}.get(version, np.lib.format.read_array_header_2_0)
                shape, _, kind = read(file)
                if int(np.prod(shape, dtype=object)) * kind.itemsize > member.file_size and kind.kind != "O":
                    raise ValueError(f"{member.filename} claims {shape} in {member.file_size} bytes")
    check_claim(path, shapes)


def _named(name: str, array: NDArray[Any]) -> dict[str, Any]:
    node = _node(array)
    return node if isinstance(node, dict) else {name: node}


def _node(array: NDArray[Any]) -> Any:
    if array.dtype.names is not None:
        return {field: _node(array[field]) for field in array.dtype.names}
    return str(array) if array.ndim == 0 and array.dtype.kind in "US" else np.asarray(array)


def _objects(path: Path, name: str) -> ReaderError:
    return ReaderError(
        f"{name} holds Python objects, which are never loaded",
        where=path,
        expected="arrays of numbers",
        got="an array of objects (a pickle)",
        remedy="save plain arrays: numpy.savez('plain.npz', t=..., u=..., y=...), each with dtype float",
    )


def _is_mine(head: bytes) -> bool:
    if head.startswith(_MARK):
        return True
    length = int.from_bytes(head[26:28], "little")
    return head.startswith(b"PK\x03\x04") and head[30 : 30 + length].endswith(b".npy")


READER = Reader(
    name="numpy", suffixes=(".npy", ".npz"), read=_read, options=frozenset({"group", "transpose"}), is_mine=_is_mine
)
