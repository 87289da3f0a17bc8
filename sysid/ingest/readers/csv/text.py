"""CSV and its relatives: any of the usual separators and decimal marks, units in the header or below it.

Comments of the form ``# key: value`` before the header, and lines of two cells in a preamble, become metadata.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.calendar import Calendar
from sysid.ingest.cells.headers import Header, parse_headers, split_reference
from sysid.ingest.cells.words import WordCollector, states_for
from sysid.ingest.readers.csv.above import NO_UNITS
from sysid.ingest.readers.csv.beside import records_beside
from sysid.ingest.readers.csv.body import AnyColumn, Body, Counts, Numbers, Stamps, Texts
from sysid.ingest.readers.csv.cells import MOST_LINES, Kind, unit_text
from sysid.ingest.readers.csv.layout import Layout, recognise
from sysid.ingest.readers.csv.rewritten import in_a_table
from sysid.ingest.readers.reader import Reader
from sysid.ingest.readers.sheets import SheetText
from sysid.ingest.readers.text_source import (
    PACKED_SUFFIXES,
    TextFile,
    ZeroBytesError,
    encodings,
    not_text,
    seems_garbled,
)
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.rates import said_step
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import is_called_time, recognise_time
from sysid.names import from_csv_cell

_MINUTES = re.compile(r"(?<![:\w])m{1,2}(?:in)?\s?:\s?s{1,2}(?:ec)?\b", re.IGNORECASE)
"""How a head says that a clock of two numbers has minutes and seconds: mm:ss, (min:s)."""
_MOST_TOLD = 6
"""Columns that are named in one note."""


def _read(path: Path, options: FileOptions, repairs: RepairOptions) -> RawTable:
    tries = encodings(path, options.encoding)
    problem: Exception = ValueError("it has no encoding")
    for encoding in tries:
        try:
            text = in_a_table(TextFile(path=path, encoding=encoding))
            table = table_of_text(text, options, repairs)
            if isinstance(text, SheetText):
                return replace(table, notes=(*text.notes, *table.notes))
            if encoding != "cp1252" or options.encoding is not None:
                return table
            from sysid.ingest.readers.csv.meant import meant_encoding  # here: most files are in UTF-8

            if (meant := meant_encoding(table.names)) is None:
                return table
            table = table_of_text(TextFile(path=path, encoding=meant), options, repairs)
            told = f"the names are words in {meant}, which is a guess (encoding: {meant})"
            return replace(table, notes=(*table.notes, told))
        except (UnicodeError, LookupError) as error:
            problem = error
        except ZeroBytesError as error:
            problem = error
            break
    raise not_text(path, tries, problem)


def table_of_text(file: TextFile | SheetText, options: FileOptions, repairs: RepairOptions) -> RawTable:
    """The table in a text.

    Args:
        file: The text.
        options: How to read it.
        repairs: Which repairs may be made.

    Returns:
        The table.

    Raises:
        ReaderError: If there is none in it.
    """
    path = file.path
    lines, whole = file.head()
    if (
        whole
        and sum(bool(line.strip()) and line.lstrip()[0] not in (options.comment or "#%") for line in lines)
        <= MOST_LINES
    ):
        from sysid.ingest.readers.csv.sideways import sideways  # here: most tables are longer

        if (lying := sideways(path, lines, comment=options.comment)) is not None:
            return lying
    layout = recognise(lines, options, path, whole=whole)
    headers = _headers(layout, options, path)
    time = _calendar_column(headers, layout, options)
    columns = [_column(i, header, layout, options, path, calendar=i == time) for i, header in enumerate(headers)]
    body = Body(file=file, layout=layout, columns=columns, comment=options.comment, repairs=repairs)
    rows = body.read()
    notes = [*layout.notes, *body.notes]
    if options.time.column is None and sum(isinstance(column, Stamps) for column in columns) > 1:
        from sysid.ingest.readers.csv.clock import running_on  # here: most tables have one

        time = running_on(columns, time)
    raw, guess = _finished(headers, columns, layout, path, notes, calendar=time)
    if layout.numbers.decimal != ".":
        notes.append("decimal comma")
    if file.encoding == "cp1252" and options.encoding is None and seems_garbled(layout.names):
        notes.append(
            "the names are no words in Windows-1252: name the encoding (encoding: gb18030, cp1251, cp1250, cp932 ...)"
        )
    clock = (headers[time].name or f"column_{time + 1}") if time is not None else recognise_time(raw)
    raw, rows = _without_empty_rows(raw, rows, notes, stamped=clock is not None)
    if len(raw) > WIDE * max(len(rows), 1):
        notes.append(f"{len(raw)} columns of {len(rows)} samples: if channels stand in its rows, save it turned")
    above = [*layout.comments, *(layout.separator.join(row.cells) for row in layout.preamble)]
    step = said_step(above)
    if step is not None and clock is None:
        notes.append(f"sample time {step:g} s, from the lines above the table")
    table = RawTable(
        source=path,
        reader="csv",
        columns=raw,
        time=clock,
        step=step,
        lines=rows,
        notes=tuple(notes),
        metadata=dict(_metadata(layout)),
        settings={
            "separator": layout.separator,
            "decimal": layout.numbers.decimal,
            "encoding": file.encoding,
            "header": layout.header is not None,
            "units_line": layout.units is not None,
            "calendar": time is not None,
            "zone": guess,
        },
    )
    return table if time is not None else replace(table, records=records_beside(table))


WIDE = 4
"""Columns to each sample from which on a table may lie on its side."""

READER = Reader(
    name="csv",
    suffixes=(".csv", ".tsv", ".txt", ".dat", ".asc", ".prn", ".tab", *PACKED_SUFFIXES),
    read=_read,
    options=frozenset(
        {"separator", "decimal", "thousands", "comment", "encoding", "skip_lines", "header", "units_line"}
        | {"names", "missing"}
    ),
)


def _headers(layout: Layout, options: FileOptions, path: Path) -> list[Header]:
    width = len(layout.kinds)
    texts: Sequence[str] = layout.names or [*(f"column_{i + 1}" for i in range(_filled(layout))), *[""] * width][:width]
    if options.names is not None:
        texts = _given_names(options.names, layout, path)
    # A spreadsheet breaks the lines of a long head; in a file of ours a name has what it has.
    ours = any(text.lstrip().startswith("sysid:") for text in layout.comments)
    plain = [from_csv_cell(text) for text in texts]
    headers = parse_headers(plain if ours else [re.sub(r"\s*[\r\n]+\s*", " ", text) for text in plain])
    headers = [
        Header(name=header.name, unit=split_reference(suffix)[0]) if suffix and header.unit is None else header
        for header, suffix in zip(headers, layout.suffixes, strict=True)
    ]
    if layout.units is not None:
        units = [split_reference("" if cell in NO_UNITS else unit_text(cell)) for cell in layout.units]
        headers = [
            Header(name=header.name, unit=unit or header.unit, reference=reference or header.reference)
            for header, (unit, reference) in zip(headers, units, strict=True)
        ]
    return headers


def _filled(layout: Layout) -> int:
    """How many columns need a name: a separator at the end of every line makes one that does not."""
    width = len(layout.kinds)
    return width - 1 if width > 1 and layout.kinds[-1] is Kind.NOTHING else width


def _given_names(names: Sequence[str], layout: Layout, path: Path) -> list[str]:
    width = len(layout.kinds)
    # A spreadsheet leaves empty columns between tables and remarks; they are no columns of the record.
    held = layout.names or [""] * width
    used = [i for i, kind in enumerate(layout.kinds) if held[i] or kind is not Kind.NOTHING]
    if len(names) == len(used):
        return [names[used.index(i)] if i in used else "" for i in range(width)]
    if len(names) not in {_filled(layout), width}:
        raise ReaderError(
            "names does not fit the columns",
            where=f"{path}, line {layout.skip + 1}",
            expected=f"{width} names",
            got=f"{len(names)}: {', '.join(names)}",
            remedy="give one name per column of the file, in order",
        )
    return [*names, *[""] * (width - len(names))]


def _calendar_column(headers: Sequence[Header], layout: Layout, options: FileOptions) -> int | None:
    """Index of the column of calendar time that is time, if there is one."""
    names, asked = [header.name or f"column_{i + 1}" for i, header in enumerate(headers)], options.time
    if asked.step is not None or asked.unit not in {None, "datetime"}:
        return None
    if asked.column is not None:
        here = asked.column in names and (
            asked.unit == "datetime" or layout.kinds[names.index(asked.column)] is Kind.TIME
        )
        return names.index(asked.column) if here else None
    bare = [RawColumn(name=n, values=np.empty(0), unit=h.unit) for n, h in zip(names, headers, strict=True)]
    named = recognise_time(bare)
    if named is not None and (asked.unit == "datetime" or layout.kinds[names.index(named)] is Kind.TIME):
        return names.index(named)
    # Dates go before what is known for a clock by its unit alone, unless that stands first, as clocks do.
    sure = named is not None and (is_called_time(named) or names.index(named) == 0)
    if named is not None and sure and layout.kinds[names.index(named)] is not Kind.TIME and asked.unit is None:
        return None
    return layout.kinds.index(Kind.TIME) if Kind.TIME in layout.kinds else 0 if asked.unit == "datetime" else None


def _column(
    index: int, header: Header, layout: Layout, options: FileOptions, path: Path, *, calendar: bool
) -> AnyColumn:
    kind = layout.kinds[index]
    if calendar or kind is Kind.TIME:
        where = f"{path}, column {header.name}"
        return Stamps(
            calendar=Calendar(
                where=where,
                pattern=options.time.format if calendar else None,
                zone=options.time.zone if calendar else None,
                minutes=_MINUTES.search(f"{header.name} [{header.unit}]") is not None,
            )
        )
    if kind is Kind.WORD:
        return Texts(collector=WordCollector(layout.numbers.missing))
    if kind is Kind.WHOLE:
        return Counts()
    states = states_for(options.states, header.name)
    return Numbers(numbers=replace(layout.numbers, states=states, suffix=layout.suffixes[index]))


def _finished(
    headers: Sequence[Header],
    columns: list[AnyColumn],
    layout: Layout,
    path: Path,
    notes: list[str],
    *,
    calendar: int | None,
) -> tuple[tuple[RawColumn, ...], str | None]:
    """The columns as they are, and the zone that would explain how the clock jumps."""
    guess = None
    dates = None if calendar is None else _take_dates(columns, calendar)
    if dates is not None and calendar is not None:
        notes.append(f"time is {headers[dates].name} and {headers[calendar].name} together")
    found, nothing, nameless = list[RawColumn](), list[int](), list[int]()
    for index, (header, column) in enumerate(zip(headers, columns, strict=True)):
        where = f"{path}, column {header.name or index + 1}"
        if index == dates or index < layout.labels:
            continue
        if isinstance(column, Stamps):
            raw, told, zone = _stamps(header, column, where, is_time=index == calendar)
            if index == calendar:
                guess, notes[len(notes) :] = zone, told
        elif isinstance(column, Texts):
            words = column.collector.finish()
            blank = np.full(len(words.codes), np.nan)
            problem = words.problem(where) if words.texts else None
            raw = RawColumn(name=header.name, values=blank, unit=header.unit, problem=problem, words=words)
        else:
            raw = _numbers(header, column, layout, path)
            if isinstance(column, Numbers) and column.bracketed and raw.problem is None:
                notes.append(f"{header.name}: {column.bracketed} is a negative number in brackets")
        if not header.name:
            if raw.words is None and raw.problem is None and not np.isfinite(raw.values).any():
                nothing += [index + 1] if index + 1 < len(headers) else []
                continue
            raw = replace(raw, name=f"column_{index + 1}")
            nameless.append(index + 1)
        found.append(raw)
    notes += _of_columns(nothing, "neither name nor values") + _of_columns(nameless, "no name", called=True)
    return tuple(found), guess


def _of_columns(places: Sequence[int], what: str, *, called: bool = False) -> list[str]:
    """What some columns have in common, as one note; none of none."""
    if not places:
        return []
    which, has = ("column", "has") if len(places) == 1 else ("columns", "have")
    names = f": called {', '.join(f'column_{place}' for place in places[:_MOST_TOLD])}" if called else ""
    more = f" and {len(places) - _MOST_TOLD} more" if len(places) > _MOST_TOLD else ""
    shown = ", ".join(map(str, places[:_MOST_TOLD]))
    return [f"{which} {shown}{more} {has} {what}{names}{' ...' if called and more else ''}"]


def _without_empty_rows(
    columns: tuple[RawColumn, ...], lines: NDArray[np.int32], notes: list[str], *, stamped: bool
) -> tuple[tuple[RawColumn, ...], NDArray[np.int32]]:
    """Without rows of separators alone: behind the table, and among stamps, where they are at no time."""
    if any(column.problem is not None and column.words is None for column in columns):
        return columns, lines
    filled = np.zeros(len(lines), dtype=np.bool_)
    for column in columns:
        filled |= (column.words.codes >= 0) if column.words is not None else ~np.isnan(column.values)
        if filled.all():
            return columns, lines
    kept = filled if stamped else np.arange(len(lines)) <= np.flatnonzero(filled).max(initial=-1)
    if not kept.any() or kept.all():
        return columns, lines
    told = "1 row" if np.sum(~kept) == 1 else f"{np.sum(~kept)} rows"
    notes.append(f"{told} without a value left out, the first: line {lines[~kept][0]}")
    some = tuple(
        replace(c, values=c.values[kept], words=c.words and replace(c.words, codes=c.words.codes[kept]))
        for c in columns
    )
    return some, lines[kept]


def _take_dates(columns: Sequence[AnyColumn], calendar: int) -> int | None:
    """The column whose dates belong to the times of day of another, if there is one."""
    time = columns[calendar]
    if not isinstance(time, Stamps) or time.problem is not None:
        return None
    for index, column in enumerate(columns):
        other = isinstance(column, Stamps) and index != calendar and column.problem is None
        if not other or not isinstance(column, Stamps):
            continue
        clock, date = (time.calendar, column.calendar)
        if date.has_date and not date.has_clock and clock.has_clock and not clock.has_date:
            clock.with_date(date)
            return index
        if clock.has_date and not clock.has_clock and date.has_clock and not date.has_date:
            date.with_date(clock)
            time.calendar, column.calendar = date, clock
            return index
    return None


def _stamps(header: Header, column: Stamps, where: str, *, is_time: bool) -> tuple[RawColumn, list[str], str | None]:
    problem, zone = column.problem, None
    told: list[str] = []
    seconds: NDArray[np.float64] = np.full(column.rows, np.nan)
    if not is_time:
        problem = problem or ReaderError(
            "the column holds calendar time beside the time column",
            where=where,
            expected="numbers",
            got="dates or times of day",
            remedy=f"if it is the time, write time: {{column: {header.name}, unit: datetime}}",
        )
    elif problem is None:
        try:
            seconds, told, zone = column.calendar.finish()
        except ReaderError as error:
            problem = error
    aside = "" if is_time or column.problem is not None else "calendar time beside the time"
    unit = "s" if is_time else None
    raw = RawColumn(
        name=header.name, values=seconds, unit=unit, problem=problem, began=column.calendar.began, aside=aside
    )
    return raw, told, zone


def _numbers(header: Header, column: Numbers | Counts, layout: Layout, path: Path) -> RawColumn:
    values = column.values.whole()
    for number in layout.numbers.missing_numbers:  # however they are written: -9999 and -9999.00 are one
        values[values == number - (column.origin or 0 if isinstance(column, Counts) else 0)] = np.nan
    problem = None
    if column.strange:
        from sysid.ingest.readers.csv.bad_cells import not_a_number  # here: most tables have none

        cell, line = next(iter(column.strange.items()))
        problem = not_a_number(cell, header, line=line, layout=layout, path=path)
        values = np.full(len(values), np.nan)
    return RawColumn(
        name=header.name,
        values=values,
        unit=header.unit,
        reference=header.reference,
        problem=problem,
        strange=tuple(column.strange),
        counted_from=(column.origin or 0) if isinstance(column, Counts) else 0,
    )


def _metadata(layout: Layout) -> list[tuple[str, str]]:
    pairs = [comment.split(":", 1) for comment in layout.comments if ":" in comment]
    pairs += [row.cells[:2] for row in layout.preamble if len(row.cells) > 1]
    return [(key.strip(), value.strip()) for key, value in pairs]
