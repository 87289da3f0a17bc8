"""One file to a raw table, or to a trace."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError, UnitError
from sysid.ingest.assembling.assemble import Wanted, assemble
from sysid.ingest.assembling.in_units import stamps_in_seconds
from sysid.ingest.assembling.masks import check_masks
from sysid.ingest.assembling.timing import Timing, even_step, round_step, survey
from sysid.ingest.readers import READERS, choose_reader, read_with
from sysid.ingest.readers.text_source import bare_stem
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import FileOptions, GridOptions, RepairOptions
from sysid.ingest.tables.table import RawTable
from sysid.traces import Channel, Trace
from sysid.units import Reference
from sysid.written_units import plain_unit

DESCRIPTIONS = (".yaml", ".yml")
"""How the name of a file ends that describes a data set."""


def is_file_of_traces(source: str | Path) -> bool:
    """Whether a source is a file with traces, and not a data set: by its suffix, or as it is there and no YAML.

    Args:
        source: A name or a path.

    Returns:
        Whether it is; its reader says whether it can be read.
    """
    path = Path(source)
    suffix = path.suffix.lower()
    known = suffix in {suffix for reader in READERS for suffix in reader.suffixes}
    return known or (suffix not in DESCRIPTIONS and path.is_file())


def read_table(path: str | Path, *, files: FileOptions | None = None, repairs: RepairOptions | None = None) -> RawTable:
    """Read a file as columns of numbers, as they stand.

    Args:
        path: The file; its ending says which reader is used.
        files: How to read it; ``None`` recognises everything.
        repairs: ``ragged`` is the reader's to make; ``None`` makes none.

    Returns:
        The columns.

    Raises:
        ReaderError: If the file cannot be read.
        ConfigError: If an option does not fit the format.
        MissingExtraError: If the format needs a package that is not installed.
    """
    path, files = Path(path), files or FileOptions()
    reader = choose_reader(path, READERS, files.reader)
    table = read_with(reader, path, files, repairs or RepairOptions())
    return table if files.rows is None else table.between(*files.rows)


def read_trace(
    path: str | Path,
    *,
    name: str | None = None,
    channels: Sequence[Channel] | None = None,
    sample_time: float | None = None,
    files: FileOptions | None = None,
    grid: GridOptions | None = None,
    repairs: RepairOptions | None = None,
) -> Trace:
    """Read one file as a trace.

    A file that was written by :func:`~sysid.ingest.writers.write_trace` and not changed since comes
    back as the same trace, if nothing else is asked for.

    Args:
        path: The file.
        name: Name of the trace; ``None`` is the file's name without its ending.
        channels: The channels wanted, in the units wanted; ``None`` is every column but time.
        sample_time: Seconds between samples; ``None`` is the step of the time stamps.
        files: How to read it.
        grid: How samples come onto the grid.
        repairs: Which repairs may be made.

    Returns:
        The trace.

    Raises:
        ReaderError: If the file cannot be read.
        ChannelError: If a channel is missing.
        UnitError: If a unit is missing, unknown or of another quantity.
        TraceError: If something is wrong with the samples and its repair was not asked for.
        ConfigError: If the options do not fit.
    """
    files, repairs = files or FileOptions(), repairs or RepairOptions()
    held = [read_table(path, files=files, repairs=repairs)]
    return trace_of(
        held, name=name, channels=channels, sample_time=sample_time, files=files, grid=grid, repairs=repairs
    )


def trace_of(
    held: list[RawTable],
    *,
    name: str | None = None,
    channels: Sequence[Channel] | None = None,
    sample_time: float | None = None,
    files: FileOptions | None = None,
    grid: GridOptions | None = None,
    repairs: RepairOptions | None = None,
) -> Trace:
    """What was read of a file as a trace.

    Args:
        held: The table alone; it is taken out, as what assembles it lets go of columns that may be large.
        name: As for :func:`read_trace`, and so on.
        channels: The same.
        sample_time: The same.
        files: The same.
        grid: The same.
        repairs: The same.

    Returns:
        The trace.

    Raises:
        UserError: As :func:`read_trace`.
    """
    files, grid, repairs = files or FileOptions(), grid or GridOptions(), repairs or RepairOptions()
    path = held[0].source
    changed = repairs.mask or repairs.repeats or repairs.drift
    if name is None and channels is None and sample_time is None and not changed:
        own = _as_written(held[0])
        if own is not None:
            return own
    chosen = tuple(channels) if channels is not None else _all_channels(held[0], files)
    step, timing = (sample_time, None) if sample_time is not None else _step(held[0], files, grid)
    wanted = Wanted(name=name or bare_stem(path), channels=chosen, sample_time=step, timing=timing)
    trace = assemble(held.pop(), wanted, files=files, grid=grid, repairs=repairs)
    check_masks(repairs, [trace], cases=[trace.name], where=str(path))
    return trace


def _as_written(table: RawTable) -> Trace | None:
    """The trace that a file of ours holds, or ``None`` if it is not ours or was changed, its header too."""
    try:
        head: dict[str, Any] = json.loads(table.metadata.get("sysid", ""))
        channels = tuple(
            Channel(name=name, unit=unit, reference=Reference(reference), description=text)
            for name, unit, reference, text in head["channels"]
        )
        trace = Trace(
            name=head["name"],
            sample_time=head["sample_time"],
            start_time=head["start_time"],
            channels=channels,
            values=np.column_stack([column.values for column in table.columns[1 : len(channels) + 1]]),
            usable=_mask(table.columns[len(channels) + 1 :]) if head["masked"] else None,
            provenance=tuple(head["provenance"]),
        )
    except (ValueError, KeyError, TypeError):
        return None
    # Who corrects a unit or a name in the header means it, whatever the remark above it says.
    said = [_said(column) for column in table.columns[: len(channels) + 1]]
    same = said == [_said(channel) for channel in (Channel(name="time", unit="s"), *channels)]
    whole = trace.digest == head["digest"] and np.array_equal(table.columns[0].values, trace.time)
    return trace if same and whole else None


def _said(what: RawColumn | Channel) -> tuple[str, str | None, Reference]:
    """Name, unit and reference, the unit as it is written here however people write it."""
    return what.name, what.unit and (plain_unit(what.unit) or what.unit), what.reference or Reference.NONE


def _mask(columns: Sequence[RawColumn]) -> NDArray[np.bool_]:
    """The mask of a trace from its columns: one of all channels, or one of each."""
    masks = np.column_stack([column.values != 0.0 for column in columns])
    return masks[:, 0] if len(columns) == 1 else masks


def _all_channels(table: RawTable, files: FileOptions) -> tuple[Channel, ...]:
    time = None if files.time.step is not None else files.time.column or table.time
    masks = {"usable", *(f"usable {name}" for name in table.names)} if "sysid" in table.metadata else set[str]()
    skip = {time, *masks}
    channels = []
    for column in table.columns:
        if column.name in skip:
            continue
        if column.problem is not None:
            # A remark beside the measurements does no harm; what has a unit, or numbers, was measured, and is not lost.
            if not column.aside and (column.words is None or column.unit is not None):
                raise column.problem
            continue
        unit = files.units if isinstance(files.units, str) else files.units.get(column.name, column.unit)
        if unit is None:
            raise UnitError(
                "a column has no unit",
                where=f"{table.source}, column {column.name}",
                expected="a unit in the header, as in 'BP [kPa]', or in the options",
                got="none",
                remedy=f"write the unit into the header: '{column.name} [kPa]', or '[1]' for a pure number",
            )
        given = files.references
        reference = given.get(column.name) if isinstance(given, dict) else None
        channels.append(
            Channel(
                name=column.name,
                unit=unit,
                reference=reference or column.reference or Reference.NONE,
                description=column.description,
            )
        )
    if not channels:
        raise TraceError(
            "the file has no channel",
            where=table.source,
            expected="at least one column of numbers beside time",
            got=", ".join(table.names),
            remedy="choose another file, or read it with other options",
        )
    return tuple(channels)


def _step(table: RawTable, files: FileOptions, grid: GridOptions) -> tuple[float, Timing | None]:
    """The sample time that the stamps have, and their survey where there was one."""
    if table.step is not None and table.time is None and files.time.column is None:
        return table.step, None
    stamps = stamps_in_seconds(table, files)
    stamps = stamps[np.isfinite(stamps)]
    timing = survey(stamps) if len(stamps) else None
    if timing is None or not timing.step > 0.0:
        return 1.0, None  # no steps at all: the checks on the record say what is wrong with it
    even = even_step(stamps, timing, tolerance=grid.tolerance) if timing.in_order else None
    return round_step(timing.step) if even is None else even, timing
