"""Text files that describe something, within bounds: what one would take as objects is counted before it is read.

For configurations and manifests, whose honest sizes are known; records of samples have bounds of their own.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

MOST_LEVELS = 64
"""Lists in lists: ours have fewer than ten."""
MOST_BYTES = 2**28
"""Of a file of JSON."""
MOST_OBJECTS = 2**30
"""Bytes of Python objects that JSON becomes."""
_OPENING, _ITEM = 96, 40  # bytes that a list or a mapping takes, and an item in one
_STRING = re.compile(rb'"(?:[^"\\]|\\.)*"')
_BLOCK = 2**20


def read_bounded(path: Path, *, most: int = MOST_BYTES) -> bytes:
    """The bytes of a file that is no larger than such a file can be.

    Args:
        path: The file.
        most: Bytes.

    Returns:
        Its content.

    Raises:
        ValueError: If it is larger; in words.
        OSError: If it cannot be read.
    """
    with path.open("rb") as file:
        raw = file.read(most + 1)
    if len(raw) > most:
        raise ValueError(f"it is larger than {most // 2**20} MB, which no such file is")
    return raw


def parse_json(raw: bytes) -> Any:
    """JSON in UTF-8, within bounds.

    Args:
        raw: The text.

    Returns:
        Plain data.

    Raises:
        ValueError: If it is not JSON, nests too deep, or would take too much memory; in words.

    Example:
        >>> parse_json(b'{"a": [1, 2]}')
        {'a': [1, 2]}
        >>> parse_json(b"[" * 1000 + b"]" * 1000)
        Traceback (most recent call last):
        ...
        ValueError: its lists lie more than 64 deep in each other
    """
    openings = raw.count(b"[") + raw.count(b"{")
    claimed = _OPENING * openings + _ITEM * (raw.count(b",") + openings)
    if claimed > MOST_OBJECTS:
        raise ValueError(f"it holds about {claimed // 2**20} MB of lists and numbers, which no such file does")
    # Brackets in a text count for nothing; texts are only taken out where they might have mattered.
    if openings > MOST_LEVELS and _levels(raw) > MOST_LEVELS and _levels(_STRING.sub(b"", raw)) > MOST_LEVELS:
        raise ValueError(f"its lists lie more than {MOST_LEVELS} deep in each other")
    return json.loads(raw.decode("utf-8-sig"))


def read_json(path: Path) -> Any:
    """The JSON values of a file, within bounds.

    Args:
        path: The file, UTF-8.

    Returns:
        Plain data.

    Raises:
        ValueError: As :func:`parse_json` and :func:`read_bounded`.
        OSError: If it cannot be read.
    """
    return parse_json(read_bounded(path))


def _levels(raw: bytes) -> int:
    """How deep brackets lie in each other, block by block, since a running sum takes eight bytes for each of one."""
    deepest = level = 0
    for start in range(0, len(raw), _BLOCK):
        block = np.frombuffer(raw, np.uint8, count=min(_BLOCK, len(raw) - start), offset=start)
        steps = np.isin(block, _OPEN).astype(np.int64) - np.isin(block, _CLOSE)
        levels = level + np.cumsum(steps)
        deepest, level = max(deepest, int(levels.max())), int(levels[-1])
    return deepest


_OPEN, _CLOSE = (np.frombuffer(marks, np.uint8) for marks in (b"[{", b"]}"))
