"""Columns and time stamps of a raw table in the units that are asked for, and what is told where none is said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.errors import TraceError, UnitError
from sysid.ingest.cells.words import quoted
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.options import ColumnOptions, FileOptions
from sysid.ingest.tables.table import RawTable
from sysid.ingest.tables.time_columns import time_unit
from sysid.traces import Channel
from sysid.units import Reference, convert, is_same_unit

T = TypeVar("T", str, Reference)

_CLOCKS = ("s", "ms", "us", "min", "h")
_SAME_STEP = 1e-3
"""How far the median step of the stamps may be from a model's sample time, to be taken for it, as a share of it."""


def clock_by_its_steps(table: RawTable, files: FileOptions, sample_time: float) -> tuple[FileOptions, str | None]:
    """The unit of a time column that says none, where the record is of a known sample time.

    Args:
        table: The file as columns.
        files: What is declared.
        sample_time: Seconds between samples, as a model has them.

    Returns:
        The options with the one unit of time in which the stamps have these steps, and a sentence that says so; the
        same options and ``None`` where a unit is said, or no unit does it.
    """
    name = files.time.column or table.time
    if name is None or files.time.step is not None or files.time.unit is not None or table.find(name).unit is not None:
        return files, None
    steps = np.diff(table.find(name).values)
    steps = steps[np.isfinite(steps)]
    usual = float(np.median(steps)) if len(steps) else 0.0
    for unit in _CLOCKS:
        seconds = float(convert(np.array([usual]), unit, "s")[0])
        if abs(seconds - sample_time) <= _SAME_STEP * sample_time:
            time = files.time.model_copy(update={"column": name, "unit": unit})
            told = f"{name} is taken in {unit}: its steps are the model's sample time, {sample_time:g} s"
            return files.model_copy(update={"time": time}), told
    return files, None


def stamps_in_seconds(table: RawTable, files: FileOptions) -> NDArray[np.float64]:
    """The time stamps of a table.

    Args:
        table: The file as columns.
        files: Which column holds time, and in which unit.

    Returns:
        Shape ``(n_rows,)``, seconds; NaN where the file has none.

    Raises:
        TraceError: If no time column is named or recognised.
        UnitError: If its unit is missing or not one of time.
    """
    if files.time.step is not None:
        return files.time.step * np.arange(len(table), dtype=np.float64)
    name = files.time.column or table.time
    if name is None and table.step is not None:
        return table.step * np.arange(len(table), dtype=np.float64)
    if name is None:
        raise TraceError(
            "no time column was recognised",
            where=table.source,
            expected="a column named t or time, or one with a unit of time",
            got=", ".join(table.names),
            remedy="name it: files: {time: 't [ms]'}, or, for a file without one, files: {time: {step: 0.1}}",
        )
    column = table.find(name)
    unit = column.unit if files.time.unit in {None, "datetime"} else files.time.unit
    if unit is None:
        raise UnitError(
            "the time column has no unit",
            where=f"{table.source}, column {column.name}",
            expected="s, ms, min or another unit of time",
            got="none",
            remedy=f"write files: {{time: '{column.name} [s]'}}",
        )
    return _converted(column.values, time_unit(unit), "s", where=f"{table.source}, column {column.name}")


def check_units_said(
    asked: Sequence[tuple[RawColumn, Channel, ColumnOptions]], files: FileOptions, source: Path
) -> None:
    """Refuse columns of which nothing says a unit, all of them at once.

    A channel without a unit, in a file without units, is what it is.

    Args:
        asked: Each column, its channel, and what is declared of it.
        files: What is declared of all columns.
        source: The file, for the error.

    Raises:
        UnitError: If there are any.
    """
    missing = [
        (column.name, channel.name, channel.unit)
        for column, channel, given in asked
        if not (given.unit or _for_channel(files.units, channel.name) or column.unit or channel.unit == "1")
    ]
    if not missing:
        return
    one, (header, name, unit) = len(missing) == 1, missing[0]
    headers = ", ".join(f"'{header} [{unit}]'" for header, _, unit in missing)
    units = ", ".join(f"{name}: {quoted(unit) if unit[:1] in '%*@-' else unit}" for _, name, unit in missing)
    raise UnitError(
        "a column has no unit" if one else f"{len(missing)} columns have no unit",
        where=f"{source}, channel {name} (column {header})" if one else source,
        expected="a unit in the file or in the description",
        got="none" if one else f"none for {', '.join(name for _, name, _ in missing)}",
        remedy=f"if {f'it is {unit}' if one else 'they are in these units'}, write {headers} as "
        f"{'its header' if one else 'their headers'}, or files: {{units: {{{units}}}}} in a dataset.yaml",
    )


