"""What can be wrong with the samples of a record: refused, or repaired where that repair was asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError, did_you_mean
from sysid.ingest.blanks import marks_in
from sysid.ingest.columns import RawColumn
from sysid.ingest.options import RepairOptions
from sysid.ingest.table import RawTable

HOUR = 3600.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """The samples of one file on their way to a trace.

    Args:
        table: The file they came from.
        rows: Shape ``(n,)``: row of the file that each sample was; ``None`` while it is all of them, in their order.
        stamps: Shape ``(n,)``, seconds.
        names: Channel names.
        values: Shape ``(n, n_channels)``.
        marked: Shape ``(n, n_channels)``: values that must not count.
        notes: What was done, one sentence each.
    """

    table: RawTable
    rows: NDArray[np.intp] | None = None
    stamps: NDArray[np.float64]
    names: tuple[str, ...]
    values: NDArray[np.float64]
    marked: NDArray[np.bool_]
    notes: tuple[str, ...] = field(default=())

    def at(self, index: int) -> str:
        """Where a sample is in the file, for messages."""
        return self.table.place(index if self.rows is None else int(self.rows[index]))

    def where(self, index: int, channel: str | None = None) -> str:
        """File, channel and sample, for messages."""
        middle = "" if channel is None else f", channel {channel}"
        return f"{self.table.source}{middle}, {self.at(index)}"

    def keep(self, chosen: NDArray[np.intp] | NDArray[np.bool_], note: str | None = None) -> Record:
        """Some of the samples, in the order given."""
        taken = np.arange(len(self.stamps))[chosen]
        return replace(
            self,
            rows=taken if self.rows is None else self.rows[taken],
            stamps=self.stamps[chosen],
            values=self.values[chosen],
            marked=self.marked[chosen],
            notes=self.notes if note is None else (*self.notes, note),
        )

    def noted(self, note: str) -> Record:
        """The same samples with a sentence added."""
        return replace(self, notes=(*self.notes, note))


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


def empty_stamps(record: Record, repairs: RepairOptions) -> Record:
    """Samples without a time stamp.

    Args:
        record: The samples.
        repairs: ``stamps: drop`` drops them.

    Returns:
        The samples that have one.

    Raises:
        TraceError: If there are such samples and no repair was asked for, or nothing else is left.
    """
    bad = ~np.isfinite(record.stamps)
    if not bad.any():
        return record
    first = int(np.flatnonzero(bad)[0])
    if repairs.stamps is None or bad.all():
        raise TraceError(
            f"{int(bad.sum())} samples have no time stamp",
            where=record.where(first, record.table.time),
            expected="a number in each row of the time column",
            got=record.stamps[first],
            remedy="correct the file, or ask for repairs: {stamps: drop}",
        )
    return record.keep(~bad, f"{int(bad.sum())} samples without a time stamp dropped, first at {record.at(first)}")


def backward(record: Record, repairs: RepairOptions) -> Record:
    """Time stamps that step back.

    Args:
        record: The samples.
        repairs: ``backward: sort`` sorts by time, ``backward: drop`` drops those that step back.

    Returns:
        Samples whose stamps never fall.

    Raises:
        TraceError: If a stamp steps back and no repair was asked for.
    """
    if not (record.stamps[1:] < record.stamps[:-1]).any():
        return record
    late = record.stamps[1:] < np.maximum.accumulate(record.stamps)[:-1]
    bad = np.flatnonzero(late) + 1
    if not len(bad):
        return record
    first = int(bad[0])
    if repairs.backward is None:
        raise TraceError(
            f"{len(bad)} time stamps step back",
            where=record.where(first),
            expected=f"a time after {record.stamps[first - 1]:g} s",
            got=f"{record.stamps[first]:g} s",
            remedy=_zone(record)
            or _set_back(record)
            or "split the file where a new recording starts, or ask for repairs: {backward: sort} or {backward: drop}",
        )
    told = f"{len(bad)} backward time stamps, first at {record.at(first)}"
    if repairs.backward == "sort":
        return record.keep(np.argsort(record.stamps, kind="stable"), f"sorted by time: {told}")
    keep = np.ones(len(record.stamps), dtype=np.bool_)
    keep[bad] = False
    return record.keep(keep, f"dropped: {told}")


def _set_back(record: Record) -> str | None:
    """What to do where the clock goes back once, by an hour: it was set back, and an hour comes twice."""
    steps = np.diff(record.stamps)
    back = steps[steps < 0.0]
    usual = float(np.median(steps))
    if len(back) != 1 or abs(float(back[0]) - usual + HOUR) > 0.5 * abs(usual):
        return None
    return (
        "a clock that was set back by an hour, as in autumn: say its zone (time: {zone: Europe/Berlin}; of a frame, "
        'frame.tz_localize("Europe/Berlin", ambiguous="infer")). Sorted by time, two hours would be one'
    )


def _zone(record: Record) -> str | None:
    """What to do where a clock on the wall explains the stamps."""
    zone = record.table.settings.get("zone")
    if not zone:
        return None
    return f"an hour comes twice, as on a clock on the wall: write time: {{column: {record.table.time}, zone: {zone}}}"


def duplicates(record: Record, repairs: RepairOptions) -> Record:
    """Time stamps that stand more than once.

    Args:
        record: Samples whose stamps never fall.
        repairs: ``duplicates: drop`` keeps the first, ``last`` the last, and ``average`` their mean.

    Returns:
        Samples whose stamps rise.

    Raises:
        TraceError: If a stamp stands twice and no repair was asked for.
    """
    bad = np.flatnonzero(record.stamps[1:] == record.stamps[:-1]) + 1
    if not len(bad):
        return record
    first = int(bad[0])
    if repairs.duplicates is None:
        raise TraceError(
            f"{len(bad)} time stamps are duplicates",
            where=record.where(first),
            expected=f"a time after {record.stamps[first]:g} s",
            got=f"{record.stamps[first]:g} s again",
            remedy=_zone(record)
            or _in_single(record)
            or "ask for repairs: {duplicates: drop}, {duplicates: last} or {duplicates: average}",
        )
    keep = np.ones(len(record.stamps), dtype=np.bool_)
    keep[bad] = False
    told = f"{len(bad)} duplicate time stamps, first at {record.at(first)}"
    if repairs.duplicates == "drop":
        return record.keep(keep, f"dropped: {told}")
    if repairs.duplicates == "last":
        return record.keep(np.append(keep[1:], True), f"the last one of each kept: {told}")
    group = np.cumsum(keep) - 1
    with np.errstate(invalid="ignore"):
        sums = np.column_stack([np.bincount(group, weights=column) for column in record.values.T])
    means = sums / np.bincount(group)[:, None]
    return replace(record.keep(keep, f"averaged: {told}"), values=means)


def _in_single(record: Record) -> str | None:
    """What to do where stamps are numbers of 32 bit, which count too coarsely that far from 0."""
    stamps = record.stamps
    if not np.array_equal(stamps.astype(np.float32), stamps):
        return None
    coarse = float(np.spacing(np.float32(np.abs(stamps).max())))
    steps = np.diff(stamps)
    if not float(steps[steps > 0.0].min(initial=np.inf)) < 2.0 * coarse:
        return None
    return (
        f"the stamps are numbers of 32 bit, which count in steps of {coarse:.3g} s here: save them in 64 bit, or leave "
        "them out and say the sample time. Dropped, samples of different times would be lost"
    )


def missing_values(record: Record, repairs: RepairOptions) -> Record:
    """Values that are empty, NaN or infinite.

    Args:
        record: Samples whose stamps rise.
        repairs: ``nan: interpolate`` puts them on the line between their neighbours in time; ``nan: hold`` takes the
            value before; ``nan: mask`` interpolates (or holds, at the ends) and marks the samples as not usable.
            Before a first value there is none to hold: those samples take the first and are marked.

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
        missing = bad[:, column]
        if not missing.any():
            continue
        repair = repairs.nan.get(name) if isinstance(repairs.nan, dict) else repairs.nan
        _check_missing(record, missing, name, repair)
        known = np.flatnonzero(~missing)
        if repair == "hold":
            before = np.searchsorted(known, np.flatnonzero(missing), side="right") - 1
            values[missing, column] = values[known[np.maximum(before, 0)], column]
            marked[: known[0], column] = True
        else:
            values[missing, column] = np.interp(record.stamps[missing], record.stamps[known], values[known, column])
        if repair == "mask":
            marked[:, column] |= missing
        first = int(np.flatnonzero(missing)[0])
        done = {"interpolate": "interpolated", "hold": "as before", "mask": "filled and masked"}[repair or "mask"]
        early = f", {known[0]} before the first value masked" if repair == "hold" and known[0] else ""
        record = record.noted(
            f"{name}: {int(missing.sum())} missing values {done}{early}, first at {record.at(first)}, "
            f"longest run {_longest_run(missing)}"
        )
    return replace(record, values=values, marked=marked)


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
            raise ConfigError(
                f"repairs.{kind} names {strangers[0]}, which is not a channel",
                where=f"the description of {record.table.source}",
                expected=f"one of {', '.join(record.names)}",
                got=strangers[0],
                remedy=did_you_mean(strangers[0], record.names, "write the names of channels on the left"),
            )


