"""Data that is in memory already: frames, arrays, dicts and lists of them become a TraceSet, by the way that files go.

A table is known by what it can do and not by its type, so that no library has to be there: pandas and polars frames,
xarray data sets, NumPy arrays (structured ones too), torch tensors, plain lists.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError
from sysid.ingest.assemble import Wanted, assemble, stamps_in_seconds
from sysid.ingest.headers import parse_header
from sysid.ingest.options import ColumnOptions, FileOptions, GridOptions, RepairOptions, TimeOptions
from sysid.ingest.split import Split, split_traces
from sysid.ingest.table import RawColumn, RawTable, array_column, by_length, recognise_time
from sysid.ingest.timing import survey
from sysid.traces import Channel, Trace, TraceSet
from sysid.units import Reference, check_unit

INDEX = "(index)"
"""Name of the column that a frame's index becomes where it is time; no file can have it by chance."""

Names = str | Sequence[str] | None


def data(
    values: Any,
    *,
    inputs: Names = None,
    outputs: Names = None,
    sample_time: float | None = None,
    units: Mapping[str, str] | Sequence[str] | str | None = None,
    split: Split = None,
    repairs: Mapping[str, str] | None = None,
    grid: Mapping[str, Any] | None = None,
    name: str = "data",
) -> TraceSet:
    """A data set from what is in memory.

    Args:
        values: One experiment or several. One is a frame (pandas, polars, xarray), a dict of columns, a pair ``(u, y)``
            of arrays of shape ``(n_samples,)`` or ``(n_samples, n_channels)``, or one array whose columns are the
            inputs and then the outputs. Several are a list of those, or a dict of them by name; they may differ in
            length and are never joined.
        inputs: Names of the input channels. For arrays ``u``, or ``u1``, ``u2`` ... where none is given; an empty list
            for a record without input.
        outputs: Names of the output channels; for arrays ``y``, or ``y1``, ``y2`` ... where none is given. Of a frame
            the channels that are named are taken, all of them where none is.
        sample_time: Seconds between samples. Not needed where a column or an index holds time; where it is given
            beside one, the record must have it, or ``grid`` says how it is resampled.
        units: Units by channel, one for all, or in the order of inputs and outputs. A column named ``level [cm]`` has
            its unit with it. A channel that nothing is said of counts as a pure number.
        split: Roles: a share (``0.7`` fits the first 70 % and validates on the rest), two or three shares (fitted,
            chosen by, only scored), spans of seconds by role (``{"estimation": (0, 60), "validation": (60, 90)}``), the
            name of a column that holds the role of each sample, or a role for each experiment. All is for estimation
            where nothing is said.
        repairs: As in a data set's ``source.repairs``: ``{"nan": "mask"}``, ``{"gaps": "linear"}`` ...
        grid: As in a data set's ``source.grid``: ``{"method": "linear"}`` ...
        name: Name of the data set.

    Returns:
        The traces with their roles.

    Raises:
        ConfigError: If the values are of no kind that is known, or nothing tells the sample time.
        ChannelError: If a named channel is not there.
        TraceError: If samples are missing, uneven or not finite and no repair was asked for.
        UnitError: If a unit is not known.

    Example:
        >>> u = np.repeat([0.0, 1.0, 0.0], 10)
        >>> traces = data((u, 2 * u), sample_time=0.1, units={"u": "V", "y": "m"}, split=0.5)
        >>> [(trace.name, len(trace), traces.roles[trace.name].value) for trace in traces]
        [('estimation', 15, 'estimation'), ('validation', 15, 'validation')]
    """
    wanted_inputs, wanted_outputs = _names(inputs), _names(outputs)
    experiments = _experiments(values)
    whole: list[Trace] = []
    marks: list[NDArray[Any] | None] = []
    for number, (label, one) in enumerate(experiments.items()):
        columns = _columns(one, wanted_inputs, wanted_outputs, where=label)
        channels = [*(wanted_inputs or ()), *(wanted_outputs or ())]
        marks.append(_taken_out(columns, split, channels, where=label))
        table = _table(columns, name=label)
        _check_lengths(table, channels)
        trace = _trace(
            table,
            channels or [column for column in table.names if column != table.time],
            label=label,
            sample_time=sample_time if number == 0 or sample_time is not None else whole[0].sample_time,
            units=units,
            repairs=RepairOptions.model_validate({"constant": "accept", **(repairs or {})}),
            grid=GridOptions.model_validate({"fewest_samples": 2, **(grid or {})}),
        )
        whole.append(trace)
    return split_traces(tuple(whole), split, marks, name=name)


