"""A text file as lines, a block at a time: packed or not, ends of lines, encodings, and bounds before memory."""

from __future__ import annotations

import bz2
import codecs
import gzip
import lzma
import re
import zipfile
import zlib
from collections.abc import Callable, Generator, Iterable
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from sysid.errors import ReaderError

HEAD_LINES = 400
"""How many lines are looked at to tell how a file is laid out."""

LONGEST_LINE = 1_000_000
"""Characters; a table of numbers of a thousand columns has some 20,000."""

_BLOCK = 4 << 20
_NEWLINE = ord("\n")
_MINUS = "\N{MINUS SIGN}".encode()  # what a word processor or a locale makes of a hyphen before a number
_COUNTED = 1 << 17
_HEAD = 1 << 18
_ASCII_INSIDE = {"utf-8", "utf-8-sig", "cp1252", "iso8859-1", "iso8859-15", "ascii"}
_FEWEST_LINES = 8
_START = 256
_GARBLED = re.compile("[\u00a1-\u00ff]{3}|\ufffd")
_PACKED = (
    (b"\x1f\x8b", "gzip"),
    (b"BZh", "bzip2"),
    (b"\xfd7zXZ\x00", "xz"),
    (b"\x28\xb5\x2f\xfd", "zstd"),
    (b"PK\x03\x04", "zip"),
    (b"7z\xbc\xaf\x27\x1c", "7-Zip"),
)
_MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
PACKED_SUFFIXES = (".gz", ".bz2", ".xz", ".zip")
"""Endings of the files that are opened here."""

_OPEN: dict[bytes, Callable[[IO[bytes]], Any]] = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\x00": lzma.open}
_ZIP = b"PK\x03\x04"


@dataclass(frozen=True, kw_only=True)
class Block:
    r"""Whole lines of a file.

    Args:
        line: Number of its first line, from 1.
        lines: How many lines it has.
        data: The lines in UTF-8, each ended by ``\n`` but for the file's last.
    """

    line: int
    lines: int
    data: bytes

    @property
    def text(self) -> str:
        """The lines as text."""
        return self.data.decode()

    def joined(self, later: Block) -> Block:
        """This block and the one after it as one."""
        return Block(line=self.line, lines=self.lines + later.lines, data=self.data + later.data)


@dataclass(frozen=True, kw_only=True)
class TextFile:
    """A text file that is read block by block.

    Args:
        path: The file.
        encoding: Its encoding.
    """

    path: Path
    encoding: str

    @property
    def size(self) -> int:
        """About how many bytes it has."""
        return self.path.stat().st_size

    def head(self) -> tuple[list[str], bool]:
        """Its first lines, and whether these are all."""
        data, lines, whole = b"", 0, True
        with closing(self.blocks(size=_HEAD)) as blocks:
            for block in blocks:
                data, lines = data + block.data, lines + block.lines
                if len(data) >= _HEAD // 2 and lines >= _FEWEST_LINES:
                    whole = False
                    break
        texts = data.decode().split("\n")
        return texts[:HEAD_LINES], whole and len(texts) <= HEAD_LINES

    def blocks(self, *, skip: int = 0, size: int = _BLOCK) -> Generator[Block]:
        r"""Its lines, some millions of characters at a time.

        Args:
            skip: How many lines are left out at the beginning.
            size: Bytes to be read at a time.

        Yields:
            Blocks of whole lines; every end of a line is ``\n``.

        Raises:
            ReaderError: If a line is too long for a table.
            UnicodeError: If the file is not in its encoding.
        """
        line, rest = 1, b""
        with closing(_in_utf8(self.path, self.encoding, size)) as parts:
            for part in parts:
                cut = part.rfind(b"\n") + 1
                read = len(rest) + len(part)
                # One copy of a block, not two: views are joined.
                whole = b"".join([rest, memoryview(part)[:cut]]) if cut else b""
                rest = part[cut:] if cut else rest + part
                while skip and whole:
                    whole = whole.partition(b"\n")[2]
                    skip, line = skip - 1, line + 1
                lines = _newlines(whole)
                # Below that many bytes in all, no line among them can be too long.
                if read > lines * LONGEST_LINE or len(rest) > LONGEST_LINE:
                    self._check_lines(whole, rest, line)
                if whole:
                    yield Block(line=line, lines=lines, data=whole)
                    line += lines
        if rest and not skip:
            yield Block(line=line, lines=1, data=rest)

    def _check_lines(self, whole: bytes, rest: bytes, line: int) -> None:
        for index, text in enumerate([*whole.split(b"\n")[:-1], rest]):
            if len(text) <= LONGEST_LINE:
                continue
            raise ReaderError(
                "a line is too long for a table",
                where=f"{self.path}, line {line + index}",
                expected=f"at most {LONGEST_LINE:,} characters in a line",
                got=f"more than {LONGEST_LINE:,}",
                remedy=f"look at it with: head -n {line + index} '{self.path}' | cut -c1-200 | tail -n 1; "
                "export one line per sample, with a column per signal",
            )


def _newlines(data: bytes) -> int:
    """How many lines end in it."""
    # Byte by byte, since bytes.count stops at each one that it finds; by pieces that the processor's cache holds.
    view = np.frombuffer(data, dtype=np.uint8)
    return sum(int(np.count_nonzero(view[at : at + _COUNTED] == _NEWLINE)) for at in range(0, len(view), _COUNTED))


