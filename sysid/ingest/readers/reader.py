"""What a reader is, and how one is chosen."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

from sysid.content import nearest_file
from sysid.errors import ConfigError, ReaderError
from sysid.ingest.tables.meaning import with_meaning
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.table import RawTable

_IS_TABLE = re.compile(rb"(?m)^[ \t|]*[-+]?\.?[0-9][-+0-9.,eE]*[ \t;,|]+[-+]?\.?[0-9][-+0-9.,eE]*[ \t;,|\r\n]")
"""A line that begins with two numbers."""
_NAMES_ITS_VALUES = re.compile(
    rb"(?m)^[^\n]*?\b(?P<name>[A-Za-z]\w*)\s?[:=]\s?[-+]?[.\d][^\n]*\n(?:[^\n]*\n){0,3}?[^\n]*?\b(?P=name)\s?[:=]\s?[-+]?[.\d]"
)
"""Lines of which two have a number behind the same name."""
_FAR = 1 << 18
"""Bytes among which such a line is looked for: instruments write all of their settings above it."""

_COMMON = {"reader", "time", "columns", "units", "references", "rows", "states", "long"}


@dataclass(frozen=True, kw_only=True)
class Reader:
    """A file format.

    Args:
        name: What the format is called in options and messages.
        suffixes: Endings of file names, lower case, with the dot.
        read: Reads a file; raises :class:`~sysid.errors.ReaderError` if it is not of this format.
        options: The fields of :class:`~sysid.ingest.tables.options.FileOptions` that mean something to it,
            besides those that mean something to all.
        is_mine: Whether a file is of this format, by its first 4,096 bytes; ``None`` where they do not tell.
        is_of: Whether a file is of this format by another beside it; ``None`` where there is no such.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[[Path, FileOptions, RepairOptions], RawTable]
    options: frozenset[str] = frozenset()
    is_mine: Callable[[bytes], bool] | None = None
    is_of: Callable[[Path], bool] | None = None


_PACKED = (b"\x1f\x8b", b"PK\x03\x04", b"BZh", b"\xfd7zXZ", b"7z\xbc\xaf", b"\x28\xb5\x2f\xfd")
"""How files of gzip, zip, bzip2, xz, 7-Zip and Zstandard begin."""


_IN_R = "in R: write.csv(as.data.frame(x), 'x.csv', row.names = FALSE)"
_ELSEWHERE = {
    **dict.fromkeys((".rda", ".rdata", ".rds"), _IN_R),
    ".ods": "save it in LibreOffice as .xlsx or CSV",
    **dict.fromkeys((".pkl", ".pickle"), "write it in Python by to_parquet or to_csv: nothing is unpickled here"),
    **dict.fromkeys((".nda", ".ndax", ".res", ".mpr"), "export it from the cycler's program as CSV or Excel"),
    ".ulg": "write it as CSV: pip install pyulog, then ulog2csv FILE",
}
"""What to do with files that are known, and read by others, though they look packed."""


def choose_reader(path: Path, readers: Sequence[Reader], name: str | None = None) -> Reader:
    """The reader for a file.

    Args:
        path: The file.
        readers: The readers to choose from.
        name: Name of the reader, if content and suffix are not to decide.

    Returns:
        The reader.

    Raises:
        ReaderError: If no reader knows the content or claims the suffix.
        ConfigError: If there is no reader of that name.
    """
    if name is not None:
        for reader in readers:
            if reader.name == name:
                return reader
        known = [reader.name for reader in readers]
        raise ConfigError.unknown(f"no reader named {name}", name, known, "correct reader", where=path)
    if (beside := next((one for one in readers if one.is_of is not None and one.is_of(path)), None)) is not None:
        return beside
    by_suffix = next((reader for reader in readers if path.suffix.lower() in reader.suffixes), None)
    head = _head(path)
    if by_suffix is not None and by_suffix.is_mine is not None and by_suffix.is_mine(head):
        return by_suffix
    by_content = next((reader for reader in readers if reader.is_mine is not None and reader.is_mine(head)), None)
    if by_content is None and (by_suffix is None or by_suffix.is_mine is not None):
        if by_suffix is not None:
            _check_no_markup(head, by_suffix, path)
        # Programs give tables of text any name: "a.xls", "a.mat" of save -ascii.
        if _IS_TABLE.search(_as_ascii(_head(path, _FAR))) or _NAMES_ITS_VALUES.search(_as_ascii(head)):
            by_content = next((reader for reader in readers if reader.name == "csv"), None)
    if by_content is not None or by_suffix is not None:
        return by_content or by_suffix  # type: ignore[return-value]  # one of them is there
    raise ReaderError(
        "no reader knows this kind of file",
        where=path,
        expected=f"a name that ends in {', '.join(suffix for reader in readers for suffix in reader.suffixes)}",
        got=path.suffix or "a name without an ending",
        remedy=_remedy(path, head),
    )