def _names(given: Names) -> tuple[str, ...] | None:
    return None if given is None else (given,) if isinstance(given, str) else tuple(given)


def _experiments(values: Any) -> dict[str, Any]:
    """Experiments by name; a single one is called ``record``."""
    if isinstance(values, Mapping) and values and all(_is_record(one) for one in values.values()):
        return {str(label): one for label, one in values.items()}
    if isinstance(values, list) and values and not np.isscalar(values[0]):
        return {f"record-{number}": one for number, one in enumerate(values, start=1)}
    return {"record": values}


def _is_record(value: Any) -> bool:
    """Whether a value of a dict is a record of its own and not a column."""
    return isinstance(value, tuple | Mapping) or _is_frame(value) or getattr(value, "ndim", 1) == 2


def _is_frame(value: Any) -> bool:
    return any(hasattr(value, attribute) for attribute in ("get_columns", "data_vars")) or (
        hasattr(value, "columns") and hasattr(value, "index")
    )


def _columns(
    one: Any, inputs: tuple[str, ...] | None, outputs: tuple[str, ...] | None, *, where: str
) -> dict[str, NDArray[Any]]:
    """The columns of one record by name; those of an array are the inputs and then the outputs."""
    named = columns_by_name(one)
    if named is not None:
        return named
    if isinstance(one, tuple) and len(one) == 2:
        _check_indexes(one, where=where)
        u, y = (_two_dimensional(part, where=where) for part in one)
        return dict(zip([*_given(inputs, u, "u"), *_given(outputs, y, "y")], [*u.T, *y.T], strict=True))
    return _of_matrix(_two_dimensional(one, where=where), inputs, outputs, where=where)


def columns_by_name(values: Any) -> dict[str, NDArray[Any]] | None:
    """The columns of a table that has names for them.

    Args:
        values: A frame, a dict of columns, a structured array, or anything else.

    Returns:
        The columns by name; a frame's index is among them where it is time. ``None`` for what has no names.
    """
    if isinstance(values, Mapping):
        return {str(key): _array(value) for key, value in values.items()}
    if hasattr(values, "get_columns"):  # polars
        return {str(column.name): _array(column.to_numpy()) for column in values.get_columns()}
    if hasattr(values, "data_vars"):  # xarray.Dataset
        keys = [key for key in (*values.coords, *values.data_vars) if values[key].ndim == 1]
        return {str(key): _array(values[key].values) for key in keys}
    if hasattr(values, "columns") and hasattr(values, "index"):  # pandas.DataFrame
        return {**_index(values.index), **{_label(key): _numpy(values[key]) for key in values.columns}}
    if hasattr(values, "to_frame") and hasattr(values, "index"):  # pandas.Series
        return {**_index(values.index), str(values.name if values.name is not None else "y"): _numpy(values)}
    fields = getattr(getattr(values, "dtype", None), "names", None)
    return {name: values[name] for name in fields} if fields else None


def inputs_of(values: Any, names: tuple[str, ...]) -> NDArray[np.float64]:
    """Inputs as a matrix in a mapping's order.

    Args:
        values: An array, a frame, a dict of columns, or a trace; for a model without input the number of samples.
        names: The inputs.

    Returns:
        Shape ``(n_samples, n_inputs)``, float64.

    Raises:
        ChannelError: If one is missing.
        ConfigError: If an array has another number of columns.
    """
    if isinstance(values, Trace):
        return values.columns(names)
    if not names and isinstance(values, int):
        return np.zeros((values, 0))
    named = columns_by_name(values)
    if named is not None:
        missing = [name for name in names if name not in named]
        if missing:
            raise ChannelError(missing, list(named), where="the inputs of a simulation")
        return np.column_stack([np.asarray(named[name], dtype=np.float64) for name in names])
    array = np.asarray(_array(values), dtype=np.float64)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[1] != len(names):
        raise ConfigError(
            "the inputs do not match the model",
            expected=f"shape (n_samples, {len(names)}), for {', '.join(names)}",
            got=f"shape {np.shape(values)}",
            remedy="give one column an input, in this order, or columns by name",
        )
    return array


