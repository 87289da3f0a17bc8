"""RawTable: what every reader returns, before units, time grid and repairs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ReaderError
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.time_columns import recognise_time


class RepeatedNamesError(ReaderError):
    """A file of which two columns have the same name.

    Args:
        columns: All columns, in file order.
        where: The file.
    """

    def __init__(self, columns: Sequence[RawColumn], *, where: Path) -> None:
        names = [column.name for column in columns]
        repeated = sorted(name for name, count in Counter(names).items() if count > 1)
        super().__init__(
            f"two columns are named {', '.join(repeated)}",
            where=where,
            expected="a different name for each column",
            got=", ".join(names),
            remedy="rename one in the file, or give names: [...] for all columns",
        )
        self.numbered = tuple(_numbered(columns))


def _numbered(columns: Sequence[RawColumn]) -> Iterator[str]:
    """The headers of columns with a number behind each name that stood before: p [bar], p 2 [psi]."""
    taken = {column.name for column in columns}
    seen = set[str]()
    for column in columns:
        name, number = column.name, 2
        while name in seen or (number > 2 and name in taken):
            name, number = f"{column.name} {number}", number + 1
        seen.add(name)
        yield f"{name} [{column.unit}]" if column.unit else name


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordChoice:
    """One of several records in a file.

    Args:
        name: What its case may be called.
        options: What a case of a ``dataset.yaml`` says to read it: ``columns``, ``group``, ``sheet`` ...
        table: The record.
    """

    name: str
    options: Mapping[str, Any]
    table: RawTable


@dataclass(frozen=True, kw_only=True, eq=False)
class RawTable:
    """A file as columns of numbers.

    Args:
        source: The file.
        reader: Name of the reader.
        columns: All of one length, names unique.
        time: Name of the column recognised as time, or ``None``.
        step: Seconds between rows, where the file says so in place of a time column.
        others: Columns of other lengths; :meth:`narrowed` brings those of one length together.
        records: The records that the file seems to hold, where they are several.
        lines: Line in the file of each row, shape ``(n_rows,)``, where the format has lines.
        notes: What the reader recognised or repaired, one sentence each.
        metadata: What else the file carries, as text.
        settings: Reader options as they were recognised (``separator``, ``decimal`` ...), so that a
            data-set description can write them down.
        origin: Where the numbers come from, as a sentence, where ``source`` is no file.
        by_solver: Whether its time stamps are the steps of a solver, so that none of them is a gap.
    """

    source: Path
    reader: str
    columns: tuple[RawColumn, ...]
    time: str | None = None
    step: float | None = None
    others: tuple[RawColumn, ...] = ()
    records: tuple[RecordChoice, ...] = ()
    lines: NDArray[np.integer[Any]] | None = None
    notes: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, object] = field(default_factory=dict)
    origin: str = ""
    by_solver: bool = False

    def __post_init__(self) -> None:
        if not self.columns or len(self.columns[0].values) == 0:
            raise ReaderError(
                "the file holds no samples",
                where=self.source,
                expected="at least one column of numbers",
                got="no rows" if self.columns else "no columns",
                remedy="check that the recording was saved, and that the options point at it",
            )
        unusable = [column.problem for column in (*self.columns, *self.others) if column.problem is not None]
        if len(unusable) == len(self.columns) + len(self.others):
            raise unusable[0]
        columns = (*self.columns, *self.others)
        if len({column.name for column in columns}) < len(columns):
            raise RepeatedNamesError(columns, where=self.source)

    def __len__(self) -> int:
        return len(self.columns[0].values)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, in file order."""
        return tuple(column.name for column in self.columns)

    def find(self, name: str) -> RawColumn:
        """The column of that name, written with its unit or without.

        Args:
            name: For example ``"BP"`` or ``"BP [kPa]"``.

        Returns:
            The column.

        Raises:
            ChannelError: If there is none; close names are suggested.
            ReaderError: If the column is there and cannot be used.
        """
        column = self._named(name)
        if column.problem is not None:
            raise column.problem
        if len(column.values) != len(self):
            raise _other_length(column, len(self), where=self.source)
        return column

    def _named(self, name: str) -> RawColumn:
        columns = (*self.columns, *self.others)
        for wanted in (name, parse_header(name).name):
            for column in columns:
                if column.name == wanted:
                    return column
        raise ChannelError([name], [column.name for column in columns], where=self.source)

    def narrowed(self, names: Sequence[str], time: str | None = None) -> RawTable:
        """The table of the columns asked for, whose length is compared among themselves alone.

        Args:
            names: Names of columns, as :meth:`find` takes them.
            time: Name of the time column; ``None`` is the one that was recognised, if it fits.

        Returns:
            This table, if all of them are of its own length; else one of the length that they have.

        Raises:
            ChannelError: If one is missing.
            ReaderError: If their lengths differ.
        """
        chosen = [self._named(name) for name in names]
        stamps = self._named(time) if time is not None else None
        asked = [*chosen, *([stamps] if stamps is not None else [])]
        lengths = {len(column.values) for column in asked if column.problem is None}
        if not lengths or lengths == {len(self)}:
            return self
        if len(lengths) > 1:
            most = Counter(len(column.values) for column in asked).most_common(1)[0][0]
            odd = next(column for column in asked if len(column.values) != most)
            raise _other_length(odd, most, where=self.source)
        (length,) = lengths
        alike = tuple(column for column in (*self.columns, *self.others) if len(column.values) == length)
        rest = tuple(column for column in (*self.columns, *self.others) if len(column.values) != length)
        known = {column.name for column in alike}
        own = stamps.name if stamps is not None else self.time if self.time in known else recognise_time(alike)
        return replace(self, columns=alike, others=rest, time=own, records=(), lines=None)

    def between(self, first: int, last: int | None) -> RawTable:
        """Some of the rows.

        Args:
            first: The first row, counted from 1.
            last: The last row, included; ``None`` is the end.

        Returns:
            The table of these rows.

        Raises:
            ReaderError: If there are no such rows.
        """
        stop = len(self) if last is None else last
        if not 1 <= first <= stop <= len(self):
            raise ReaderError(
                "rows names rows that the file does not have",
                where=self.source,
                expected=f"rows between 1 and {len(self)}",
                got=f"rows {first} to {'the end' if last is None else last}",
                remedy=f"correct rows, for example rows: [1, {len(self)}]",
            )
        part = slice(first - 1, stop)
        columns = tuple(replace(column, values=column.values[part]) for column in self.columns)
        reach = first if last is None else last
        others = tuple(
            replace(column, values=column.values[first - 1 : last])
            for column in self.others
            if len(column.values) >= reach
        )
        lines = self.lines[part] if self.lines is not None else np.arange(first, stop + 1)
        note = f"rows {first} to {stop} of {len(self)}"
        return replace(self, columns=columns, others=others, records=(), lines=lines, notes=(*self.notes, note))

    def place(self, row: int) -> str:
        """Where a row is, for messages.

        Args:
            row: Index of the row, from 0.

        Returns:
            For example ``"sample 12 (line 14)"``.
        """
        return f"sample {row}" if self.lines is None else f"sample {row} (line {int(self.lines[row])})"


