"""Digests of this package's own code, kept from one process to the next.

To take one parses some three hundred files: a second and a half of processor time at the start of every command that
looks for stored results. What it depends on is the text of the package, so a digest holds until some file of it is
written, made or removed. A file is known by its time and size, as the interpreter knows whether its bytecode holds.
The digests stand where that bytecode stands, and are taken anew wherever they cannot be read or written.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
from collections.abc import Callable, Iterator
from importlib.util import cache_from_source
from pathlib import Path

from sysid.atomic import replacing

_DIGEST = re.compile("[0-9a-f]{64}")


def kept_or_taken(home: Path, asked: object, take: Callable[[], str]) -> str:
    """A digest, from an earlier process where no file of the package has changed since.

    Args:
        home: The package's folder.
        asked: What it is a digest of; told apart by its ``repr``.
        take: Takes it.

    Returns:
        64 hexadecimal digits.
    """
    file, state = _file(home), state_of(home)
    key = hashlib.sha256(repr(asked).encode()).hexdigest()
    found = _read(file, state).get(key)
    if found is not None:
        return found
    taken = take()
    if not sys.dont_write_bytecode and state == state_of(home):
        _write(file, {"state": state, "digests": {**_read(file, state), key: taken}})
    return taken


def state_of(home: Path) -> str:
    """Which files of code a package has, and when each was written.

    Args:
        home: The package's folder; those of its folders that are packages count, to the bottom.

    Returns:
        64 hexadecimal digits.
    """
    sha = hashlib.sha256(sys.version.encode())  # another Python reads the same text as another tree
    for name, stat in sorted(_files(home, "")):
        sha.update(f"\n{name} {stat.st_mtime_ns} {stat.st_size} {stat.st_ino}".encode("utf-8", "surrogatepass"))
    return sha.hexdigest()


def _files(folder: Path, prefix: str) -> Iterator[tuple[str, os.stat_result]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                yield prefix + entry.name, entry.stat()
            elif entry.is_dir() and entry.name.isidentifier() and entry.name != "__pycache__":
                yield from _files(Path(entry.path), f"{prefix}{entry.name}/")


def _file(home: Path) -> Path:
    """Beside the bytecode of the package, wherever that is kept."""
    return Path(cache_from_source(str(home / "__init__.py"))).with_suffix(".digests.json")


def _read(file: Path, state: str) -> dict[str, str]:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        kept = found["digests"] if found["state"] == state else {}
        return {str(key): one for key, one in kept.items() if _DIGEST.fullmatch(one)}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):  # not there, or not ours
        return {}


def _write(file: Path, what: dict[str, object]) -> None:
    try:
        with replacing(file) as draft:
            draft.write_text(json.dumps(what), encoding="utf-8")
    except OSError:  # a package that is not ours to write in
        return
