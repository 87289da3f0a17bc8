"""Data that is in memory already: frames, arrays, dicts and lists of them become a TraceSet as files do."""

from __future__ import annotations

import datetime
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ChannelError, ConfigError, shortened
from sysid.field_checks import check
from sysid.ingest.assembling.assemble import Wanted, assemble
from sysid.ingest.assembling.in_units import stamps_in_seconds
from sysid.ingest.assembling.masks import check_masks
from sysid.ingest.assembling.timing import survey
from sysid.ingest.cells.headers import parse_header
from sysid.ingest.memory.experiments import columns_of, experiments_of
from sysid.ingest.memory.in_python import remedies_in_python
from sysid.ingest.memory.memory_table import check_lengths, table_of
from sysid.ingest.split import Split, split_traces
from sysid.ingest.tables.durations import length_of_time
from sysid.ingest.tables.frames import check_distinct, check_rows
from sysid.ingest.tables.no_record import over_frequency
from sysid.ingest.tables.options import ColumnOptions, FileOptions, GridOptions, RepairOptions, TimeOptions
from sysid.ingest.tables.over_frequency import frequencies_in
from sysid.ingest.tables.table import RawTable
from sysid.traces import Channel, Trace, TraceSet
from sysid.units import Reference, check_unit

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
    repairs: Mapping[str, Any] | None = None,
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
            chosen by, only scored), spans of seconds or durations by role (``{"estimation": (0, 60), "validation":
            (60, None)}``), the name of a column that holds the role of each sample, or a role for each experiment, in
            their order or by name. All is for estimation where nothing is said.
        repairs: As in a data set's ``source.repairs``: ``{"nan": "mask"}``, ``{"gaps": "linear"}``, ``{"mask":
            [{"channel": "y", "start": 12.5, "stop": 14.0}]}`` ...; the cases of a mask are names of experiments.
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
    if isinstance(values, TraceSet | Trace) or (isinstance(values, list) and any(isinstance(v, Trace) for v in values)):
        raise ConfigError(
            "a record already is what a fit takes",
            expected="frames, arrays, dicts of columns",
            got=shortened(values),
            remedy="give it to sysid.fit as it is; a part of it is trace[100:300], and roles are "
            "sysid.traces.TraceSet(name=..., traces=..., roles=...)",
        )
    wanted_inputs, wanted_outputs = _names(inputs), _names(outputs)
    check_distinct([*(wanted_inputs or ()), *(wanted_outputs or ())], where="inputs and outputs")
    repaired = check(RepairOptions, {"constant": "accept", **_options(repairs, "repairs")}, where="repairs")
    gridded = check(GridOptions, {"fewest_samples": 2, **_options(grid, "grid")}, where="grid")
    given = length_of_time(sample_time, where="sample_time")
    step = None if given is None else check(TimeOptions, {"step": given}, where="sample_time").step
    experiments = experiments_of(values, wanted_inputs if wanted_outputs is None else wanted_outputs)
    whole: list[Trace] = []
    marks: list[NDArray[Any] | None] = []
    for number, (label, one) in enumerate(experiments.items()):
        columns = columns_of(one, wanted_inputs, wanted_outputs, where=label)
        channels = [*(wanted_inputs or ()), *(wanted_outputs or ())]
        # Who names one half of a pair means to have the other, too.
        half = isinstance(one, tuple) and (wanted_inputs is None) != (wanted_outputs is None)
        marks.append(_taken_out(columns, split, channels, where=label))
        table = table_of(columns, name=label, channels=channels, timed=step is None)
        check_lengths(table, channels)
        if table.time is None:
            check_rows(one[0] if isinstance(one, tuple) else one, where=label)
        trace = _trace(
            table,
            (not half and channels) or [column for column in table.names if column != table.time],
            label=label,
            sample_time=step if number == 0 or step is not None else whole[0].sample_time,
            units=units,
            repairs=repaired,
            grid=gridded,
        )
        whole.append(trace)
    if whole:
        check_masks(repaired, whole, cases=[trace.name for trace in whole], where=name)
    return split_traces(tuple(whole), split, marks, name=name)


def _names(given: Names) -> tuple[str, ...] | None:
    """As columns are called: the number of a column without a name is its name, levels stand with dots between."""
    if given is None:
        return None
    several: Iterable[Any] = given if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    return tuple(".".join(map(str, one)) if isinstance(one, tuple) else str(one) for one in several)


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
        if (swept := frequencies_in(table.columns)) is not None:
            raise ConfigError(
                "a frequency response is no record over time",
                where=label,
                expected="a row for each sample",
                got=over_frequency(swept),
                remedy="fit it as it is: sysid.fit_response(sysid.response_data(table), structure). Where the rows are "
                "samples over time, say how far apart: sample_time=0.1",
            )
        raise ConfigError(
            "nothing tells the sample time",
            where=label,
            expected="sample_time in seconds, a column named t or time, or an index that is time",
            got="neither",
            remedy=_clock_like(table, names) or "write for example sample_time=0.1",
        )
    if sample_time is None:
        step = survey(stamps_in_seconds(table, files), longest_step=grid.longest_step).step
        sample_time = float(f"{step:.9g}")  # stamps such as 0.30000000000000004 are decimal numbers, rounded
    asked = Wanted(name=label, channels=tuple(wanted), sample_time=float(sample_time))
    return assemble(table, asked, files=files, grid=grid, repairs=repairs)


def _clock_like(table: RawTable, names: Sequence[str]) -> str:
    """What to do where a column that is no channel rises evenly; empty where none does."""
    for column in table.columns:
        steps = np.diff(column.values) if column.name not in names and column.problem is None else np.empty(0)
        if len(steps) and float(steps.min()) > 0.0 and float(np.ptp(steps)) < 0.01 * float(np.median(steps)):
            step = f"{float(np.median(steps)):.6g}"
            return f"{column.name} rises evenly: where it is time in seconds, write sample_time={step}"
    return ""


def _units(names: Sequence[str], units: Mapping[str, str] | Sequence[str] | str | None) -> dict[str, str]:
    if units is None:
        return {}
    if not isinstance(units, Mapping | list | tuple | np.ndarray):  # one for all: text, or a unit of pint's
        return dict.fromkeys(names, str(units))
    if isinstance(units, Mapping):
        strangers = [name for name in units if name not in names]
        if strangers:
            raise ChannelError(strangers, names, where="units")
        return {name: str(unit) for name, unit in units.items() if unit is not None}
    if len(units) != len(names):
        raise ConfigError(
            "units and channels do not match",
            expected=f"{len(names)} units, for {', '.join(names)}",
            got=", ".join(map(str, units)),
            remedy="give a unit for each channel, or a dict by channel",
        )
    return {name: str(unit) for name, unit in zip(names, units, strict=True) if unit is not None}
