"""What can be wrong with the time stamps of a record: refused, or repaired where that repair was asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sysid.errors import TraceError
from sysid.ingest.assembling.record import Record
from sysid.ingest.tables.options import RepairOptions

HOUR = 3600.0


def _empty_stamps(record: Record, repairs: RepairOptions) -> Record:
    """Samples without a time stamp, which ``stamps: drop`` drops; refused where no repair was asked for."""
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
            "1 time stamp steps back" if len(bad) == 1 else f"{len(bad)} time stamps step back",
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


STEPS: tuple[Callable[[Record, RepairOptions], Record], ...] = (_empty_stamps, backward, duplicates)
"""The repairs of time stamps, in the order in which they are made."""
