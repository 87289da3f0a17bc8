"""How much memory a file may ask for before any of it is taken."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterable
from pathlib import Path

from sysid.errors import ReaderError

MOST_BYTES = 2**30
"""Of numbers as float64: what every file may hold, however small it is on disk."""

MOST_TIMES = 32
"""How many times its size on disk a file may hold beyond that; a recording is seldom packed closer."""


def allowed(path: Path) -> int:
    """Bytes of numbers that a file may claim to hold.

    Args:
        path: The file.

    Returns:
        Bytes.
    """
    return max(MOST_BYTES, MOST_TIMES * path.stat().st_size)


def check_claim(path: Path, shapes: Iterable[tuple[str, tuple[int, ...]]]) -> None:
    """Refuse a file that claims more numbers than it can hold, before they are read.

    Args:
        path: The file.
        shapes: Name and shape of each array in it.

    Raises:
        ReaderError: If an array, or all together, are larger than :func:`allowed`.
    """
    total, limit = 0, allowed(path)
    for name, shape in shapes:
        total += 8 * math.prod(max(int(side), 0) for side in shape)
        if total > limit:
            raise too_large(path, f"{total / 2**20:.0f} MB with {name} of {' x '.join(map(str, shape))}", limit)


def check_zip(path: Path) -> None:
    """Refuse an archive whose members unpack to more than a file may hold.

    Args:
        path: The archive.

    Raises:
        ReaderError: If they do.
    """
    limit = allowed(path)
    with zipfile.ZipFile(path) as archive:
        total = sum(member.file_size for member in archive.infolist())
    if total > limit:
        raise too_large(path, f"{total / 2**20:.0f} MB unpacked", limit)


def too_large(path: Path, got: str, limit: int) -> ReaderError:
    """The error for a file that claims more than it may.

    Args:
        path: The file.
        got: What it claims.
        limit: Bytes that it may hold.

    Returns:
        The error to raise.
    """
    return ReaderError(
        "the file claims to hold far more than its size says",
        where=path,
        expected=f"at most {limit / 2**20:.0f} MB of numbers in a file of {path.stat().st_size / 2**20:.3g} MB",
        got=got,
        remedy="check where the file comes from; if it is sound, export it uncompressed or in several files",
    )