def _remedy(path: Path, head: bytes) -> str:
    elsewhere = _ELSEWHERE.get(path.suffix.lower())
    if elsewhere is not None or head.startswith(_PACKED):
        return elsewhere or "unpack it first: it is compressed"
    if head.startswith(b"RIFF"):
        return "export the traces to one of these (sound: scipy.io.wavfile.read and sysid.data)"
    as_text = "" if b"\0" in head else ", or, as it is text, name the reader: csv (--reader csv)"
    return f"export the traces to one of these{as_text}"


def _as_ascii(head: bytes) -> bytes:
    """The text in the head of a file, without what UTF-16 puts between its letters; nothing if it is no text."""
    plain = head[2:].replace(b"\0", b"") if head[:2] in {b"\xff\xfe", b"\xfe\xff"} else head
    return b"" if b"\0" in plain else plain


def _check_no_markup(head: bytes, reader: Reader, path: Path) -> None:
    if not _as_ascii(head).removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"<"):
        return
    raise ReaderError(
        "the file is a web page or XML, whatever its name says",
        where=path,
        expected=f"the format {reader.name}",
        got=_as_ascii(head)[:40].decode(errors="replace"),
        remedy="open it in Excel or LibreOffice, which read such files, and save it as .xlsx or CSV",
    )


def _head(path: Path, size: int = 4096) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(size)
    except OSError:
        return b""  # the reader says what is wrong


def read_with(reader: Reader, path: Path, files: FileOptions, repairs: RepairOptions) -> RawTable:
    """Read a file, refusing options that mean nothing to its reader.

    Args:
        reader: The reader.
        path: The file.
        files: How to read it.
        repairs: Which repairs the reader may make (``ragged``).

    Returns:
        The file as columns of numbers.

    Raises:
        ConfigError: If an option is given that the reader does not have.
        ReaderError: If the file is missing, cannot be read as what it claims to be, or is written to meanwhile.
    """
    strangers = sorted(files.model_fields_set - _COMMON - reader.options)
    if strangers:
        raise ConfigError(
            f"the option {', '.join(strangers)} means nothing for a {reader.name} file",
            where=path,
            expected=f"options among {', '.join(sorted(_COMMON | reader.options))}",
            got=", ".join(strangers),
            remedy="remove it",
        )
    if not path.is_file():
        near = nearest_file(path, reader.suffixes)
        raise ReaderError(
            "there is no such file",
            where=path,
            expected=f"a {reader.name} file",
            got="a folder" if path.is_dir() else "nothing at this path",
            remedy=f"did you mean {near.name}?"
            if near
            else "check the path; in a dataset.yaml it is relative to that file",
        )
    try:
        before = _state(path)
        table = with_meaning(reader.read(path, files, repairs), files)
        if before != _state(path):  # what was read is neither the old file nor the new one
            raise ReaderError(
                "the file was written to while it was read",
                where=path,
                expected="a file that stays as it is",
                got=f"{path.stat().st_size:,} bytes after {before[0]:,}",
                remedy="wait until it is written, or read a copy of it",
            )
        return table
    except OSError as error:
        raise ReaderError(
            f"the file cannot be read as {reader.name}",
            where=path,
            expected=f"a readable, whole {reader.name} file",
            got=str(error).splitlines()[0] if str(error) else type(error).__name__,
            remedy="check permissions, that the copy is complete, and that the ending tells the format",
        ) from error


def _state(path: Path) -> tuple[int, int]:
    stat = path.stat()
    return stat.st_size, stat.st_mtime_ns


@contextmanager
def silent() -> Iterator[None]:
    """Keep a library from telling in its log what our error or note says; in any number of threads at once."""
    with _SILENCE.lock:
        if _SILENCE.readers == 0:
            _SILENCE.before = logging.root.manager.disable
            logging.disable(logging.CRITICAL)
        _SILENCE.readers += 1
    try:
        yield
    finally:
        with _SILENCE.lock:
            _SILENCE.readers -= 1
            if _SILENCE.readers == 0:
                logging.disable(_SILENCE.before)


@dataclass
class _Silence:
    """Who reads silently now, and what was logged before the first of them came: the switch is one for all threads."""

    lock: Lock = field(default_factory=Lock)
    readers: int = 0
    before: int = 0


_SILENCE = _Silence()


def damaged(path: Path, kind: str, error: BaseException) -> ReaderError:
    """The error for a file that a library cannot make sense of.

    Args:
        path: The file.
        kind: What the file claims to be.
        error: What the library raised.

    Returns:
        The error to raise.
    """
    message = str(error).strip().splitlines()
    return ReaderError(
        f"the file is not a whole {kind} file",
        where=path,
        expected=f"a {kind} file",
        got=f"{type(error).__name__}: {message[0][:200]}" if message else type(error).__name__,
        remedy="check that the copy is complete and that the ending tells the format",
    )