def _of_matrix(
    matrix: NDArray[Any], inputs: tuple[str, ...] | None, outputs: tuple[str, ...] | None, *, where: str
) -> dict[str, NDArray[Any]]:
    width = matrix.shape[1]
    if outputs is None and inputs is None and width > 1:
        raise ConfigError(
            "nothing tells inputs and outputs apart in an array of several columns",
            where=where,
            expected="inputs and outputs by name, in the order of the columns",
            got=f"{width} columns",
            remedy='write for example sysid.data(array, inputs=["u"], outputs=["y"]), or give the pair (u, y)',
        )
    outputs = outputs if outputs is not None else _given(None, matrix[:, len(inputs or ()) :], "y")
    inputs = inputs if inputs is not None else _given(None, matrix[:, : width - len(outputs)], "u")
    if len(inputs) + len(outputs) != width:
        raise ConfigError(
            "the array has another number of columns than there are channels",
            where=where,
            expected=f"{len(inputs)} inputs and {len(outputs)} outputs side by side",
            got=f"{width} columns",
            remedy="name every column, inputs first, or turn the array if its channels stand in rows",
        )
    return dict(zip([*inputs, *outputs], matrix.T, strict=True))


def _given(names: tuple[str, ...] | None, matrix: NDArray[Any], letter: str) -> tuple[str, ...]:
    """The names of columns: those that were given, or a letter with numbers."""
    width = matrix.shape[1]
    if names is None:
        return (letter,) if width == 1 else tuple(f"{letter}{number}" for number in range(1, width + 1))
    if len(names) != width:
        raise ConfigError(
            "names and columns do not match",
            expected=f"{width} names, one for each column",
            got=", ".join(names) or "none",
            remedy="name every column",
        )
    return names


