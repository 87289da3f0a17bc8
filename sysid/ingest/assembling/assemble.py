"""A raw table to a trace: channels, units, repairs, the time grid, rounding."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError, UserError
from sysid.ingest.assembling import masks
from sysid.ingest.assembling import repairs as repair
from sysid.ingest.assembling.grid import Gridded, fill, grid_places, place, resample
from sysid.ingest.assembling.in_units import check_units_said, clock_by_its_steps, in_unit, stamps_in_seconds
from sysid.ingest.assembling.record import Record
from sysid.ingest.assembling.stamp_repairs import STEPS
from sysid.ingest.assembling.timing import Timing, survey
from sysid.ingest.cells.began import Began
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import ColumnOptions, FileOptions, GridOptions, RepairOptions
from sysid.ingest.tables.table import RawTable
from sysid.traces import Channel, Trace

_MOST_POINTS, _MOST_TIMES = 1_000_000, 1000


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What a trace shall be.

    Args:
        name: Name of the case.
        channels: The channels, with the units and references they shall have.
        sample_time: Seconds between samples.
        decimals: Decimals to round to, by channel.
        start: Seconds, in the file's time: what is before is cut off.
        stop: Seconds, in the file's time: what is after is cut off.
        fixed: Whether the sample time is somebody else's, a model's, and cannot be changed.
        timing: The survey of the file's stamps, where the sample time was taken from it.
    """

    name: str
    channels: tuple[Channel, ...]
    sample_time: float
    decimals: Mapping[str, int] = field(default_factory=dict)
    start: float | None = None
    stop: float | None = None
    fixed: bool = False
    timing: Timing | None = None

    def span(self, stamps: NDArray[np.float64]) -> tuple[float, float]:
        """The first and the last second that is not cut off, where a stamp may lie a little outside."""
        fuzz = 1e-9 * self.sample_time + 4.0 * float(np.spacing(np.abs(stamps[np.isfinite(stamps)]).max(initial=0.0)))
        low = -np.inf if self.start is None else self.start - fuzz
        return low, np.inf if self.stop is None else self.stop + fuzz

    def survey(self, stamps: NDArray[np.float64], *, longest_step: float | None) -> Timing:
        """The survey of stamps; the one that there is where they are all of the file's, in order as they were."""
        known = self.timing
        if known is not None and known.in_order and known.samples == len(stamps) and longest_step is None:
            return known
        return survey(stamps, longest_step=longest_step)


def assemble(
    table: RawTable, wanted: Wanted, *, files: FileOptions, grid: GridOptions, repairs: RepairOptions
) -> Trace:
    """Make a trace of a raw table.

    Args:
        table: The file as columns.
        wanted: What the trace shall be.
        files: Where channels and time are in the file, and in which units.
        grid: How samples come onto the grid.
        repairs: Which repairs may be made.

    Returns:
        The trace; its provenance says what was done.

    Raises:
        ChannelError: If a column is missing.
        UnitError: If a unit is missing, unknown or of another quantity.
        TraceError: If something is wrong with the samples and its repair was not asked for.
        ConfigError: If the options do not fit the file.
    """
    record = _select(table, wanted, files, repairs)
    source = table.source
    del table  # its columns stand in the record now, and may be large
    for step in STEPS:
        record = step(record, repairs)
    record = _cut(record, wanted)
    if len(record.stamps) < grid.fewest_samples:
        raise TraceError(
            "the record has too few samples",
            where=source,
            expected=f"at least {grid.fewest_samples}",
            got=len(record.stamps),
            remedy="record longer, or widen start and stop"
            + (", or lower grid: {fewest_samples: ...}" if len(record.stamps) > 1 else ": one sample is no record"),
        )
    record = repair.missing_values(record, repairs)
    record = repair.drifts(repair.repeated_values(record, repairs), repairs)
    record = repair.constants(record, repairs)
    gridded, record = _onto_grid(record, wanted, grid, repairs)
    values, usable, notes = _close_gaps(gridded, repairs, source=source, sample_time=wanted.sample_time)
    values, rounded = round_channels(values, wanted.channels, wanted.decimals)
    values.setflags(write=False)  # ours alone, and given away: a long record is not copied
    return Trace(
        name=wanted.name,
        sample_time=wanted.sample_time,
        channels=wanted.channels,
        values=values,
        start_time=gridded.start,
        usable=usable,
        provenance=(*record.notes, *notes, *rounded),
    )


