"""Reading a file of which nothing is known: what a person would try in turn, and which of it was a guess."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError, UserError
from sysid.ingest.cells.blanks import marks_in
from sysid.ingest.cells.numbers import spaced, usually_missing
from sysid.ingest.cells.words import PAIRS, TRUTH, known_states
from sysid.ingest.reading import read_table
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import FileOptions, RepairOptions
from sysid.ingest.tables.quality import is_quality
from sysid.ingest.tables.table import RawTable, RepeatedNamesError
from sysid.ingest.tables.time_columns import is_called_time

_OF_TEXT = frozenset({"csv", "excel"})
_LONG_SHARE = 0.6
_CHANGE_SHARE = 0.5
_FEW_TEXTS = 3
_STATE_OF_A_POINT = re.compile(r"\[-\d+\] \D+")
"""``[-11059] No Good Data``, as historians write in place of a value."""
_CALLED_NAMES = re.compile(
    r"(?:signal|tag|variable|var|channel|sensor|parameter|measurement|metric|point|item|kanal|messstelle|größe|grandeur)s?"
    r"(?:[ _]?(?:name|id|tag))?|name|_field|(?:tag|point)name",
    re.IGNORECASE,
)
"""What the column is called that says which signal a row of a long table is of."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Attempt:
    """A file as it could be read.

    Args:
        table: The file.
        files: The options that it took.
        repairs: The repairs that the reader made.
        guessed: The options among them that are guesses.
    """

    table: RawTable
    files: FileOptions
    repairs: RepairOptions
    guessed: frozenset[str] = frozenset()

    @property
    def unusable(self) -> int:
        """How many columns cannot be used."""
        return sum(column.problem is not None for column in (*self.table.columns, *self.table.others))


def read_somehow(path: Path, files: FileOptions) -> Attempt:
    """Read a file with options that it seems to need.

    Args:
        path: The file.
        files: What is known about it already; it is kept.

    Returns:
        The best attempt: the one with the fewest columns that cannot be used.

    Raises:
        ReaderError: If it cannot be read at all.
        UserError: If an option that is given means nothing for it.
    """
    best = _first(path, files)
    for suggest in SUGGESTIONS:
        more = suggest(best.table)
        given = set(files.model_fields_set)
        if not more or given & set(more) - {"time", "states", "missing"}:
            continue
        if "missing" in more:
            more["missing"] = tuple(dict.fromkeys([*best.files.missing, *more["missing"]]))
        attempt = _with(best, more, path)
        if attempt is not None:
            best = attempt
    return best


def _first(path: Path, files: FileOptions) -> Attempt:
    """The file as it stands, or without its ragged rows, or with numbers behind names that stand twice."""
    error: UserError | None = None
    for repairs in (RepairOptions(), RepairOptions(ragged="drop")):
        try:
            return Attempt(table=read_table(path, files=files, repairs=repairs), files=files, repairs=repairs)
        except RepeatedNamesError as twice:
            if files.names is not None:
                raise
            numbered = _first(path, files.model_copy(update={"names": twice.numbered}))
            return replace(numbered, guessed=frozenset({"names"}))
        except ReaderError as problem:
            error = error or problem
    raise error or ReaderError("the file cannot be read", where=path)


def _given(files: FileOptions) -> dict[str, Any]:
    return {name: getattr(files, name) for name in files.model_fields_set}


def _with(best: Attempt, more: dict[str, Any], path: Path) -> Attempt | None:
    """The attempt with further options, or ``None`` if they do not help."""
    told = frozenset(more) if "time" not in more else frozenset({"zone", "format"} & set(more["time"]))
    options = FileOptions.model_validate({**_given(best.files), **more})
    try:
        table = read_table(path, files=options, repairs=best.repairs)
    except UserError:
        return None
    attempt = replace(best, table=table, files=options, guessed=best.guessed | told)
    return attempt if attempt.unusable <= best.unusable else None


