"""The rows of a text file to columns: a block at a time, by Arrow's reader where a block is plain, else row by row."""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError, shortened
from sysid.extras import has
from sysid.ingest.cells.calendar import Calendar
from sysid.ingest.cells.numbers import MISSING, NumberFormat
from sysid.ingest.cells.words import WordCollector
from sysid.ingest.readers.csv.cells import BLANKS, DATA, TOUCHING, Kind, Row, kind_of, split_rows, trimmed
from sysid.ingest.readers.csv.growing import Growing
from sysid.ingest.readers.csv.layout import Layout
from sysid.ingest.readers.sheets import SheetText
from sysid.ingest.readers.text_source import Block, TextFile
from sysid.ingest.tables.options import RepairOptions

_PLAIN_FROM = 100_000
"""Characters: below, importing Arrow takes longer than reading row by row."""

_MOST_FOOTER_LINES = 50
_QUOTED = re.compile(rb'"([^"\n,;\t| ]*)"')
_PLUS = re.compile(rb"(?<![eEdD0-9])\+(?=[0-9.])")
_BLANKS = re.compile(rb"[ \t]+")
_ENDS = re.compile(rb"^ | $", re.MULTILINE)
_TOUCHING = re.compile(TOUCHING.pattern.encode())
_FORTRAN = re.compile(rb"(?<=[0-9.,])[dD](?=[-0-9])")


def _buffer(array: Any, dtype: type[np.generic]) -> NDArray[Any]:
    """The numbers of an Arrow array without nulls; ``to_numpy`` would import pandas."""
    return np.frombuffer(array.buffers()[1], dtype=dtype)[array.offset : array.offset + len(array)]


class Column(Protocol):
    """A column that grows block by block."""

    def add(self, cells: Sequence[str], lines: NDArray[np.int32]) -> None:
        """Take a block of cells."""

    def add_arrow(self, array: Any) -> None:
        """Take a block that Arrow has read."""

    def arrow_type(self, arrow: Any) -> Any:
        """What Arrow shall read it as."""


@dataclass(kw_only=True)
class Numbers:
    """A column of numbers, with the texts in it that are none."""

    numbers: NumberFormat
    strange: dict[str, int] = field(default_factory=dict)
    values: Growing = field(default_factory=lambda: Growing(np.float64))
    bracketed: str = ""

    def add(self, cells: Sequence[str], lines: NDArray[np.int32]) -> None:
        """Take a block of cells."""
        values, strange = self.numbers.column_with_words(cells)
        if not self.bracketed and "(" in ",".join(cells):
            self.bracketed = next((cell.strip() for cell in cells if cell.strip()[:1] == "("), "")
        self.values.extend(values)
        for text, index in strange.items():
            self.strange.setdefault(text, int(lines[index]))

    def add_arrow(self, array: Any) -> None:
        """Take a block that Arrow has read."""
        for chunk in array.chunks:
            self.values.extend(_buffer(chunk.fill_null(np.nan) if chunk.null_count else chunk, np.float64))

    def arrow_type(self, arrow: Any) -> Any:
        """What Arrow shall read it as."""
        return arrow.float64()


@dataclass(kw_only=True)
class Counts:
    """A column of whole numbers that float64 cannot hold, counted from the first."""

    origin: int | None = None
    strange: dict[str, int] = field(default_factory=dict)
    values: Growing = field(default_factory=lambda: Growing(np.float64))

    def add(self, cells: Sequence[str], lines: NDArray[np.int32]) -> None:
        """Take a block of cells."""
        values = np.full(len(cells), np.nan)
        for index, cell in enumerate(cells):
            text = cell.strip()
            try:
                count = int(text) if text.isascii() and "_" not in text else None
            except ValueError:
                count = None
            if count is not None:
                self.origin = count if self.origin is None else self.origin
                values[index] = count - self.origin
            elif text.casefold() not in MISSING:
                self.strange.setdefault(text, int(lines[index]))
        self.values.extend(values)

    def add_arrow(self, array: Any) -> None:
        """Take a block that Arrow has read."""
        for chunk in array.chunks:
            counts = _buffer(chunk, np.int64)
            self.origin = int(counts[0]) if self.origin is None else self.origin
            self.values.extend(counts - self.origin)

    def arrow_type(self, arrow: Any) -> Any:
        """What Arrow shall read it as."""
        return arrow.int64()


@dataclass(kw_only=True)
class Texts:
    """A column of words."""

    collector: WordCollector

    def add(self, cells: Sequence[str], lines: NDArray[np.int32]) -> None:  # noqa: ARG002 - as every column
        """Take a block of cells."""
        self.collector.add(cells)

    def add_arrow(self, array: Any) -> None:
        """Take a block that Arrow has read."""
        coded = array.combine_chunks().dictionary_encode()
        coded = coded.combine_chunks() if hasattr(coded, "combine_chunks") else coded
        codes = _buffer(coded.indices.fill_null(-1), np.int32)
        self.collector.add_coded(codes, [str(text) for text in coded.dictionary.to_pylist()])

    def arrow_type(self, arrow: Any) -> Any:
        """What Arrow shall read it as."""
        return arrow.string()