def in_unit(
    column: RawColumn, channel: Channel, given: ColumnOptions, files: FileOptions, source: Path
) -> tuple[NDArray[np.float64], str | None]:
    """A column in the unit of its channel.

    Args:
        column: As it stands in the file.
        channel: The channel, with unit and reference.
        given: What is declared of the column.
        files: What is declared of all columns.
        source: The file, for errors.

    Returns:
        Its values, shape ``(n_rows,)``, and what was converted, ``None`` where nothing was.

    Raises:
        TraceError: If it holds integers that float64 cannot.
        UnitError: If unit or reference are missing, unknown or of another quantity.
    """
    where = f"{source}, channel {channel.name} (column {column.name})"
    if column.counted_from:
        raise TraceError(
            "integers are too large for float64",
            where=where,
            expected="integers of at most 53 bits",
            got=f"values from {column.counted_from}",
            remedy="subtract the first value before the export, or leave the channel out",
        )
    check_units_said([(column, channel, given)], files, source)
    declared = given.unit or _for_channel(files.units, channel.name)
    unit = declared or column.unit or "1"
    reference = given.reference or _for_channel(files.references, channel.name) or column.reference
    if channel.reference is not Reference.NONE and reference is None:
        # Who copies a remedy must not move a pressure by an atmosphere: it names what is wanted here.
        meant = channel.reference.value
        other = (Reference.GAUGE if channel.reference is Reference.ABSOLUTE else Reference.ABSOLUTE).value
        raise UnitError(
            "the file does not say what a pressure is measured from",
            where=where,
            expected="gauge or absolute",
            got="neither",
            remedy=f"where it is {meant}, as here, write '{column.name} [{unit} {meant}]' as its header, "
            f"or files: {{references: {{{channel.name}: {meant}}}}} in a dataset.yaml; {other} where it is that",
        )
    if channel.reference is Reference.NONE and isinstance(files.references, Reference):
        reference = column.reference  # one reference for all pressures is not meant for the others
    values = _converted(
        column.values, unit, channel.unit, where=where, reference=reference, to_reference=channel.reference
    )
    notes = []
    if declared and column.unit and declared != column.unit:
        notes.append(f"taken as {declared} although the file says {column.unit}")
    origin, target = reference or Reference.NONE, channel.reference
    is_named_alike = "1" not in {unit, channel.unit} and is_same_unit(unit, channel.unit)  # of "1" any is the same
    if origin is not target or not (unit == channel.unit or is_named_alike):
        notes.append(f"converted from {_label(unit, origin)} to {_label(channel.unit, target)}")
    return values, f"{channel.name}: {', '.join(notes)}" if notes else None


def _for_channel(given: T | Mapping[str, T], name: str) -> T | None:
    return given.get(name) if isinstance(given, Mapping) else given


def _label(unit: str, reference: Reference) -> str:
    return unit if reference is Reference.NONE else f"{unit} {reference.value}"


def _converted(
    values: NDArray[np.float64],
    unit: str,
    to_unit: str,
    *,
    where: str,
    reference: Reference | None = None,
    to_reference: Reference = Reference.NONE,
) -> NDArray[np.float64]:
    reference = reference or Reference.NONE
    if unit == to_unit and reference is to_reference:
        return values
    try:
        return convert(values, unit, to_unit, reference=reference, to_reference=to_reference)
    except UnitError as error:
        raise UnitError(error.what, where=where, expected=error.expected, got=error.got, remedy=error.remedy) from error