def _thousands(table: RawTable) -> dict[str, Any] | None:
    """The mark that separates thousands, where it keeps a column from being one of numbers."""
    decimal = str(table.settings.get("decimal", "."))
    strange = [spaced(text) for column in table.columns for text in column.strange]
    for mark in (".", ",", "'", " "):
        grouped = re.compile(rf"[+-]?[0-9]{{1,3}}(?:{re.escape(mark)}[0-9]{{3}})+(?:{re.escape(decimal)}[0-9]*)?")
        if strange and all(grouped.fullmatch(text) for text in strange):
            # Nothing has shown that a point is one of decimals where all other numbers are whole.
            swapped = mark == decimal == "." and all(_whole(one.values) for one in table.columns if not one.strange)
            return {"thousands": mark, "decimal": "," if swapped else decimal}
    return None


def _whole(values: NDArray[np.float64]) -> bool:
    known = values[np.isfinite(values)]
    return bool((known == np.round(known)).all())


def _missing(table: RawTable) -> dict[str, Any] | None:
    """Texts that stand for a missing value, where they are all that a column of numbers holds beside them.

    Those that usually do, and a few others without a digit: what an instrument writes in place of a number. Numbers
    such as -9999 too.
    """
    found: dict[str, None] = {}
    for column in table.columns:
        few = len(column.strange) <= _FEW_TEXTS
        if column.strange and all(usually_missing(text) or (few and _is_remark(text)) for text in column.strange):
            found |= dict.fromkeys(column.strange)
        elif table.reader in _OF_TEXT and column.problem is None and column.name != table.time:
            found |= dict.fromkeys(f"{mark:.15g}" for mark in marks_in(column.values))
    return {"missing": tuple(found)} if found else None


def _is_remark(text: str) -> bool:
    plain = text.casefold()
    if _STATE_OF_A_POINT.fullmatch(text):
        return True
    return not any(map(str.isdigit, text)) and plain not in TRUTH and not any(plain in pair for pair in PAIRS)


def _states(table: RawTable) -> dict[str, Any] | None:
    """States that are known."""
    found: dict[str, dict[str, float]] = {}
    for column in table.columns:
        if column.words is not None and column.problem is not None and column.words.complete:
            states = known_states(column.words.texts)
            if states is not None:
                found[column.name] = states
    if not found:
        return None
    tables = list(found.values())
    return {"states": tables[0] if all(table == tables[0] for table in tables) else found}


def _long(table: RawTable) -> dict[str, Any] | None:
    """A table of (time, signal, value): one column of names, one of numbers, and times that come again."""
    words = [c for c in table.columns if c.words is not None and c.problem is not None and len(c.words.texts) > 1]
    words = [c for c in words if not is_quality(c)]
    numbers = [c for c in table.columns if c.name != table.time and c.problem is None and np.isfinite(c.values).any()]
    numbers = [c for c in numbers if not is_quality(c)]
    if table.time is not None and not words and len(numbers) == 2:
        return _numbered(table, numbers)
    if table.time is None or not words:
        return None
    time = next(column for column in table.columns if column.name == table.time)
    names = next((column for column in words if _names_rows(column, time)), None)
    if names is None:
        return None
    numbers = _without_further_clocks(numbers, time, names) if len(numbers) > 1 else numbers
    if len(numbers) != 1:
        return None
    units = next((c.name for c in words if c is not names and _follows(c, names)), None)
    return {"long": {"names": names.name, "values": numbers[0].name} | ({"units": units} if units else {})}


def _numbered(table: RawTable, numbers: Sequence[RawColumn]) -> dict[str, Any] | None:
    """A long table whose signals have numbers: each of them once at each time."""
    time = next(column.values for column in table.columns if column.name == table.time)
    if bool((time[1:] > time[:-1]).all()):
        return None
    for names, values in (numbers, numbers[::-1]):
        if (names.values[:1000] != np.rint(names.values[:1000])).any():
            continue
        found = np.unique(names.values)
        whole = len(found) > 1 and np.isfinite(found).all() and (found == np.rint(found)).all()
        pairs = np.unique(np.column_stack([time, names.values]), axis=0)
        if whole and len(pairs) == len(table) == len(np.unique(time)) * len(found):
            return {"long": {"names": names.name, "values": values.name}}
    return None