def _check_missing(record: Record, missing: NDArray[np.bool_], name: str, repair: str | None) -> None:
    first = int(np.flatnonzero(missing)[0])
    got = record.values[first, record.names.index(name)]
    if missing.all():
        raise TraceError(
            "a channel has no values at all",
            where=f"{record.table.source}, channel {name}",
            expected="numbers",
            got="only empty cells or NaN",
            remedy="choose another column, or leave the channel out",
        )
    if repair is None:
        raise TraceError(
            "a value is missing" if missing.sum() == 1 else f"{int(missing.sum())} values are missing",
            where=record.where(first, name),
            expected="a finite number in each sample",
            got=got,
            remedy="ask for repairs: {nan: interpolate}, {nan: hold} (a blank means: as before) or {nan: mask}",
        )
    if repair == "interpolate" and (missing[0] or missing[-1]):
        at = 0 if missing[0] else len(missing) - 1
        raise TraceError(
            "a value at the end of a record cannot be interpolated",
            where=record.where(at, name),
            expected="a finite number in the first and the last sample",
            got=record.values[at, record.names.index(name)],
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


STEPS: tuple[Callable[[Record, RepairOptions], Record], ...] = (empty_stamps, backward, duplicates)
"""The repairs of time stamps, in the order in which they are made."""