def _two_dimensional(values: Any, *, where: str) -> NDArray[Any]:
    array = _array(values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.dtype.kind not in "buif":
        raise ConfigError(
            "not a record",
            where=where,
            expected="a frame, a dict of columns, a pair (u, y) of arrays, or an array of one or two dimensions",
            got=f"{type(values).__name__} of shape {np.shape(array)} and type {array.dtype}",
            remedy="give numbers; several experiments are a list of records",
        )
    if array.shape[0] < array.shape[1]:
        raise ConfigError(
            "the array has more columns than rows",
            where=where,
            expected="samples in rows, channels in columns",
            got=f"shape {array.shape}",
            remedy="give its transpose (array.T) if channels stand in rows",
        )
    return array


def _check_indexes(pair: tuple[Any, Any], *, where: str) -> None:
    """Two tables of a pair go side by side row by row: their labels must not say otherwise."""
    indexes = [getattr(part, "index", None) for part in pair]
    first, second = indexes
    if first is not None and second is not None and hasattr(first, "equals") and not first.equals(second):
        raise ConfigError(
            "u and y have different indexes",
            where=where,
            expected="the same label in each row: samples of a pair are taken in the order in which they stand",
            got=f"{[str(label) for label in first[:3]]} ... and {[str(label) for label in second[:3]]} ...",
            remedy="put them into one frame, which joins them by their labels, or give u.to_numpy(), y.to_numpy()",
        )


def _check_lengths(table: RawTable, channels: Sequence[str]) -> None:
    """Columns of another length are no channels: said here, not that they are missing."""
    wanted = [one for one in table.others if (not channels or one.name in channels) and len(one.values) > 1]
    if wanted:
        raise ConfigError(
            "the channels of a record differ in length",
            where=str(table.source),
            expected=f"{len(table)} samples in each, as in {', '.join(table.names)}",
            got=", ".join(f"{len(one.values)} in {one.name}" for one in wanted),
            remedy="cut them to the same span of time; experiments of different lengths are a list of records",
        )


def _array(values: Any) -> NDArray[Any]:
    """Any array-like as NumPy: a tensor lets go of its gradients, what a masked array masks is missing."""
    if isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "buif":
        return np.asarray(np.ma.filled(values.astype(np.float64), np.nan))
    return np.asarray(values.detach().cpu() if hasattr(values, "detach") else values)


def _numpy(column: Any) -> NDArray[Any]:
    """A pandas column or index; calendar time of a zone counts from the same origin as any other."""
    if getattr(column.dtype, "tz", None) is not None:
        column = getattr(column, "dt", column).tz_convert(None)
    return _array(column.to_numpy())


def _label(key: object) -> str:
    """A frame's column by name; of several levels, joined by dots."""
    return ".".join(str(part) for part in key) if isinstance(key, tuple) else str(key)


def _index(index: Any) -> dict[str, NDArray[Any]]:
    """A frame's index where it is time: calendar time, spans of time, or numbers that are not just counted."""
    array = _numpy(index)
    if array.dtype.kind in "mM" or array.dtype.kind == "f":
        return {INDEX: array}
    if array.dtype.kind in "iu" and index.name is not None and recognise_time([_nameless(str(index.name))]):
        return {INDEX: array}
    return {}


def _nameless(name: str) -> RawColumn:
    header = parse_header(name)
    return RawColumn(name=header.name, values=np.zeros(1), unit=header.unit)


def _taken_out(
    columns: dict[str, NDArray[Any]], split: Split, channels: Sequence[str], *, where: str
) -> NDArray[Any] | None:
    """The column that says the role of each sample, taken out of the others."""
    if not isinstance(split, str):
        return None
    if split not in columns:
        raise ChannelError([split], list(columns), where=f"{where}, split")
    return columns[split] if split in channels else columns.pop(split)


def _table(columns: Mapping[str, NDArray[Any]], *, name: str) -> RawTable:
    """The columns as a reader would give them."""
    raw = []
    for key, array in columns.items():
        header = parse_header(key)
        # Spans of time in seconds; a number of any other kind is as it stands.
        numbers = array.astype("timedelta64[ns]").astype(np.int64) / 1e9 if array.dtype.kind == "m" else array
        unit = "s" if key == INDEX or array.dtype.kind == "m" else header.unit
        raw.append(array_column(header.name, numbers, where=name, unit=unit, reference=header.reference))
    equal, others = by_length(raw)
    time = INDEX if INDEX in columns else recognise_time(equal)
    # Time is in seconds in every function of ours, unless the column's name says otherwise.
    timed = [replace(one, unit="s") if one.name == time and one.unit is None else one for one in equal]
    return RawTable(
        source=Path(name),
        reader="memory",
        columns=tuple(timed),
        others=others,
        time=time,
        origin=f"given from memory (SHA-256 {_digest(columns)})",
    )


def _digest(columns: Mapping[str, NDArray[Any]]) -> str:
    sha = hashlib.sha256()
    for key, array in columns.items():
        sha.update(key.encode(errors="replace"))
        sha.update(np.ascontiguousarray(array).tobytes() if array.dtype.kind != "O" else repr(array.tolist()).encode())
    return sha.hexdigest()[:16]


def _trace(
    table: RawTable,
    channels: Iterable[str],
    *,
    label: str,
    sample_time: float | None,
    units: Mapping[str, str] | Sequence[str] | str | None,
    repairs: RepairOptions,
    grid: GridOptions,
) -> Trace:
    names = list(channels)
    columns = {name: table.find(name) for name in names}
    chosen = _units(names, units)
    wanted, given = [], {}
    for name, column in columns.items():
        unit = check_unit(chosen.get(name) or column.unit or "1")
        short = parse_header(name).name
        wanted.append(Channel(name=short, unit=unit, reference=column.reference or Reference.NONE))
        given[short] = ColumnOptions(column=column.name, unit=column.unit or unit)
    time = TimeOptions(step=sample_time) if table.time is None and sample_time is not None else TimeOptions()
    files = FileOptions(columns=given, time=time)
    if table.time is None and sample_time is None:
        raise ConfigError(
            "nothing tells the sample time",
            where=label,
            expected="sample_time in seconds, a column named t or time, or an index that is time",
            got="neither",
            remedy="write for example sample_time=0.1",
        )
    if sample_time is None:
        step = survey(stamps_in_seconds(table, files), longest_step=grid.longest_step).step
        sample_time = float(f"{step:.9g}")  # stamps such as 0.30000000000000004 are decimal numbers, rounded
    asked = Wanted(name=label, channels=tuple(wanted), sample_time=float(sample_time))
    return assemble(table, asked, files=files, grid=grid, repairs=repairs)


def _units(names: Sequence[str], units: Mapping[str, str] | Sequence[str] | str | None) -> dict[str, str]:
    if units is None:
        return {}
    if isinstance(units, str):
        return dict.fromkeys(names, units)
    if isinstance(units, Mapping):
        strangers = [name for name in units if name not in names]
        if strangers:
            raise ChannelError(strangers, names, where="units")
        return dict(units)
    if len(units) != len(names):
        raise ConfigError(
            "units and channels do not match",
            expected=f"{len(names)} units, for {', '.join(names)}",
            got=", ".join(units),
            remedy="give a unit for each channel, or a dict by channel",
        )
    return dict(zip(names, units, strict=True))