def _without_further_clocks(numbers: list[RawColumn], time: RawColumn, names: RawColumn) -> list[RawColumn]:
    """Without what rises with the time, as a second clock does, and without numbers of the signals themselves."""
    order = np.argsort(time.values, kind="stable")
    codes = names.words.codes if names.words is not None else np.zeros(len(order), dtype=np.int32)

    def is_clock(column: RawColumn) -> bool:
        values = column.values[order]
        return is_called_time(column.name) and bool((values[1:] >= values[:-1]).all())

    def is_number_of(column: RawColumn) -> bool:
        return all(len(np.unique(column.values[codes == code])) == 1 for code in range(int(codes.max()) + 1))

    return [column for column in numbers if not is_clock(column) and not is_number_of(column)]


def _names_rows(names: RawColumn, time: RawColumn) -> bool:
    if names.words is None or not names.words.complete or time.problem is not None:
        return False
    codes = names.words.codes
    known = np.isfinite(time.values) & (codes >= 0)
    pairs = np.unique(np.column_stack([time.values[known], codes[known]]), axis=0)
    if len(pairs) < max(0.9 * known.sum(), 2):
        return False
    if _CALLED_NAMES.fullmatch(names.name.strip()):
        return True
    again = len(np.unique(pairs[:, 0])) <= _LONG_SHARE * len(pairs)
    # One signal after the other: time steps back where the next begins, and nowhere else.
    changes, back = np.flatnonzero(np.diff(codes)), np.flatnonzero(np.diff(time.values) < 0.0)
    blocks = len(changes) == len(names.words.texts) - 1 and np.array_equal(changes, back)
    return again or blocks or float(np.mean(np.diff(codes) != 0)) >= _CHANGE_SHARE


def _follows(units: RawColumn, names: RawColumn) -> bool:
    """Whether a column of words says one thing for each name."""
    if units.words is None or names.words is None:
        return False
    pairs = set(zip(names.words.codes.tolist(), units.words.codes.tolist(), strict=True))
    return len(pairs) == len(names.words.texts)


def _zone(table: RawTable) -> dict[str, Any] | None:
    """The zone that would explain how a clock jumps by an hour."""
    zone = table.settings.get("zone")
    return {"time": {"column": table.time, "unit": "datetime", "zone": zone}} if zone and table.time else None


def _packed(table: RawTable) -> dict[str, Any] | None:
    """Numbers that are the digits of a date and a time: 20240312235958."""
    if table.reader not in _OF_TEXT or table.settings.get("calendar"):
        return None
    for column in table.columns:
        known = column.values[np.isfinite(column.values)]
        possible = column.name == table.time if table.time else len(known) > 1 and bool((np.diff(known) >= 0.0).all())
        pattern = _digits_of(known) if possible and len(known) > 1 else None
        if pattern:
            return {"time": {"column": column.name, "unit": "datetime", "format": pattern}}
    return None


def _digits_of(known: NDArray[np.float64]) -> str | None:
    """As what pattern of digits numbers are dates and times; ``None`` where they are none."""
    if (known != np.round(known)).any():
        return None
    for parts, pattern in ((6, "%Y%m%d%H%M%S"), (5, "%Y%m%d%H%M")):
        digits = [known // 100.0**i % 100.0 for i in range(parts - 1)]  # from the seconds, or the minutes, up
        times, day, month = digits[:-2], digits[-2], digits[-1]
        year = known // 100.0 ** (parts - 1)
        limits = (60, 60, 24)[-len(times) :]
        calendar = (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31) & (year >= 1900) & (year < 2200)
        if calendar.all() and all((one < most).all() for one, most in zip(times, limits, strict=True)):
            return pattern
    return None


SUGGESTIONS: tuple[Callable[[RawTable], dict[str, Any] | None], ...] = (
    _thousands,
    _missing,
    _missing,  # numbers that stand for none, in a column whose words do
    _states,
    _zone,
    _packed,
    _long,
)
"""What a table says of the options that it needs, in the order in which they are tried."""
