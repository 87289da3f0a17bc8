"""Whether a MATLAB 5 file is whole, before a compiled reader sees it.

The reader of SciPy, which mat-io builds on, takes the types and sizes in a file for granted: a file with one wrong
byte ends the whole process. So every tag is looked at first, by the published layout of the format; numbers
themselves are passed over, and unpacked piece by piece without being kept. What the file claims is counted on the way.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from sysid.ingest.readers.bounds import allowed, too_large

_MATRIX, _COMPRESSED = 14, 15
_NUMERIC = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13})
_TEXT = _NUMERIC | {16, 17, 18}
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_HEAD, _DEEPEST, _PIECE = 128, 60, 2**20


def check_mat5(path: Path) -> None:
    """Go through a file of version 5, tag by tag; any other file is left alone.

    Args:
        path: The file.

    Raises:
        ReaderError: If it claims more numbers than a file of its size may.
        ValueError: If it is not whole; also zlib's and struct's errors.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD)
        mark = head[126:128]
        if len(head) < _HEAD or mark not in {b"IM", b"MI"} or head[:4] == b"\0\0\0\0":
            return
        order = "<" if mark == b"IM" else ">"
        if int.from_bytes(head[124:126], "little" if order == "<" else "big") != 0x0100:
            return
        (subsystem,) = struct.unpack(f"{order}Q", head[116:124])
        check = _Check(path, order)
        check.elements(file, subsystem=subsystem if 0 < subsystem < 2**48 else None)


class _Stream:
    """Bytes one after the other, of which as many are kept as are asked for."""

    def __init__(self, pull: Callable[[int], bytes]) -> None:
        self._pull = pull

    def take(self, count: int) -> bytes:
        parts, left = [], count
        while left > 0:
            part = self._pull(min(left, _PIECE))
            if not part:
                raise ValueError("the file breaks off inside a variable")
            parts.append(part)
            left -= len(part)
        return b"".join(parts)

    def skip(self, count: int) -> None:
        while count > 0:
            count -= len(self.take(min(count, _PIECE)))


def _unpacking(file: BinaryIO, length: int) -> _Stream:
    unpack, left, tail = zlib.decompressobj(), length, b""

    def pull(count: int) -> bytes:
        nonlocal left, tail
        while True:
            if not tail and left > 0:
                tail = file.read(min(left, 2**16))
                left -= len(tail) if tail else left
            piece = unpack.decompress(tail, count)
            tail = unpack.unconsumed_tail
            if piece or (not tail and left <= 0):
                return piece

    return _Stream(pull)


