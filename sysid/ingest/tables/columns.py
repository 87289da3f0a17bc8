"""RawColumn: a column as it stands in a file, and how an array of any type becomes one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.cells.began import Began
from sysid.ingest.cells.headers import split_reference
from sysid.ingest.cells.texts import meaning_of
from sysid.ingest.cells.words import Words
from sysid.units import Reference

_EXACT_INTEGERS = 2**53


@dataclass(frozen=True, kw_only=True, eq=False)
class RawColumn:
    """A column as it stands in the file.

    Args:
        name: Name without the unit.
        values: Shape ``(n_rows,)``, float64; NaN where the file has nothing.
        unit: As found in the file, or ``None``.
        reference: As found in the file, or ``None``.
        description: As found in the file.
        problem: Why the column cannot be used; raised only when it is asked for, so that a column of
            remarks beside the measurements does no harm. Its values are NaN then.
        aside: Why it is not proposed as a channel, though it can be one.
        complex_values: The numbers of a column of complex ones, shape ``(n_rows,)``, which is no channel.
        words: The texts of a column of words.
        strange: Texts in a column of numbers that are none.
        counted_from: What the values are counted from: a clock that counts further than float64 can.
        began: When second 0 of calendar time is.
    """

    name: str
    values: NDArray[np.float64]
    unit: str | None = None
    reference: Reference | None = None
    description: str = ""
    problem: ReaderError | None = None
    words: Words | None = None
    strange: tuple[str, ...] = ()
    counted_from: int = 0
    began: Began | None = None
    aside: str = ""
    complex_values: NDArray[np.complex128] | None = None


def array_column(
    name: str,
    array: NDArray[Any],
    *,
    where: str,
    unit: str | None = None,
    reference: Reference | None = None,
    description: str = "",
) -> RawColumn:
    """A column from an array of whatever type a file holds.

    Args:
        name: Name without the unit.
        array: One-dimensional; calendar time becomes seconds since its first value, durations seconds, texts what
            they say, whole numbers beyond float64 are counted from the least of them.
        where: The file, for errors.
        unit: As found in the file; psig, barg and the like are taken apart.
        reference: As found in the file.
        description: As found in the file.

    Returns:
        The column; one that is not numeric carries its ``problem``.
    """
    unit, found = split_reference(unit) if unit else (None, None)
    origin, began = 0, None
    if array.dtype.kind in "USO" and (meaning := meaning_of(array, f"{where}, column {name}")) is not None:
        return RawColumn(
            name=name,
            values=meaning.values,
            unit=meaning.unit or unit or None,
            reference=reference or found,
            description=description,
            problem=meaning.problem,
            words=meaning.words,
            began=meaning.began,
        )
    try:
        if array.dtype.kind == "M":
            (array, began), unit = _seconds(array), "s"
        if array.dtype.kind == "m":
            array, unit = np.where(np.isnat(array), np.nan, array.astype("timedelta64[ns]").astype(np.int64) / 1e9), "s"
        if array.dtype.kind == "c" and not array.imag.any():
            array = array.real  # as of what went through a Fourier transform and back
        if array.dtype.kind in "ui" and array.size and (span := _beyond_float64(array)) is not None:
            origin, array = span
        values, problem = _as_float64(array, where=f"{where}, column {name}"), None
    except ReaderError as error:
        values, problem = np.full(len(array), np.nan), error
    return RawColumn(
        name=name,
        values=values,
        unit=unit or None,
        reference=reference or found,
        description=description,
        problem=problem,
        counted_from=origin,
        began=began,
        complex_values=array.astype(np.complex128) if array.dtype.kind == "c" else None,
    )


def distinct(columns: Sequence[RawColumn]) -> tuple[list[RawColumn], list[str]]:
    """Columns with a different name each: the second ``p`` becomes ``p (2)``.

    Args:
        columns: Columns, of which some may have the same name.

    Returns:
        The columns, and one sentence for each that was renamed.
    """
    taken: set[str] = set()
    named, notes = [], []
    for column in columns:
        name, count = column.name, 1
        while name in taken:
            count += 1
            name = f"{column.name} ({count})"
        taken.add(name)
        named.append(column if name == column.name else replace(column, name=name))
        notes += [] if name == column.name else [f"a further column {column.name} is called {name}"]
    return named, notes


def _seconds(stamps: NDArray[np.datetime64]) -> tuple[NDArray[np.float64], Began | None]:
    known = stamps[~np.isnat(stamps)]
    if not len(known):
        return np.full(len(stamps), np.nan), None
    nanoseconds = (stamps - known[0]).astype("timedelta64[ns]")
    seconds: NDArray[np.float64] = nanoseconds.astype(np.int64) / 1e9
    seconds[np.isnat(nanoseconds)] = np.nan
    return seconds, Began(micros=int(known[0].astype("datetime64[us]").astype(np.int64)))


def _beyond_float64(array: NDArray[Any]) -> tuple[int, NDArray[Any]] | None:
    """A clock that counts further than float64 can (ns since 1970): its least value, and the counts from there."""
    low, high = int(array.min()), int(array.max())
    if max(-low, high) <= _EXACT_INTEGERS or high - low > _EXACT_INTEGERS:
        return None
    return low, array - array.dtype.type(low)


def _as_float64(array: NDArray[Any], *, where: str) -> NDArray[np.float64]:
    if array.dtype.kind not in "buif":
        raise ReaderError(
            "a column is not numeric",
            where=where,
            expected="real numbers",
            got="complex numbers" if array.dtype.kind == "c" else f"values of type {array.dtype}",
            remedy="choose other columns, or export this one as plain real numbers",
        )
    converted = array.astype(np.float64, copy=False)
    if array.dtype.kind in "ui" and (np.abs(converted) > _EXACT_INTEGERS).any():
        raise ReaderError(
            "integers are too large for float64",
            where=where,
            expected="integers of at most 53 bits",
            got=f"values up to {array.max()}",
            remedy="subtract the first value (a time origin, for example) before the export",
        )
    return converted