def _select(table: RawTable, wanted: Wanted, files: FileOptions, repairs: RepairOptions) -> Record:
    """The channels that are wanted, in their units, and the stamps in seconds."""
    _check_names(wanted.channels, files, table.source)
    columns_of = {name: given.column for name, given in files.columns.items()}
    names = [columns_of.get(channel.name, channel.name) for channel in wanted.channels]
    table = table.narrowed(names, files.time.column)
    notes = [table.origin or _read_from(table.source), *table.notes]
    if wanted.fixed:
        files, clock = clock_by_its_steps(table, files, wanted.sample_time)
        notes += [clock] if clock else []
    stamps = stamps_in_seconds(table, files)
    hidden, masked = masks.hidden(
        stamps,
        [one.name for one in wanted.channels],
        repairs,
        case=wanted.name,
        span=wanted.span(stamps),
        sample_time=wanted.sample_time,
        source=table.source,
        began=_began(table, files),
    )
    notes += masked
    columns = []
    asked = {one.name: files.columns.get(one.name, ColumnOptions(column=one.name)) for one in wanted.channels}
    told = [(table.find(asked[one.name].column), one, asked[one.name]) for one in wanted.channels]
    check_units_said(told, files, table.source)
    for (told_by, channel, given), cells in zip(told, hidden.T, strict=True):
        seen = replace(told_by, values=np.where(cells, np.nan, told_by.values)) if cells.any() else told_by
        column, mark = repair.marks(table, seen, repairs)
        values, note = in_unit(column, channel, given, files, table.source)
        columns.append(values)
        notes += [one for one in (mark, note) if one]
    return Record(
        table=replace(table, columns=(RawColumn(name="", values=stamps),), others=(), records=()),
        stamps=stamps,
        names=tuple(channel.name for channel in wanted.channels),
        values=np.column_stack(columns),
        marked=_marked(table, names) | hidden,
        notes=tuple(notes),
    )


def _began(table: RawTable, files: FileOptions) -> Began | None:
    """When second 0 is, where the stamps are calendar time."""
    name = files.time.column or table.time
    return None if name is None or files.time.step is not None else table.find(name).began


def _read_from(source: Path) -> str:
    with source.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return f"read from {source.name} (SHA-256 {digest[:16]})"


def _marked(table: RawTable, names: Sequence[str]) -> NDArray[np.bool_]:
    """What a file that we wrote says of its values: it carries the mask of its trace as columns."""
    marked = np.zeros((len(table), len(names)), dtype=np.bool_)
    for at, name in enumerate(names) if "sysid" in table.metadata else ():
        for mask in ("usable", f"usable {name}"):
            if mask in table.names:
                marked[:, at] |= table.find(mask).values == 0.0
    return marked


def _check_names(channels: Sequence[Channel], files: FileOptions, source: Path) -> None:
    names = {channel.name for channel in channels}
    groups = {"columns": files.columns, "units": files.units, "references": files.references}
    for field_name, group in groups.items():
        strangers = sorted(set(group) - names) if isinstance(group, Mapping) else []
        if strangers:
            raise ConfigError.unknown(
                f"{field_name} names {strangers[0]}, which is not a channel",
                strangers[0],
                sorted(names),
                "write channel names on the left, column names or values on the right",
                where=f"the description of {source}, field source.files.{field_name}",
            )