@dataclass(kw_only=True)
class Stamps:
    """A column of calendar time."""

    calendar: Calendar
    problem: ReaderError | None = None
    rows: int = 0

    def add(self, cells: Sequence[str], lines: NDArray[np.int32]) -> None:
        """Take a block of cells."""
        self.rows += len(cells)
        if self.problem is None:
            try:
                self.calendar.add(cells, lines)
            except ReaderError as error:
                self.problem = error

    def add_arrow(self, array: Any) -> None:
        """Take a block that Arrow has read."""
        self.add([text or "" for text in array.to_pylist()], np.zeros(len(array), dtype=np.int32))

    def arrow_type(self, arrow: Any) -> Any:
        """What Arrow shall read it as."""
        return arrow.string()


AnyColumn = Numbers | Counts | Texts | Stamps


@dataclass(kw_only=True)
class Body:
    """The rows of a text file on their way into columns.

    Args:
        file: The file.
        layout: How it is laid out.
        columns: One a column of the file.
        comment: What a comment line begins with.
        repairs: Whether ragged rows may be dropped.
    """

    file: TextFile | SheetText
    layout: Layout
    columns: list[AnyColumn]
    comment: str
    repairs: RepairOptions
    notes: list[str] = field(default_factory=list)
    _lines: Growing = field(default_factory=lambda: Growing(np.int32))
    _ragged: list[int] = field(default_factory=list)

    def read(self) -> NDArray[np.int32]:
        """Read all blocks into the columns.

        Returns:
            The line of each row, shape ``(n_rows,)``.

        Raises:
            ReaderError: If rows are ragged, or quotes do not close.
        """
        with closing(self.file.blocks(skip=self.layout.skip)) as blocks:
            for block, last in _with_last(_whole_rows(blocks, self.file.path)):
                if not len(self._lines):
                    self._reserve(block)
                if not self._plain(block):
                    self._row_by_row(block, last=last)
        if self._ragged:
            self.notes.append(f"{len(self._ragged)} ragged rows dropped, first at line {self._ragged[0]}")
        return self._lines.whole()

    def _reserve(self, first: Block) -> None:
        """Room for as many rows as the file seems to have, by the length of its first lines."""
        expected = int(1.02 * self.file.size * first.lines / max(len(first.data), 1)) + 64
        self._lines = Growing(np.int32, expected)
        for column in self.columns:
            if isinstance(column, Numbers | Counts):
                column.values = Growing(np.float64, expected)

    def _plain(self, block: Block) -> bool:
        """Read a block by Arrow, if every one of its lines is a row and every cell is what its column holds."""
        numbers = self.layout.numbers
        if len(block.data) < _PLAIN_FROM or numbers.thousands is not None or numbers.states or not has("pyarrow"):
            return False
        import pyarrow as pa
        from pyarrow import csv as arrow_csv

        data = self._simplified(block.data)
        if b'"' in data:
            return False
        names = [str(index) for index in range(len(self.columns))]
        types = {name: column.arrow_type(pa) for name, column in zip(names, self.columns, strict=True)}
        options = {
            "read_options": arrow_csv.ReadOptions(column_names=names, block_size=1 << 20),
            "parse_options": arrow_csv.ParseOptions(delimiter=self.layout.separator, quote_char=False),
            "convert_options": arrow_csv.ConvertOptions(
                column_types=types,
                null_values=[*{*MISSING, "NaN", "NAN", "Nan", "-NaN", *numbers.missing}],
                strings_can_be_null=True,
                decimal_point=numbers.decimal,
            ),
        }
        try:
            table = arrow_csv.read_csv(pa.py_buffer(data), **options)
        except (pa.ArrowInvalid, pa.ArrowKeyError):
            return False
        counted = [table.column(i) for i, column in enumerate(self.columns) if isinstance(column, Counts)]
        blank = data[len(data.rstrip(b"\r\n")) :].count(b"\n") - 1  # lines after the last row
        if table.num_rows != block.lines - max(blank, 0) or any(column.null_count for column in counted):
            return False
        for index, column in enumerate(self.columns):
            column.add_arrow(table.column(index))
        self._lines.extend(np.arange(block.line, block.line + table.num_rows, dtype=np.int32))
        return True

    def _simplified(self, data: bytes) -> bytes:
        """A block without what Arrow does not know: quotes about plain cells, plus signs, runs of blanks."""
        if b'"' in data:
            data = _QUOTED.sub(rb"\1", data)
        if b"+" in data:
            data = _PLUS.sub(b"", data)
        if self.layout.separator == BLANKS:
            data = _ENDS.sub(b"", _BLANKS.sub(b" ", data))
            data = _TOUCHING.sub(b" -", data) if b"-" in data else data
        if (b"D" in data or b"d" in data) and all(isinstance(column, Numbers) for column in self.columns):
            data = _FORTRAN.sub(b"e", data)
        return data

    def _row_by_row(self, block: Block, *, last: bool) -> None:
        width = len(self.columns)
        ended = io.StringIO(block.text, newline="\n")
        found = split_rows(
            ended, self.layout.separator, line=block.line, comment=self.comment, path=self.file.path, width=width
        )
        rows = [Row(line=row.line, cells=trimmed(row.cells, width)) for row in found]
        rows = self._without_headers(rows)
        while last and rows and not any(rows[-1].cells):
            rows.pop()
        footer = self._footer(rows) if last else 0
        if footer:
            cut = rows[len(rows) - footer :]
            shown = self.layout.separator.join(cut[0].cells).replace("\t", " ").strip()[:60]
            told = "1 line" if footer == 1 else f"{footer} lines"
            self.notes.append(f"{told} after the numbers left out, the first, line {cut[0].line}: {shown!r}")
            rows = rows[: len(rows) - footer]
        ragged = [row for row in rows if len(row.cells) != width]
        if ragged and self.repairs.ragged is None:
            raise self._ragged_error(ragged, rows)
        self._ragged += [row.line for row in ragged]
        whole = [row for row in rows if len(row.cells) == width] if ragged else rows
        lines = np.array([row.line for row in whole], dtype=np.int32)
        self._lines.extend(lines)
        for index, column in enumerate(self.columns):
            column.add([row.cells[index] for row in whole], lines)

    def _without_headers(self, rows: list[Row]) -> list[Row]:
        """The rows without the header, where it comes again, as after a restart of the logger."""
        names = [name.strip() for name in self.layout.names]
        again = [row for row in rows if names and [cell.strip() for cell in row.cells] == names]
        begun = [row for row in rows if len(names) > 1 and row.cells and row.cells[0].strip() in names]
        other = [row for row in begun if row not in again and sorted(c.strip() for c in row.cells) == sorted(names)]
        if other:
            raise ReaderError(
                "the header comes again with its columns in another order",
                where=f"{self.file.path}, line {other[0].line}",
                expected=f"{', '.join(names)}, as in the first one",
                got=shortened(", ".join(cell.strip() for cell in other[0].cells)),
                remedy="part the file there, a file for each recording: what stands below is another column",
            )
        if not again:
            return rows
        self.notes.append(f"the header comes again in line {again[0].line} and is left out there")
        return [row for row in rows if row not in again]

    def _footer(self, rows: list[Row]) -> int:
        """How many rows at the end are no longer numbers."""
        leading = next((index for index, kind in enumerate(self.layout.kinds) if kind in DATA), 0)

        def foreign(row: Row) -> bool:
            kinds = [kind_of(cell) for cell in row.cells]
            whole = len(kinds) == len(self.columns)
            return kinds[leading] is Kind.WORD if whole else Kind.WORD in kinds

        tail = itertools.takewhile(foreign, reversed(rows[-_MOST_FOOTER_LINES:]))
        count = sum(1 for _ in tail)
        return count if count < len(rows) or len(self._lines) else 0

    def _ragged_error(self, ragged: list[Row], rows: list[Row]) -> ReaderError:
        width, first = len(self.columns), ragged[0]
        remedy = "correct the line or the separator, or ask for repairs: {ragged: drop}"
        if len(ragged) > len(rows) // 2:
            remedy = f"say where the table begins (skip_lines: {first.line}) or what separates its cells (separator)"
        return ReaderError(
            f"{len(ragged)} rows have too many or too few cells",
            where=f"{self.file.path}, line {first.line}",
            expected=f"{width} cells, as in the header"
            if self.layout.header
            else f"{width} cells, as in the first rows",
            got=f"{len(first.cells)} cells: {first.cells[:12]}",
            remedy=remedy,
        )


def _whole_rows(blocks: Iterator[Block], path: Path) -> Iterator[Block]:
    """Blocks that end where a row ends: a quoted cell may hold line breaks."""
    open_block: Block | None = None
    for block in blocks:
        joined = block if open_block is None else open_block.joined(block)
        if b'"' not in joined.data or joined.data.count(b'"') % 2 == 0:
            open_block = None
            yield joined
        elif len(joined.data) > 64_000_000:
            raise ReaderError(
                "the file cannot be split into cells",
                where=f"{path}, after line {joined.line}",
                expected="quotes in pairs",
                got="a quote that does not close within 64 million characters",
                remedy="close the quote, or take it out",
            )
        else:
            open_block = joined
    if open_block is not None:
        yield open_block


def _with_last(blocks: Iterator[Block]) -> Iterator[tuple[Block, bool]]:
    """Blocks, and whether it is the last; a short last one is joined to the one before, so that a footer is whole."""
    previous: Block | None = None
    for block in blocks:
        if previous is not None and len(block.data) < _PLAIN_FROM:
            previous = previous.joined(block)
            continue
        if previous is not None:
            yield previous, False
        previous = block
    if previous is not None:
        yield previous, True
