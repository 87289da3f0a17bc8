"""A text file as lines, a block at a time: encoding, ends of lines, and bounds before memory."""

from __future__ import annotations

import codecs
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sysid.errors import ReaderError

LONGEST_LINE = 1_000_000
"""Characters; a table of numbers of a thousand columns has some 20,000."""

_CHUNK = 1 << 20
_BLOCK = 4 << 20
_HEAD = 1 << 18
_HEAD_LINES = 1000
_MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass(frozen=True, kw_only=True)
class Block:
    r"""Whole lines of a file.

    Args:
        line: Number of its first line, from 1.
        text: The lines, each ended by ``\\n`` but for the file's last.
    """

    line: int
    text: str


@dataclass(frozen=True, kw_only=True)
class TextFile:
    """A text file that was looked through and can be read block by block.

    Args:
        path: The file.
        encoding: Its encoding.
    """

    path: Path
    encoding: str

    def head(self) -> tuple[list[str], bool]:
        """Its first lines, and whether these are all."""
        whole = self.path.stat().st_size <= _HEAD
        blocks = self.blocks(size=_HEAD)
        text = "".join(block.text for block in blocks) if whole else next(blocks).text
        lines = text.split("\n")
        return lines[:_HEAD_LINES], whole and len(lines) <= _HEAD_LINES

    def blocks(self, *, skip: int = 0, size: int = _BLOCK) -> Iterator[Block]:
        r"""Its lines, some millions of characters at a time.

        Args:
            skip: How many lines are left out at the beginning.
            size: Bytes to be read at a time.

        Yields:
            Blocks of whole lines; every end of a line is ``\\n``.
        """
        line, rest = 1, ""
        for part in _decoded(self.path, self.encoding, size):
            text = rest + part if rest else part
            cut = text.rfind("\n") + 1
            whole, rest = text[:cut], text[cut:]
            while skip and whole:
                whole = whole.partition("\n")[2]
                skip, line = skip - 1, line + 1
            if whole:
                yield Block(line=line, text=whole)
                line += whole.count("\n")
        if rest and not skip:
            yield Block(line=line, text=rest)


def open_text(path: Path, encoding: str | None) -> TextFile:
    """Look through a text file without keeping it.

    Args:
        path: The file.
        encoding: Its encoding, or ``None`` to recognise it: a byte-order mark, else UTF-8, else
            Windows-1252.

    Returns:
        The file, to be read block by block.

    Raises:
        ReaderError: If it is not text in that encoding, or one of its lines is too long for a table.
    """
    with path.open("rb") as file:
        start = file.read(4)
    marked = next((name for mark, name in _MARKS if start.startswith(mark)), None)
    tries = [encoding] if encoding is not None else [marked] if marked else ["utf-8", "cp1252"]
    problem: Exception | None = None
    for name in tries:
        try:
            _look_through(path, name)
        except (UnicodeError, LookupError) as error:
            problem = error
            continue
        except ValueError as error:
            problem = error
            break
        return TextFile(path=path, encoding=name)
    raise ReaderError(
        "the file is not text",
        where=path,
        expected=f"text in {' or '.join(tries)}",
        got=problem,
        remedy="check that it is a CSV file, or name its encoding (encoding: cp1252, encoding: utf-16-le)",
    )


def _look_through(path: Path, encoding: str) -> None:
    line, length = 1, 0
    for text in _decoded(path, encoding, _CHUNK):
        if "\x00" in text:
            raise ValueError("it holds zero bytes")
        end = text.find("\n")
        length += len(text) if end < 0 else end
        if length > LONGEST_LINE:
            raise ReaderError(
                "a line is too long for a table",
                where=f"{path}, line {line}",
                expected=f"at most {LONGEST_LINE:,} characters in a line",
                got=f"more than {LONGEST_LINE:,}",
                remedy=f"look at it with: cut -c1-200 '{path}' | head -n {line}; export one line per sample, "
                "with a column per signal",
            )
        if end >= 0:
            line += text.count("\n")
            length = len(text) - text.rfind("\n") - 1


def _decoded(path: Path, encoding: str, size: int) -> Iterator[str]:
    if not getattr(codecs.lookup(encoding), "_is_text_encoding", True):
        raise LookupError(f"{encoding} is no encoding of text")
    decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)(), translate=True)
    first = True
    with path.open("rb") as file:
        while True:
            chunk = file.read(size)
            text = decoder.decode(chunk, final=not chunk)
            # An encoding that was asked for may leave the byte-order mark in the text.
            if first and text:
                text, first = text.removeprefix("\ufeff"), False
            if text:
                yield text
            if not chunk:
                return