def _cut(record: Record, wanted: Wanted) -> Record:
    if wanted.start is None and wanted.stop is None:
        return record
    low, high = wanted.span(record.stamps)
    keep = (record.stamps >= low) & (record.stamps <= high)
    if not keep.any():
        raise TraceError(
            "nothing is left between start and stop",
            where=record.table.source,
            expected=f"times between {record.stamps[0]:g} s and {record.stamps[-1]:g} s",
            got=f"start {wanted.start}, stop {wanted.stop}",
            remedy="correct start and stop; they are seconds in the file's own time",
        )
    return record.keep(
        keep, f"cut to {int(keep.sum())} of {len(keep)} samples by start {wanted.start}, stop {wanted.stop}"
    )


def _onto_grid(record: Record, wanted: Wanted, grid: GridOptions, repairs: RepairOptions) -> tuple[Gridded, Record]:
    stamps, sample_time = record.stamps, wanted.sample_time
    start = float(stamps[0])
    timing = wanted.survey(stamps, longest_step=grid.longest_step)
    if len(timing.gaps) and repairs.gaps is None:
        raise _gap_error(record, timing)
    _check_span(record, wanted)
    places = grid_places(stamps, sample_time, start=start, tolerance=grid.tolerance)
    if places is not None and np.array_equal(np.flatnonzero(places[1:] > places[:-1] + 1), timing.gaps):
        return place(stamps, record.values, places, record.marked), record
    # A clock that is less than a sample apart at the end goes at the pace that was asked for.
    same = abs(timing.step - sample_time) * len(stamps) < sample_time
    uneven = same or timing.jitter > grid.tolerance * timing.step
    if uneven and repairs.jitter is None:
        raise _jitter_error(record, timing, grid)
    if grid.method is None:
        raise _step_error(record, timing, wanted, uneven=uneven)
    if grid.method == "average" and timing.median_step > sample_time * (1.0 + grid.tolerance):
        raise ConfigError(
            "there is nothing to average: the record is slower than the sample time",
            where=record.table.source,
            expected=f"a step of at most {sample_time:g} s",
            got=f"{timing.median_step:g} s",
            remedy="choose grid: {method: linear} or {method: hold}, or a longer sample_time",
        )
    # What the survey found no gaps in has none, however uneven its steps.
    longest = grid.longest_step or (1.5 * timing.median_step if len(timing.gaps) else float(np.diff(stamps).max()))
    gridded = resample(
        stamps,
        record.values,
        sample_time=sample_time,
        method=grid.method,
        start=start,
        longest_step=max(longest, sample_time) if grid.method == "average" else longest,
        marked=record.marked,
    )
    told = f"resampled ({grid.method}) from a step of {timing.step:.6g} s to {sample_time:g} s"
    return gridded, record.noted(f"{told}, jitter {timing.jitter:.3g} s" if uneven else told)


def _check_span(record: Record, wanted: Wanted) -> None:
    """One stamp that is nonsense must not make a grid that no memory holds."""
    points = (float(record.stamps[-1]) - float(record.stamps[0])) / wanted.sample_time
    if points <= max(_MOST_POINTS, _MOST_TIMES * len(record.stamps)):
        return
    worst = int(np.argmax(np.diff(record.stamps)))
    raise TraceError(
        "the record is far too long for its samples",
        where=record.where(worst),
        expected=f"at most {_MOST_TIMES} grid points for each of {len(record.stamps)} samples",
        got=f"{points:.3g} points of {wanted.sample_time:g} s between {record.stamps[0]:g} s and "
        f"{record.stamps[-1]:g} s; the longest step is after this sample",
        remedy=f"correct the time stamp, or cut the record: stop: {float(record.stamps[worst])!r} in its case",
    )


def _gap_error(record: Record, timing: Timing) -> TraceError:
    first, gaps = int(timing.gaps[0]), "1 gap" if len(timing.gaps) == 1 else f"{len(timing.gaps)} gaps"
    return TraceError(
        f"{timing.missing} samples are missing in {gaps}",
        where=record.where(first),
        expected=f"the next sample {timing.median_step:g} s later",
        got=f"{record.stamps[first + 1] - record.stamps[first]:g} s later",
        remedy="ask for repairs: {gaps: linear}, {gaps: hold} or {gaps: mask}; for a record whose stamps are "
        "far apart by nature, say from where on a step is a gap (grid: {longest_step: ...})",
    )


