"""The inputs of a free run, from whatever memory holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, TraceError
from sysid.ingest.assembling.assemble import Wanted, assemble
from sysid.ingest.assembling.in_units import stamps_in_seconds
from sysid.ingest.assembling.timing import survey
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.memory.in_python import remedies_of_a_run
from sysid.ingest.memory.memory_table import check_lengths, no_samples, table_of
from sysid.ingest.tables.columns import RawColumn
from sysid.ingest.tables.frames import INDEX, Columns, as_array, as_column, check_rows, columns_by_name
from sysid.ingest.tables.options import FileOptions, GridOptions, RepairOptions
from sysid.ingest.tables.table import RawTable
from sysid.traces import Channel, Trace, TraceSet, check_units
from sysid.units import Reference, convert, is_same_unit

WHERE = "the inputs of a simulation"


def inputs_of(
    values: Any,
    names: tuple[str, ...],
    *,
    sample_time: float | None = None,
    units: Mapping[str, str] | None = None,
    where: str = WHERE,
) -> NDArray[np.float64]:
    """Inputs, or outputs that were measured, as a matrix in a mapping's order.

    Args:
        values: An array, a frame, a dict of columns, a trace, or a data set of one; for a model without input the
            number of samples.
        names: The inputs.
        sample_time: Of the model, in seconds: a trace, and a frame whose index or column is time, must have it.
        units: Of the model's channels: a trace, whose channels have units, must be in them; columns whose names say
            others (``"u [mV]"``) are converted.
        where: What they are, for errors.

    Returns:
        Shape ``(n_samples, n_inputs)``, float64.

    Raises:
        ChannelError: If one is missing.
        ConfigError: If an array has another number of columns, the samples are at another distance, or a trace is in
            other units.
        TraceError: If a value is missing or not finite, or stamps are not one after the other at equal distances.
    """
    if not names and isinstance(values, int):
        return np.zeros((values, 0))
    values = only_record(values)
    if isinstance(values, TraceSet):
        raise ConfigError(
            "a run is over one record",
            where=where,
            expected="a trace, an array or a frame",
            got=f"a data set of {len(values.traces)}: {', '.join(values.names)}",
            remedy=f'write traces["{values.names[0]}"]',
        )
    wanted = {name: unit for name, unit in (units or {}).items() if name in names}
    if isinstance(values, Trace):
        _check_step(values.sample_time, sample_time, where=where)
        found = values.columns(names)
        check_units(wanted, values)
        return found
    named = columns_by_name(values, where=where)
    if named is None:
        found = _of_array(values, names, where=where)
    else:
        if len(names) == 1 and hasattr(values, "to_frame"):  # a series is one column, whatever it is called
            named = {names[0] if key != INDEX else key: column for key, column in named.items()}
        found = _of_columns(values, named, names, sample_time, wanted, where=where)
    if not len(found):
        raise no_samples(where)
    _check_finite(found, names, where=where)
    return found


def only_record(values: Any) -> Any:
    """The record of a data set that has no other; anything else as it is.

    Args:
        values: What was given as a record.

    Returns:
        The record.
    """
    return values.traces[0] if isinstance(values, TraceSet) and len(values.traces) == 1 else values


def _of_array(values: Any, names: tuple[str, ...], *, where: str) -> NDArray[np.float64]:
    array = as_column(values) if len(names) == 1 else as_array(values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[1] != len(names) or array.dtype.kind not in "buif":
        raise ConfigError(
            "the columns do not match the model",
            where=where,
            expected=f"numbers of shape (n_samples, {len(names)}), for {', '.join(names)}",
            got=f"shape {np.shape(array)} of type {array.dtype}",
            remedy="give one column for each, in this order, or columns by name",
        )
    return array.astype(np.float64)


def _of_columns(
    values: Any,
    named: Columns,
    names: tuple[str, ...],
    sample_time: float | None,
    units: Mapping[str, str],
    *,
    where: str,
) -> NDArray[np.float64]:
    table = table_of(named, name=where, channels=names)
    check_lengths(table, names)
    if table.time is None:
        check_rows(values, where=where)
    elif table.time not in names and len(table) > 1:
        _check_step(_even_step(table), sample_time, where=where)
    # A clock without a unit is in seconds; an input that is called as one, a torque t, is in its own.
    said = {header.name: header.unit for header in map(parse_header, named)}
    found = [table.find(name) for name in names]
    found = [replace(one, unit=said.get(one.name)) if one.name == table.time else one for one in found]
    columns = [_in_unit(one, units.get(name, "1")) for one, name in zip(found, names, strict=True)]
    return np.column_stack(columns) if names else np.zeros((len(table), 0))


def _even_step(table: RawTable) -> float:
    """The step of stamps, which have to be even as those of a record: a run over a gap would be one without it."""
    stamps = stamps_in_seconds(table, FileOptions())
    step = float(f"{survey(stamps).step:.9g}")
    row = RawColumn(name="row", values=np.zeros(len(table)), unit="1")
    alone = replace(table, columns=(table.find(str(table.time)), row), others=())
    wanted = Wanted(name="run", channels=(Channel(name="row", unit="1"),), sample_time=step, fixed=True)
    with remedies_of_a_run():
        assemble(
            alone,
            wanted,
            files=FileOptions(units={"row": "1"}),
            grid=GridOptions(fewest_samples=2),
            repairs=RepairOptions(constant="accept"),
        )
    return step


def _check_finite(found: NDArray[np.float64], names: tuple[str, ...], *, where: str) -> None:
    bad = ~np.isfinite(found)
    if bad.any():
        row, column = (int(index) for index in np.argwhere(bad)[0])
        raise TraceError(
            "a value is missing" if bad.sum() == 1 else f"{int(bad.sum())} values are missing",
            where=f"{where}, channel {names[column]}, sample {row}",
            expected="a finite number in each sample: a run has nothing else to go by",
            got=f"{found[row, column]}",
            remedy="fill them before, for example frame.interpolate() or frame.ffill(); of samples before a run, give "
            "those after the last that is missing",
        )


def _in_unit(column: RawColumn, unit: str) -> NDArray[np.float64]:
    """A column in a model's unit, where its name says another one; as it stands where one of them is none."""
    if column.unit is None or is_same_unit(column.unit, unit):
        return column.values
    return convert(column.values, column.unit, unit, reference=column.reference or Reference.NONE)


def _check_step(step: float, sample_time: float | None, *, where: str) -> None:
    if sample_time is not None and abs(step - sample_time) > 1e-3 * sample_time:
        raise ConfigError(
            "the samples are at another distance than the model's",
            where=where,
            expected=f"{sample_time:g} s",
            got=f"{step:g} s",
            remedy="resample them: sysid.data(frame, sample_time=..., grid={'method': 'linear'}) gives a trace",
        )
