"""What can be wrong with the values of a record: refused, or repaired where that repair was asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.ingest.assembling.record import Record
from sysid.ingest.cells.blanks import marks_in
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import RepairOptions
from sysid.ingest.tables.table import RawTable


def marks(table: RawTable, column: RawColumn, repairs: RepairOptions) -> tuple[RawColumn, str]:
    """Numbers that stand for missing values.

    Args:
        table: The file.
        column: One of its columns, in the file's unit.
        repairs: ``marks: missing`` takes them for missing, ``marks: accept`` for values.

    Returns:
        The column, and what was done, or the empty text.

    Raises:
        TraceError: If there are such numbers and nothing says what they are.
    """
    found = [] if repairs.marks == "accept" else marks_in(column.values)
    if not found:
        return column, ""
    there = np.isin(column.values, found)
    count, shown = int(there.sum()), ", ".join(f"{mark:.15g}" for mark in found)
    if repairs.marks == "missing":
        values = np.where(there, np.nan, column.values)
        return replace(column, values=values), f"{column.name}: {shown} taken for missing, {count} values"
    raise TraceError(
        f"{column.name} holds {shown}, which loggers write for want of a value",
        where=f"{table.source}, channel {column.name}, {table.place(int(np.flatnonzero(there)[0]))}",
        expected="values near the others",
        got=f"{shown} in {count} of {len(there)} samples, far from all others",
        remedy="if it stands for a missing value, ask for repairs: {marks: missing, nan: mask}; if it was measured, "
        "for repairs: {marks: accept}",
    )


def missing_values(record: Record, repairs: RepairOptions) -> Record:
    """Values that are empty, NaN or infinite.

    Args:
        record: Samples whose stamps rise. What is missing and marked was masked: it needs no other repair.
        repairs: ``nan: interpolate`` puts them on the line between their neighbours in time; ``nan: hold`` takes the
            value before; ``nan: mask`` interpolates (or holds, at the ends) and marks the samples as not usable.
            Before a first value there is none to hold: those samples take the first and are marked. What would come
            from a masked value is marked too.

    Returns:
        Samples with finite values.

    Raises:
        TraceError: If there are such values and no repair was asked for, if a channel has no other,
            or if one to be interpolated has a neighbour on one side only.
        ConfigError: If a repair is asked for a channel that is not there.
    """
    bad = ~np.isfinite(record.values)
    _check_names(record, repairs)
    if not bad.any():
        return record
    values, marked = record.values.copy(), record.marked.copy()
    for column, name in enumerate(record.names):
        missing, masked = bad[:, column], record.marked[:, column]
        if not missing.any():
            continue
        repair = repairs.nan.get(name) if isinstance(repairs.nan, dict) else repairs.nan
        _check_missing(record, missing, name, repair)
        known, rest = np.flatnonzero(~missing), missing & ~masked
        if repair == "hold":
            before = np.searchsorted(known, np.flatnonzero(missing), side="right") - 1
            values[missing, column] = values[known[np.maximum(before, 0)], column]
            marked[: known[0], column] = True
        else:
            values[missing, column] = np.interp(record.stamps[missing], record.stamps[known], values[known, column])
        marked[:, column] |= rest if repair == "mask" else _beside(rest, masked, both=repair != "hold")
        if rest.any():
            record = record.noted(f"{name}: {_told(record, rest, int(known[0]), repair)}")
    return replace(record, values=values, marked=marked)


def _beside(missing: NDArray[np.bool_], masked: NDArray[np.bool_], *, both: bool) -> NDArray[np.bool_]:
    """What is missing and would be filled from masked samples: those before it, or on both sides."""
    if not masked.any():
        return masked
    given, at = np.flatnonzero(~missing), np.flatnonzero(missing)
    after = np.searchsorted(given, at)
    unsure = masked[given[np.maximum(after - 1, 0)]]
    if both:
        unsure |= masked[given[np.minimum(after, len(given) - 1)]]
    out = np.zeros(len(missing), dtype=np.bool_)
    out[at] = unsure
    return out


def _told(record: Record, missing: NDArray[np.bool_], known: int, repair: str | None) -> str:
    """What was done about missing values, the first value that is known being that sample."""
    done = {"interpolate": "interpolated", "hold": "as before", "mask": "filled and masked"}[repair or "mask"]
    early = f", {known} before the first value masked" if repair == "hold" and known else ""
    first = int(np.flatnonzero(missing)[0])
    return (
        f"{int(missing.sum())} missing values {done}{early}, first at {record.at(first)}, "
        f"longest run {_longest_run(missing)}"
    )


def repeated_values(record: Record, repairs: RepairOptions) -> Record:
    """Values of a channel that is measured more slowly than it is recorded: they stand until the next one comes.

    Args:
        record: Samples with finite values.
        repairs: ``repeats: {level: mask}`` marks the samples of that channel that repeat the value before.

    Returns:
        The samples.

    Raises:
        ConfigError: If a repair is asked for a channel that is not there.
    """
    _check_names(record, repairs)
    if not repairs.repeats:
        return record
    marked = record.marked.copy()
    for name in repairs.repeats:
        at = record.names.index(name)
        column = record.values[:, at]
        again = np.r_[False, column[1:] == column[:-1]]
        marked[:, at] |= again
        record = record.noted(f"{name}: {int(again.sum())} values that repeat the one before masked")
    return replace(record, marked=marked)


def drifts(record: Record, repairs: RepairOptions) -> Record:
    """Channels that drift, as the zero of a sensor does.

    Args:
        record: Samples with finite values.
        repairs: ``drift: {level: line}`` takes the straight line through the samples that count off that channel; its
            mean stays.

    Returns:
        The samples.

    Raises:
        ConfigError: If a repair is asked for a channel that is not there.
    """
    _check_names(record, repairs)
    if not repairs.drift:
        return record
    values = record.values.copy()
    for name in repairs.drift:
        at = record.names.index(name)
        column, seen = values[:, at], ~record.marked[:, at]
        if np.ptp(record.stamps[seen]) if seen.any() else False:
            away = record.stamps - record.stamps[seen].mean()
            slope = float(away[seen] @ (column[seen] - column[seen].mean()) / (away[seen] @ away[seen]))
            column -= slope * away
            record = record.noted(f"{name}: a straight line of {slope:.6g} a second taken off, its mean left")
    return replace(record, values=values)


def _check_names(record: Record, repairs: RepairOptions) -> None:
    for kind in ("nan", "repeats", "drift"):
        asked = getattr(repairs, kind)
        strangers = sorted(set(asked) - set(record.names)) if isinstance(asked, dict) else []
        if strangers:
            raise ConfigError.unknown(
                f"repairs.{kind} names {strangers[0]}, which is not a channel",
                strangers[0],
                record.names,
                "write the names of channels on the left",
                where=f"the description of {record.table.source}",
            )


def _check_missing(record: Record, missing: NDArray[np.bool_], name: str, repair: str | None) -> None:
    at = record.names.index(name)
    masked = record.marked[:, at] & missing
    if missing.all() and masked.any():
        raise TraceError(
            "a mask leaves a channel no value",
            where=f"{record.table.source}, channel {name}",
            expected="stretches of repairs.mask that leave samples",
            got=f"{int(masked.sum())} of {len(missing)} samples masked, none left",
            remedy="correct start and stop in repairs.mask, or leave the channel or the case out",
        )
    if missing.all():
        raise TraceError(
            "a channel has no values at all",
            where=f"{record.table.source}, channel {name}",
            expected="numbers",
            got="only empty cells or NaN",
            remedy="choose another column, or leave the channel out",
        )
    missing = missing & ~masked
    if repair is None and missing.any():
        first = int(np.flatnonzero(missing)[0])
        raise TraceError(
            "a value is missing" if missing.sum() == 1 else f"{int(missing.sum())} values are missing",
            where=record.where(first, name),
            expected="a finite number in each sample",
            got=record.values[first, at],
            remedy="ask for repairs: {nan: interpolate}, {nan: hold} (a blank means: as before) or {nan: mask}",
        )
    if repair == "interpolate" and (missing[0] or missing[-1]):
        end = 0 if missing[0] else len(missing) - 1
        raise TraceError(
            "a value at the end of a record cannot be interpolated",
            where=record.where(end, name),
            expected="a finite number in the first and the last sample",
            got=record.values[end, at],
            remedy="cut the record by start and stop, or ask for repairs: {nan: mask}",
        )


def _longest_run(flags: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max())


def constants(record: Record, repairs: RepairOptions) -> Record:
    """Channels that never change.

    Args:
        record: Samples with finite values.
        repairs: ``constant: accept`` accepts them.

    Returns:
        The same samples.

    Raises:
        TraceError: If a channel is constant and that was not accepted.
    """
    still = [name for name, column in zip(record.names, record.values.T, strict=True) if np.ptp(column) == 0.0]
    if not still:
        return record
    if repairs.constant is None:
        raise TraceError(
            f"channel {', '.join(still)} never changes",
            where=f"{record.table.source}, channel {still[0]}",
            expected="a channel with information in it",
            got=f"{record.values[0, record.names.index(still[0])]:g} in all {len(record.values)} samples",
            remedy="check the sensor, leave the channel out, or ask for repairs: {constant: accept}",
        )
    return record.noted(f"constant and accepted: {', '.join(still)}")