def by_length(columns: Sequence[RawColumn]) -> tuple[tuple[RawColumn, ...], tuple[RawColumn, ...]]:
    """Columns of the length of the time column, or else of the commonest length, and the others.

    A time column that no other column is as long as says nothing.

    Args:
        columns: Columns of any lengths.

    Returns:
        Those of that length, and those of other lengths.
    """
    if not columns:
        return (), ()
    time = recognise_time(columns)
    sound = [column for column in columns if column.problem is None] or list(columns)
    lengths = Counter(len(column.values) for column in sound)
    # A clock that stands alone, as the tout of a workspace may, is that of something else.
    by_time = [n for column in columns if column.name == time and lengths[n := len(column.values)] > 1]
    usual = by_time[0] if by_time else max(lengths, key=lambda length: (lengths[length], length))
    alike = tuple(column for column in columns if len(column.values) == usual)
    return alike, tuple(column for column in columns if len(column.values) != usual)


def _other_length(column: RawColumn, usual: int, *, where: object) -> ReaderError:
    return column.problem or ReaderError(
        "a column has another length than the rest",
        where=f"{where}, column {column.name}",
        expected=f"{usual} samples",
        got=f"{len(column.values)} samples",
        remedy="give the columns of one record together (columns: {...} of the case), name the group that holds "
        "what belongs together, or export it with the others' time base",
    )


def beside(tables: Sequence[RawTable]) -> RawTable:
    """Files that each hold some columns of one record, as one table.

    Args:
        tables: One a file; the time of the first is that of all.

    Returns:
        The columns of all.

    Raises:
        ReaderError: If one has more rows than another, or a column of the same name.
    """
    first, *others = tables
    for table in others:
        if len(table) != len(first):
            raise ReaderError(
                "the files of one record have different lengths",
                where=table.source,
                expected=f"{len(first)} rows, as in {first.source.name}",
                got=f"{len(table)} rows",
                remedy="name the files that belong together, or give each case its rows",
            )
    return replace(
        first,
        columns=tuple(column for table in tables for column in table.columns),
        others=tuple(column for table in tables for column in table.others),
        notes=tuple(note for table in tables for note in table.notes),
    )
