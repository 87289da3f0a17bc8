"""Data that is in memory already: frames, arrays, dicts and lists of them become a TraceSet as files do."""

from __future__ import annotations

import datetime
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, TraceError
from sysid.field_checks import check
from sysid.ingest.assemble import Wanted, assemble
from sysid.ingest.frames import (
    INDEX,
    as_array,
    check_distinct,
    check_labels,
    check_rows,
    columns_by_name,
    index_of,
    not_numbers,
)
from sysid.ingest.headers import parse_header, unit_in_name
from sysid.ingest.in_python import remedies_in_python
from sysid.ingest.in_units import stamps_in_seconds
from sysid.ingest.meaning import with_clock
from sysid.ingest.options import ColumnOptions, FileOptions, GridOptions, RepairOptions, TimeOptions
from sysid.ingest.split import Split, split_traces
from sysid.ingest.table import RawColumn, RawTable, array_column, by_length, is_time_unit, recognise_time
from sysid.ingest.timing import survey
from sysid.traces import Channel, Trace, TraceSet, check_units
from sysid.units import Reference, check_unit, convert, is_same_unit

Names = str | Sequence[str] | None


@remedies_in_python()
def data(
    values: Any,
    *,
    inputs: Names = None,
    outputs: Names = None,
    sample_time: float | datetime.timedelta | None = None,
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
        sample_time: Seconds between samples, or a duration. Not needed where a column or an index holds time; where it
            is given beside one, the record must have it, or ``grid`` says how it is resampled.
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
    check_distinct([*(wanted_inputs or ()), *(wanted_outputs or ())], where="inputs and outputs")
    repaired = check(RepairOptions, {"constant": "accept", **_options(repairs, "repairs")}, where="repairs")
    gridded = check(GridOptions, {"fewest_samples": 2, **_options(grid, "grid")}, where="grid")
    given = _seconds(sample_time)
    step = None if given is None else check(TimeOptions, {"step": given}, where="sample_time").step
    experiments = _experiments(values, wanted_inputs if wanted_outputs is None else wanted_outputs)
    whole: list[Trace] = []
    marks: list[NDArray[Any] | None] = []
    for number, (label, one) in enumerate(experiments.items()):
        columns = _columns(one, wanted_inputs, wanted_outputs, where=label)
        channels = [*(wanted_inputs or ()), *(wanted_outputs or ())]
        marks.append(_taken_out(columns, split, channels, where=label))
        table = _table(columns, name=label)
        _check_lengths(table, channels)
        if table.time is None:
            check_rows(one[0] if isinstance(one, tuple) else one, where=label)
        trace = _trace(
            table,
            channels or [column for column in table.names if column != table.time],
            label=label,
            sample_time=step if number == 0 or step is not None else whole[0].sample_time,
            units=units,
            repairs=repaired,
            grid=gridded,
        )
        whole.append(trace)
    return split_traces(tuple(whole), split, marks, name=name)


def _names(given: Names) -> tuple[str, ...] | None:
    """As columns are called: the number of a column without a name is its name, levels stand with dots between."""
    if given is None:
        return None
    several: Iterable[Any] = given if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    return tuple(".".join(map(str, one)) if isinstance(one, tuple) else str(one) for one in several)


def _experiments(values: Any, channels: Names) -> dict[str, Any]:
    """Experiments by name; a single one is called ``record``.

    Arrays of a single column are columns, whether they lie flat or stand, as those of ``scipy.io.loadmat`` do.
    """
    standing = isinstance(values, Mapping) and any(
        not isinstance(one, tuple) and np.shape(one)[1:] == (1,) and not _is_frame(one) for one in values.values()
    )
    if isinstance(values, Mapping) and values and not standing and all(_is_record(one) for one in values.values()):
        return {str(label): one for label, one in values.items()}
    if isinstance(values, list) and values and not np.isscalar(values[0]):
        if channels is None and len(values) == 2 and all(_is_column(one) for one in values):
            raise ConfigError(
                "a list is of several experiments",
                expected="the pair (u, y), which is one experiment with an input",
                got="a list of two columns, which is two experiments without one",
                remedy='write sysid.data((u, y), ...); two records without input: outputs="y" beside the list',
            )
        _check_no_rows(values)
        return {f"record-{number}": one for number, one in enumerate(values, start=1)}
    return {"record": values}


def _check_no_rows(values: list[Any]) -> None:
    """Refuse a list of rows, which would be as many experiments of a few samples each."""
    few = len(values[0]) if isinstance(values[0], list | tuple) else 0
    rows = 0 < few < len(values) and all(
        isinstance(one, list | tuple) and len(one) == few and all(map(np.isscalar, one)) for one in values
    )
    if rows:
        raise ConfigError(
            "a list is of several experiments",
            expected="records: pairs (u, y), frames, dicts of columns",
            got=f"{len(values)} rows of {few} numbers",
            remedy="one record of rows is an array: np.array(rows)",
        )


def _is_column(value: Any) -> bool:
    """Whether a value is one bare column of numbers: neither a table nor a series, which has a name."""
    if isinstance(value, list):
        return bool(value) and bool(np.isscalar(value[0]))
    return (
        not hasattr(value, "to_frame")
        and getattr(value, "ndim", 0) == 1
        and getattr(value.dtype, "names", None) is None
    )


def _is_record(value: Any) -> bool:
    """Whether a value of a dict is a record of its own and not a column."""
    if isinstance(value, tuple):
        return not all(np.isscalar(entry) for entry in value)
    return isinstance(value, Mapping) or _is_frame(value) or getattr(value, "ndim", 1) == 2


def _is_frame(value: Any) -> bool:
    return any(hasattr(value, attribute) for attribute in ("get_columns", "data_vars")) or (
        hasattr(value, "columns") and hasattr(value, "index")
    )


def _columns(
    one: Any, inputs: tuple[str, ...] | None, outputs: tuple[str, ...] | None, *, where: str
) -> dict[str, NDArray[Any]]:
    """The columns of one record by name; those of an array are the inputs and then the outputs."""
    named = columns_by_name(one, where=where)
    if named is not None:
        return named
    if isinstance(one, tuple) and len(one) != 2 and not all(np.isscalar(part) for part in one):
        raise ConfigError(
            "a tuple is a pair",
            where=where,
            expected="(u, y)",
            got=f"{len(one)} parts",
            remedy='name the columns: {"t": t, "u": u, "y": y}; several experiments are a list of pairs',
        )
    if isinstance(one, tuple) and len(one) == 2:
        check_labels(one, ("u", "y"), where=where)
        u, y = (_two_dimensional(part, where=where) for part in one)
        return index_of(one) | dict(zip([*_given(inputs, u, "u"), *_given(outputs, y, "y")], [*u.T, *y.T], strict=True))
    return _of_matrix(_two_dimensional(one, where=where), inputs, outputs, where=where)


def inputs_of(
    values: Any,
    names: tuple[str, ...],
    *,
    sample_time: float | None = None,
    units: Mapping[str, str] | None = None,
) -> NDArray[np.float64]:
    """Inputs as a matrix in a mapping's order.

    Args:
        values: An array, a frame, a dict of columns, or a trace; for a model without input the number of samples.
        names: The inputs.
        sample_time: Of the model, in seconds: a trace, and a frame whose index or column is time, must have it.
        units: Of the model's channels: a trace, whose channels have units, must be in them; columns whose names say
            others (``"u [mV]"``) are converted.

    Returns:
        Shape ``(n_samples, n_inputs)``, float64.

    Raises:
        ChannelError: If one is missing.
        ConfigError: If an array has another number of columns, the samples are at another distance, or a trace is in
            other units.
        TraceError: If a value is missing or not finite.
    """
    where = "the inputs of a simulation"
    if not names and isinstance(values, int):
        return np.zeros((values, 0))
    if isinstance(values, TraceSet):
        raise ConfigError(
            "a run is over one record",
            where=where,
            expected="a trace, an array or a frame",
            got=f"a data set of {len(values.traces)}: {', '.join(values.names)}",
            remedy=f'write traces["{values.names[0]}"]',
        )
    if isinstance(values, Trace):
        _check_step(values.sample_time, sample_time, where=where)
        found = values.columns(names)
        check_units({name: unit for name, unit in (units or {}).items() if name in names}, values)
        return found
    named = columns_by_name(values, where=where)
    if named is None:
        array = as_array(values)
        array = array[:, None] if array.ndim == 1 else array
        if array.ndim != 2 or array.shape[1] != len(names) or array.dtype.kind not in "buif":
            raise ConfigError(
                "the inputs do not match the model",
                where=where,
                expected=f"numbers of shape (n_samples, {len(names)}), for {', '.join(names)}",
                got=f"shape {np.shape(array)} of type {array.dtype}",
                remedy="give one column an input, in this order, or columns by name",
            )
        found = array.astype(np.float64)
    else:
        if len(names) == 1 and hasattr(values, "to_frame"):  # a series is one column, whatever it is called
            named = {names[0] if key != INDEX else key: column for key, column in named.items()}
        table = _table(named, name=where)
        _check_lengths(table, names)
        if table.time is not None and table.time not in names and sample_time is not None and len(table) > 1:
            stamps = stamps_in_seconds(table, FileOptions())
            _check_step(float(np.median(np.diff(stamps))), sample_time, where=where)
        columns = [_in_unit(table.find(name), (units or {}).get(name, "1")) for name in names]
        found = np.column_stack(columns) if names else np.zeros((len(table), 0))
    if not len(found):
        raise _no_samples(where)
    bad = ~np.isfinite(found)
    if bad.any():
        row, column = (int(index) for index in np.argwhere(bad)[0])
        raise TraceError(
            "a value is missing" if bad.sum() == 1 else f"{int(bad.sum())} values are missing",
            where=f"{where}, channel {names[column]}, sample {row}",
            expected="a finite number in each sample: a free run has nothing else to go by",
            got=f"{found[row, column]}",
            remedy="fill them before, for example frame.interpolate() or frame.ffill()",
        )
    return found


def _in_unit(column: RawColumn, unit: str) -> NDArray[np.float64]:
    """A column in a model's unit, where its name says another one; as it stands where one of them is none."""
    if column.unit is None or is_same_unit(column.unit, unit):
        return column.values
    return convert(column.values, column.unit, unit, reference=column.reference or Reference.NONE)


def level_of(initial: Any) -> float:
    """A level that an output has stood at before a run.

    Args:
        initial: What was given.

    Returns:
        The number.

    Raises:
        ConfigError: If it is not one finite number.
    """
    if np.ndim(initial) == 0 and isinstance(initial, int | float | np.number) and np.isfinite(initial):
        return float(initial)
    raise ConfigError(
        "the output before the first sample is one finite number",
        where="initial",
        expected="a number, in the output's unit",
        got=repr(initial)[:60],
        remedy="samples before the first are a pair: initial=(u_before, y_before); several outputs are a dict by name",
    )


def _seconds(value: Any) -> Any:
    """A duration in seconds; of anything else itself."""
    if isinstance(value, np.timedelta64):
        return float(value / np.timedelta64(1, "s"))
    return value.total_seconds() if isinstance(value, datetime.timedelta) else value


def _check_step(step: float, sample_time: float | None, *, where: str) -> None:
    if sample_time is not None and abs(step - sample_time) > 1e-3 * sample_time:
        raise ConfigError(
            "the samples are at another distance than the model's",
            where=where,
            expected=f"{sample_time:g} s",
            got=f"{step:g} s",
            remedy="resample them: sysid.data(frame, sample_time=..., grid={'method': 'linear'}) gives a trace",
        )


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
    array = as_array(values)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or array.dtype.kind not in "buif":
        raise ConfigError(
            "not a record",
            where=where,
            expected="a frame, a dict of columns, a pair (u, y) of arrays, or an array of one or two dimensions",
            got=f"{type(values).__name__} of shape {np.shape(array)} and type {array.dtype}",
            remedy="give numbers; several experiments are a list of records",
        )
    if not len(array):
        raise _no_samples(where)
    if array.shape[0] < array.shape[1]:
        raise ConfigError(
            "the array has more columns than rows",
            where=where,
            expected="samples in rows, channels in columns",
            got=f"shape {array.shape}",
            remedy="give its transpose (array.T) if channels stand in rows",
        )
    return array


def _no_samples(where: str) -> ConfigError:
    return ConfigError(
        "the record holds no samples",
        where=where,
        expected="at least one column of numbers",
        got="no rows",
        remedy="look at what was selected before: a filter that nothing passes leaves no rows",
    )


def _check_lengths(table: RawTable, channels: Sequence[str]) -> None:
    """Columns of another length are no channels: said here, not that they are missing."""
    wanted = [one for one in table.others if not channels or one.name in channels]
    if wanted:
        raise ConfigError(
            "the channels of a record differ in length",
            where=str(table.source),
            expected=f"{len(table)} samples in each, as in {', '.join(table.names)}",
            got=", ".join(f"{len(one.values)} in {one.name}" for one in wanted),
            remedy="cut them to the same span of time, or name the inputs and outputs that are meant; a constant is "
            "np.full(n, value); experiments of different lengths are a list of records",
        )


def _options(given: Mapping[str, Any] | None, what: str) -> dict[str, Any]:
    if given is not None and not isinstance(given, Mapping):
        raise ConfigError(
            f"{what} are names with values",
            where=what,
            expected="a dict",
            got=repr(given),
            remedy='write for example repairs={"nan": "mask"} or grid={"method": "linear"}',
        )
    return dict(given or {})


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
        if array.ndim > 1:
            raise ConfigError(
                "a column of several columns",
                where=f"{name}, column {key}",
                expected="shape (n_samples,) for each name",
                got=f"shape {array.shape}",
                remedy=f'name each: {{"{key}1": {key}[:, 0], "{key}2": {key}[:, 1]}}, or give the pair (u, y)',
            )
        # Spans of time in seconds; a number of any other kind is as it stands.
        numbers = array.astype("timedelta64[ns]").astype(np.int64) / 1e9 if array.dtype.kind == "m" else array
        unit = "s" if array.dtype.kind == "m" else header.unit
        column = array_column(header.name, np.atleast_1d(numbers), where=name, unit=unit, reference=header.reference)
        # Who has a frame knows the types of its columns: text in it is no number by accident, as it is in a file.
        problem = not_numbers(key, np.atleast_1d(array), where=name) or column.problem
        raw.append(replace(column, problem=problem))
    if not any(len(column.values) for column in raw):
        raise _no_samples(name)
    check_distinct([column.name for column in raw], where=name)
    equal, others = by_length(raw)
    table = RawTable(
        source=Path(name),
        reader="memory",
        columns=equal,
        others=others,
        time=INDEX if INDEX in columns else recognise_time(equal),
        origin=f"given from memory (SHA-256 {_digest(columns)})",
    )
    # Time is in seconds in every function of ours, unless its name or the size of its numbers says otherwise.
    table = with_clock(table)
    timed = [replace(c, unit=_clock_unit(c.name)) if c.name == table.time and not c.unit else c for c in table.columns]
    return replace(table, columns=tuple(timed))


def _clock_unit(name: str) -> str:
    unit = unit_in_name(name)
    return unit if unit is not None and is_time_unit(unit) else "s"


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