def _jitter_error(record: Record, timing: Timing, grid: GridOptions) -> TraceError:
    steps = np.diff(record.stamps)
    steps[timing.gaps] = timing.median_step  # gaps are dealt with by themselves
    worst = int(np.argmax(np.abs(steps - timing.median_step)))
    return TraceError(
        "the time stamps are uneven (jitter)",
        where=record.where(worst),
        expected=f"steps of {timing.step:g} s to within {100 * grid.tolerance:g} % of one",
        got=f"stamps up to {timing.jitter:g} s off, steps from {steps.min():g} s to {steps.max():g} s",
        remedy="ask for repairs: {jitter: resample} with grid: {method: linear} or {method: hold}, "
        "or allow more (grid: {tolerance: ...})",
    )


def _step_error(record: Record, timing: Timing, wanted: Wanted, *, uneven: bool) -> UserError:
    if uneven:
        return ConfigError(
            "repairs: {jitter: resample} needs a method",
            where=f"the description of {record.table.source}",
            expected="grid: {method: linear}, {method: hold} or {method: average}",
            got="no method",
            remedy="add grid: {method: linear} to source",
        )
    change = "" if wanted.fixed else f"write sample_time: {timing.step:.6g}, or "
    return TraceError(
        f"the record has another sample time than the {'model' if wanted.fixed else 'data set'}",
        where=record.table.source,
        expected=f"{wanted.sample_time:g} s between samples",
        got=f"{timing.step:.9g} s",
        remedy=f"{change}ask for a resampling: grid: {{method: average}} to "
        "decimate, {method: linear} or {method: hold} to interpolate; check the unit of time too",
    )


def _empty_error(gridded: Gridded, source: Path, sample_time: float) -> TraceError:
    first = int(np.flatnonzero(gridded.empty)[0])
    return TraceError(
        f"{int(gridded.empty.sum())} intervals of the grid hold no sample",
        where=f"{source}, at {gridded.start + first * sample_time:g} s",
        expected=f"at least one sample in every {sample_time:g} s",
        got="none",
        remedy="ask for repairs: {gaps: linear}, {gaps: hold} or {gaps: mask}, or choose a longer sample_time",
    )


def _close_gaps(
    gridded: Gridded, repairs: RepairOptions, *, source: Path, sample_time: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_] | None, list[str]]:
    """Values without holes, the mask where one is needed, and what was done."""
    notes = []
    values, usable = gridded.values, ~gridded.tainted
    if gridded.empty.any():
        count, method = int(gridded.empty.sum()), repairs.gaps
        if method is None:
            raise _empty_error(gridded, source, sample_time)
        values = fill(gridded, "hold" if method == "hold" else "linear")
        if method == "mask":
            usable = usable & ~gridded.empty[:, None]
        notes.append(f"{count} missing samples {'masked' if method == 'mask' else f'filled ({method})'}")
    return values, None if usable.all() else usable, notes


def round_channels(
    values: NDArray[np.float64], channels: Sequence[Channel], decimals: Mapping[str, int]
) -> tuple[NDArray[np.float64], list[str]]:
    """Round channels to decimals.

    Args:
        values: Shape ``(n_samples, n_channels)``.
        channels: What the columns are.
        decimals: Decimals by channel; those not named are left as they are.

    Returns:
        The values, and one sentence per channel that was rounded.
    """
    if not decimals:
        return values, []
    rounded = np.array(values, dtype=np.float64)
    notes = []
    for index, channel in enumerate(channels):
        if channel.name in decimals:
            rounded[:, index] = np.round(rounded[:, index], decimals[channel.name])
            notes.append(f"{channel.name}: rounded to {decimals[channel.name]} decimals")
    return rounded, notes
