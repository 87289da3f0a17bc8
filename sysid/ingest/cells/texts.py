"""Columns of text in files that have types (Parquet, JSON, NPZ ...): numbers, dates and times, or words."""

from __future__ import annotations

import datetime
import decimal
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.began import Began
from sysid.ingest.cells.calendar import Calendar, is_calendar
from sysid.ingest.cells.numbers import MISSING, NumberFormat
from sysid.ingest.cells.words import WordCollector, Words

_LOOKED_AT = 50


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """What texts are.

    Args:
        values: Shape ``(n,)``; NaN where there is nothing, and for words.
        unit: Of time since the first stamp, where they are dates or times of day.
        words: The texts, where they are words.
        problem: Why they are no numbers.
        began: When the first stamp is, of dates.
    """

    values: NDArray[np.float64]
    unit: str | None = None
    words: Words | None = None
    problem: ReaderError | None = None
    began: Began | None = None


def meaning_of(array: NDArray[Any], where: str) -> Meaning | None:
    """What an array of texts or of objects holds.

    Args:
        array: Shape ``(n,)``; of text, bytes or Python objects.
        where: File and column, for errors.

    Returns:
        Its meaning; ``None`` if it holds anything that is neither text, number, date nor time of day.
    """
    cells = [_text(item) for item in array.tolist()]
    if None in cells:
        return None
    texts = [cell.strip() for cell in cells if cell is not None]
    known = [text for text in texts if text.casefold() not in MISSING]
    if known and all(map(is_calendar, known[:_LOOKED_AT])):
        calendar = Calendar(where=where)
        try:
            calendar.add(["" if text.casefold() in MISSING else text for text in texts], np.arange(len(texts)))
            return Meaning(values=calendar.finish()[0], unit="s", began=calendar.began)
        except ReaderError as error:
            return Meaning(values=np.full(len(texts), np.nan), problem=error)
    return _numbers(texts) or _words(texts, where)


def _text(item: Any) -> str | None:
    if isinstance(item, str):
        return item
    if isinstance(item, list | tuple | dict | np.ndarray):
        return None
    if item is None or item != item:  # noqa: PLR0124 - NaN, NaT
        return ""
    if isinstance(item, bytes):
        return item.decode("utf-8", errors="replace").rstrip("\0")
    if isinstance(item, bool):
        return str(item)
    if isinstance(item, datetime.datetime | datetime.date | datetime.time | datetime.timedelta):
        return str(item)
    return repr(float(item)) if isinstance(item, int | float | decimal.Decimal | np.number) else None


def _numbers(texts: Sequence[str]) -> Meaning | None:
    """Numbers with a decimal point throughout, or with a comma throughout."""
    for mark in (".", ","):
        values, strange = NumberFormat(decimal=mark).column_with_words(texts)
        if not strange:
            return Meaning(values=values)
    return None


def _words(texts: Sequence[str], where: str) -> Meaning:
    collector = WordCollector()
    collector.add(texts)
    words = collector.finish()
    return Meaning(values=np.full(len(texts), np.nan), words=words, problem=words.problem(where))
