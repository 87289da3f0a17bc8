"""Inputs of a bundle from a file of samples, with those that are numbers beside them."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sysid.content import nearest_name
from sysid.errors import ChannelError, ConfigError
from sysid.export.bundle import Bundle, channel_of
from sysid.ingest import FileOptions, GridOptions, RawTable, RepairOptions, read_table
from sysid.ingest.assembling.assemble import Wanted, assemble
from sysid.ingest.assembling.masks import check_masks
from sysid.ingest.inspecting.undescribed import guessed_time
from sysid.traces import Channel, Trace


@dataclass(frozen=True, kw_only=True)
class InputOptions:
    """How a file of samples is taken as inputs.

    A channel that never changes is an input like any other, and a record may be as short as it is.

    Args:
        constants: Inputs that are a number and no column, by name, in the bundle's unit.
        files: How the file is read.
        grid: How its samples come onto the grid.
        repairs: Which repairs may be made.
    """

    constants: Dict[str, float] = field(default_factory=dict)
    files: FileOptions = field(default_factory=FileOptions)
    grid: GridOptions = field(default_factory=lambda: GridOptions(fewest_samples=2))
    repairs: RepairOptions = field(default_factory=RepairOptions)


def read_inputs(bundle: Bundle, path: Path, options: InputOptions | None = None) -> Trace:
    """Read a file of samples as inputs of a bundle; units are converted to the bundle's.

    Args:
        bundle: The bundle.
        path: The file.
        options: How; a constant column is an input by default.

    Returns:
        The inputs, and behind them the measured outputs where they are in the file. Samples at which one
        of these is missing are masked.

    Raises:
        ChannelError: If an input is missing.
        ConfigError: If a constant is none.
        TraceError: If something is wrong with the samples and its repair was not asked for.

    Warns:
        GuessedWarning: If the file does not say what its time is, which was guessed.
    """
    options = options or InputOptions()
    options = replace(options, constants=ticking(bundle, options.constants))
    channels = tuple(channel_of(entry) for entry in bundle.inputs)
    check_constants(options.constants, channels)
    table = read_table(path, files=options.files, repairs=options.repairs)
    wanted = [channel for channel in channels if channel.name not in options.constants]
    there = [name for name in options.constants if options.files.columns.get(name) or name in table.names]
    if there:
        raise ConfigError(
            f"{there[0]} is given twice", where=str(path), expected="a column, or a number", got="both",
            remedy=f"leave --constant {there[0]}=... out, or the column",
        )  # fmt: skip
    _check_there(table, wanted, options, path)
    outputs = _measured(bundle, table, options)
    if not wanted and not outputs:
        raise ConfigError(
            "every input is a number, and nothing says for how long", where=str(path),
            expected="a file with an input or the measured output", got=", ".join(table.names),
            remedy="give --command with two rows in place of the file: the first at 0, the second at the end",
        )  # fmt: skip
    repairs = options.repairs
    files = guessed_time(table, options.files, sample_time=bundle.model.sample_time)
    if outputs:
        nan = {c.name: repairs.nan for c in wanted} if isinstance(repairs.nan, str) else dict(repairs.nan or {})
        repairs = repairs.model_copy(update={"nan": {**dict.fromkeys((c.name for c in outputs), "mask"), **nan}})
    # What is said of an output holds for a file that does not have it.
    files = files.without({str(entry["name"]) for entry in bundle.outputs} - {channel.name for channel in outputs})
    trace = assemble(
        table,
        Wanted(
            name=path.stem,
            channels=(*wanted, *outputs),
            sample_time=bundle.model.sample_time,
            fixed=True,
        ),
        files=files,
        grid=options.grid,
        repairs=repairs.model_copy(update={"constant": "accept"}),
    )
    check_masks(repairs, [trace], cases=[trace.name], where=str(path))
    return with_constants(trace, channels, options.constants)


def with_constants(trace: Trace, channels: tuple[Channel, ...], constants: Dict[str, float]) -> Trace:
    """A trace with inputs that are numbers put among the others.

    Args:
        trace: The other inputs.
        channels: All of them, in order.
        constants: The numbers, by name.

    Returns:
        The trace; the same where there are none.
    """
    if not constants:
        return trace
    columns = [
        np.full(len(trace), float(constants[c.name])) if c.name in constants else trace[c.name] for c in channels
    ]
    rest = [c for c in trace.channels if c.name not in {channel.name for channel in channels}]
    columns += [trace[channel.name] for channel in rest]
    told = tuple(f"{name} held at {value:g}" for name, value in constants.items())
    return replace(
        trace,
        channels=(*channels, *rest),
        values=np.column_stack(columns),
        provenance=(*trace.provenance, *told),
    )


def ticking(bundle: Bundle, constants: Dict[str, float]) -> dict[str, float]:
    """Inputs that are numbers, with that of a model without inputs among them: nobody reads it."""
    names = () if bundle.model.inputs else (str(entry["name"]) for entry in bundle.inputs)
    return {**dict.fromkeys(names, 0.0), **constants}


def check_constants(constants: Dict[str, float], channels: tuple[Channel, ...]) -> None:
    """Refuse constants that are none.

    Args:
        constants: By name.
        channels: The inputs there are.

    Raises:
        ChannelError: If one is no input.
        ConfigError: If one is no finite number.
    """
    names = [channel.name for channel in channels]
    strangers = [name for name in constants if name not in names]
    if strangers:
        raise ChannelError(strangers, names, where="the inputs of the bundle")
    for name, value in constants.items():
        if not np.isfinite(value):
            raise ConfigError(
                "an input cannot be held there", where=name, expected="a finite number, in the input's unit",
                got=value, remedy=f"give a finite number: --constant {name}=0",
            )  # fmt: skip


def _check_there(table: RawTable, wanted: list[Channel], options: InputOptions, path: Path) -> None:
    """Every input that is no number needs a column; what helps is said in the words of those who ask for it."""
    columns = {c.name: options.files.columns[c.name].column for c in wanted if c.name in options.files.columns}
    missing = [c.name for c in wanted if columns.get(c.name, c.name) not in table.names]
    if not missing:
        return
    error = ChannelError(missing, table.names, where=str(path))
    name = missing[0]
    spare = [one for one in table.names if one != table.time and one not in {c.name for c in wanted}]
    near = nearest_name(name, [spare]) or next(iter(spare), None)
    ways = [f"--columns {name}={near} if it stands in a column of another name"] if near else []
    raise ConfigError(
        error.what,
        where=error.where,
        expected=error.expected,
        got=error.got,
        remedy=", or ".join([*ways, f"--constant {name}=NUMBER if it is held"]),
    )


def _measured(bundle: Bundle, table: RawTable, options: InputOptions) -> tuple[Channel, ...]:
    """The outputs of which the file has values."""
    found = []
    for output in map(channel_of, bundle.outputs):
        given = options.files.columns.get(output.name)
        name = given.column if given else output.name
        if name in table.names and np.isfinite(table.find(name).values).any():
            found.append(output)
    return tuple(found)