class _Check:
    """Goes through the elements of a file and counts the numbers that they claim."""

    def __init__(self, path: Path, order: str) -> None:
        self.path, self.order, self.limit, self.claimed = path, order, allowed(path), 0

    def elements(self, file: BinaryIO, *, subsystem: int | None = None) -> None:
        """The variables of a file, each of which may be packed."""
        while len(tag := file.read(8)) == 8:
            begin = file.tell() - 8
            kind, length = struct.unpack(f"{self.order}II", tag)
            end = begin + 8 + length
            stream = _Stream(file.read)
            if kind == _COMPRESSED:
                stream = _unpacking(file, length)
                kind, length = struct.unpack(f"{self.order}II", stream.take(8))
            if kind != _MATRIX:
                raise ValueError(f"an element of type {kind} where a variable should be")
            data = self.matrix(stream, length, keep=begin == subsystem)
            if data[:4] in {b"\0\1MI", b"\1\0IM"}:
                inner = _Check(self.path, "<" if data[2:4] == b"IM" else ">")
                inner.elements(BytesIO(data[8:]))
            file.seek(end)
            if file.tell() != end:
                raise ValueError("the file breaks off inside a variable")

    def matrix(self, stream: _Stream, size: int, depth: int = 0, *, keep: bool = False) -> bytes:
        """One variable, or what stands in one; returns its numbers where they are to be kept."""
        if size == 0:
            return b""
        if depth > _DEEPEST:
            raise ValueError(f"structures more than {_DEEPEST} deep")
        body = _Body(stream, size, self.order)
        (flags,) = struct.unpack(f"{self.order}I", body.small(frozenset({6}), 8)[:4])
        kind, is_complex = flags & 0xFF, bool(flags & 0x0800)
        if not 1 <= kind <= _OPAQUE:
            raise ValueError(f"a variable of the class {kind}, which there is not")
        if kind == _OPAQUE:
            self._rest(body, depth, _TEXT)
            return b""
        sides = body.small(frozenset({5}), None)
        shape = struct.unpack(f"{self.order}{len(sides) // 4}i", sides[: len(sides) // 4 * 4])
        if len(shape) < 2 or min(shape) < 0:
            raise ValueError(f"a variable of the shape {shape}")
        body.small(frozenset({1, 2, 16}), None)
        count = math.prod(shape)
        if kind in {_CELL, _STRUCT, _OBJECT, _FUNCTION}:
            self._children(body, kind, count, depth)
            return b""
        self._claim(count if kind != _SPARSE else 0, shape)
        if keep:
            return body.small(_NUMERIC, None)
        found = self._rest(body, depth, _TEXT if kind == _CHAR else _NUMERIC)
        wanted = (3 if kind == _SPARSE else 1) + is_complex
        if found < wanted:
            raise ValueError(f"{found} parts of a variable that has {wanted}")
        return b""

    def _children(self, body: _Body, kind: int, count: int, depth: int) -> None:
        wanted = 1 if kind == _FUNCTION else count
        if kind == _OBJECT:
            body.small(frozenset({1, 2, 16}), None)
        if kind in {_STRUCT, _OBJECT}:
            width = int.from_bytes(body.small(frozenset({5}), 4), "little" if self.order == "<" else "big")
            names = body.small(frozenset({1, 2, 16}), None)
            if not 0 < width <= 4096:
                raise ValueError(f"names of fields of {width} characters")
            wanted *= len(names) // width
        self._claim(wanted, (wanted,))
        found = 0
        while body.left >= 8:
            tag = body.tag()
            if tag[0] != _MATRIX:
                raise ValueError(f"an element of type {tag[0]} where a variable should be")
            self.matrix(body.stream, tag[1], depth + 1)
            body.left -= tag[1]
            found += 1
        if found != wanted:
            raise ValueError(f"{found} parts of a variable that has {wanted}")

    def _rest(self, body: _Body, depth: int, kinds: frozenset[int]) -> int:
        found = 0
        while body.left >= 8:
            kind, length, data = body.tag()
            if kind == _MATRIX and kinds is _TEXT:
                self.matrix(body.stream, length, depth + 1)
                body.left -= length
            elif kind in kinds:
                body.pass_over(length, data)
            else:
                raise ValueError(f"numbers of the type {kind}, which there is not")
            found += 1
        return found

    def _claim(self, count: int, shape: tuple[int, ...]) -> None:
        self.claimed += 8 * count
        if self.claimed > self.limit:
            claim = f"{self.claimed / 2**20:.0f} MB with a variable of {' x '.join(map(str, shape))}"
            raise too_large(self.path, claim, self.limit)


class _Body:
    """What is left of a variable."""

    def __init__(self, stream: _Stream, size: int, order: str) -> None:
        self.stream, self.left, self.order = stream, size, order

    def tag(self) -> tuple[int, int, bytes | None]:
        """Type and length of the next element, and its data where they stand in the tag."""
        if self.left < 8:
            raise ValueError("a variable ends before it is whole")
        head = self.stream.take(8)
        self.left -= 8
        kind, length = struct.unpack(f"{self.order}II", head)
        if kind >> 16:
            kind, length = kind & 0xFFFF, kind >> 16
            if length > 4:
                raise ValueError(f"{length} bytes in an element that has room for four")
            return kind, length, head[4 : 4 + length]
        if length > self.left:
            raise ValueError(f"an element of {length} bytes where {self.left} are left")
        return kind, length, None

    def pass_over(self, length: int, data: bytes | None) -> None:
        """Go on behind an element whose tag was taken."""
        if data is None:
            padded = min(-(-length // 8) * 8, self.left)
            self.stream.skip(padded)
            self.left -= padded

    def small(self, kinds: frozenset[int], length: int | None) -> bytes:
        """The data of the next element, which must be of one of these types."""
        kind, found, data = self.tag()
        if kind not in kinds or (length is not None and found != length):
            raise ValueError(f"an element of type {kind} with {found} bytes where another should be")
        if data is None:
            data = self.stream.take(found)
            padded = min(-(-found // 8) * 8, self.left) - found
            self.stream.skip(padded)
            self.left -= found + padded
        return data