def encodings(path: Path, encoding: str | None) -> list[str]:
    """The encodings that a file may have.

    Args:
        path: The file.
        encoding: The one that was asked for, or ``None``.

    Returns:
        That one; else what a byte-order mark, or a zero in every other byte, says; else UTF-8 and, where that fails,
        Windows-1252.
    """
    if encoding is not None:
        return [encoding]
    with opened(path) as file:
        start = file.read(_START)
    marked = next((name for mark, name in _MARKS if start.startswith(mark)), None)
    if marked is None and b"\x00" in start:
        first, second = start[0::2].count(0), start[1::2].count(0)
        few, many = min(first, second), max(first, second)
        letters = start.translate(None, b"\x00")
        if (
            2 * many > 0.8 * len(start)
            and few == 0
            and letters.translate(None, b"\t\r\n").decode("latin-1").isprintable()
        ):
            marked = "utf-16-be" if first else "utf-16-le"
    return [marked] if marked else ["utf-8", "cp1252"]


def seems_garbled(names: Iterable[str]) -> bool:
    """Whether names were read in the wrong encoding: no western word has three letters beyond ASCII in a row.

    Args:
        names: As they were read in Windows-1252.

    Returns:
        Whether one seems to be.

    Example:
        >>> seems_garbled(["Âðåìÿ"]), seems_garbled(["Größe", "Débit (m³/h)"])
        (True, False)
    """
    return any(_GARBLED.search(name) for name in names)


def not_text(path: Path, tries: list[str], problem: Exception) -> ReaderError:
    """The error for a file that is not text.

    Args:
        path: The file.
        tries: The encodings that were tried.
        problem: What came of the last.

    Returns:
        The error to raise.
    """
    with opened(path) as file:
        begin = file.read(8)
    packed = next((kind for mark, kind in _PACKED if begin.startswith(mark)), None)
    if packed:
        return ReaderError(
            f"the file is packed with {packed}", where=path, expected="a file as it was recorded", got=f"{packed} data",
            remedy="unpack it, and give the file that was in it",
        )  # fmt: skip
    lost = ", take out what a logger wrote as it lost power (tr -d '\\000' < file > clean.csv)"
    clean = lost if isinstance(problem, ZeroBytesError) else ""
    return ReaderError(
        "the file is not text",
        where=path,
        expected=f"text in {' or '.join(tries)}",
        got=problem,
        remedy=f"check that it is a CSV file{clean}, or name its encoding "
        "(encoding: cp932 for Japanese, gb18030, big5, cp949, cp1251, cp1250, utf-16-le)",
    )


class ZeroBytesError(ValueError):
    """The file holds zero bytes, as no text does."""


def _in_utf8(path: Path, encoding: str, size: int) -> Generator[bytes]:
    """The file in UTF-8, with one kind of line ends."""
    if not getattr(codecs.lookup(encoding), "_is_text_encoding", True):
        raise LookupError(f"{encoding} is no encoding of text")
    decoder = codecs.getincrementaldecoder(encoding)()
    plain = codecs.lookup(encoding).name in _ASCII_INSIDE
    held = b""
    with opened(path) as file:
        while True:
            chunk = file.read(size)
            # ASCII is as it is in these encodings, and need not be decoded.
            as_is = plain and chunk.isascii() and not decoder.getstate()[0]
            data = chunk if as_is and chunk else decoder.decode(chunk, final=not chunk).encode()
            if not as_is:
                # Marks of the byte order stand before every line where a logger opens its file anew for each.
                data = data.replace(_MINUS, b"-").replace(codecs.BOM_UTF8, b"")
            if b"\x00" in data:
                raise ZeroBytesError("it holds zero bytes")
            data, held = held + data, b""
            if b"\r" in data:
                if data.endswith(b"\r") and chunk:
                    data, held = data[:-1], b"\r"
                data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
            if data:
                yield data
            if not chunk:
                return


def bare_stem(path: Path) -> str:
    """A file's name without its ending, and without that of what it is packed with.

    Args:
        path: The file.

    Returns:
        The name.

    Example:
        >>> bare_stem(Path("rig/run.1.csv.gz")), bare_stem(Path("run.csv"))
        ('run.1', 'run')
    """
    return Path(path.stem).stem if path.suffix.lower() in PACKED_SUFFIXES else path.stem


@contextmanager
def opened(path: Path) -> Generator[IO[bytes]]:
    """A file's bytes; of a packed one what is in it.

    Args:
        path: The file; one with an ending of its own is what it is, whatever it begins with.

    Yields:
        The open file.

    Raises:
        ReaderError: If a zip holds another number of files than one, or what is packed is damaged.
        OSError: If it cannot be read.
    """
    with path.open("rb") as file:
        head = file.read(6) if path.suffix.lower() in PACKED_SUFFIXES else b""
        file.seek(0)
        unpack = next((one for mark, one in _OPEN.items() if head.startswith(mark)), None)
        try:
            if unpack is not None:
                with unpack(file) as inner:
                    yield inner
            elif head.startswith(_ZIP):
                with zipfile.ZipFile(file) as archive, archive.open(_only_file(archive, path)) as inner:
                    yield inner
            else:
                yield file
        except (EOFError, gzip.BadGzipFile, lzma.LZMAError, zlib.error, zipfile.BadZipFile) as error:
            raise ReaderError(
                "the packed file cannot be unpacked", where=path, expected="a whole file",
                got=str(error) or type(error).__name__, remedy="copy it again, or unpack it by hand",
            ) from error  # fmt: skip


def _only_file(archive: zipfile.ZipFile, path: Path) -> zipfile.ZipInfo:
    files = [one for one in archive.infolist() if not one.is_dir() and not one.filename.startswith("__MACOSX/")]
    if len(files) == 1 and not files[0].flag_bits & 1:
        return files[0]
    raise ReaderError(
        "the zip has a password" if len(files) == 1 else f"the zip holds {len(files)} files",
        where=path,
        expected="one table of text",
        got=", ".join(one.filename for one in files[:5]) or "nothing",
        remedy="unpack it, and name the files: in a dataset.yaml each is a case",
    )
