"""``sysid forecast``: what a bundle expects after measured samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sysid.errors import ChannelError, TraceError
from sysid.export.bundle import channel_of
from sysid.export.forecast import check_follows
from sysid.export.inputs import InputOptions, read_inputs
from sysid.export.reading import read_bundle
from sysid.ingest import read_table, write_trace
from sysid.traces import Trace
from sysid.workbench.commands.reader_options import as_typed, reading_options
from sysid.workbench.commands.simulate import parse_constants
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import meant


@dataclass(frozen=True, kw_only=True)
class ForecastWish:
    """What was typed.

    Args:
        bundle: The bundle's folder or zip, or the folder of the run that exported it.
        past: A file of the samples before, with inputs and measured outputs.
        inputs: A file of the inputs to come.
        out: The file to write; ``NAME.forecast.csv`` beside the inputs by default.
        constants: ``NAME=NUMBER`` of inputs that are held.
        reading: The options of the readers, and ``repairs`` and ``grid``, as plain data; of both files.
    """

    bundle: Path
    past: Path
    inputs: Path
    out: Path | None = None
    constants: Sequence[str] = ()
    reading: Mapping[str, Any] = field(default_factory=dict)


def forecast_command(wish: ForecastWish) -> None:
    """Write time, inputs and the outputs that are to be expected.

    Args:
        wish: What was typed.

    Raises:
        BundleError: If the bundle is damaged or incomplete.
        UserError: If a file cannot be read or written, lacks a channel, or does not follow the other by its stamps.
    """
    read, constants = read_bundle(meant(wish.bundle)), parse_constants(wish.constants)
    with as_typed():
        options = InputOptions(constants=constants, **reading_options(wish.reading))
        past, to_come = (read_inputs(read, source, options) for source in (wish.past, wish.inputs))
    outputs = tuple(map(channel_of, read.outputs))
    missing = [channel.name for channel in outputs if channel.name not in past.channel_names]
    if missing:
        raise ChannelError(missing, past.channel_names, where=f"{wish.past}, the samples before")
    check_follows(past, to_come, apart=_apart(wish, options))
    before, names = _known(past, [channel.name for channel in outputs]), [str(entry["name"]) for entry in read.inputs]
    future = to_come.columns(names) if read.model.inputs else len(to_come)
    found = np.reshape(read.forecast(future, initial=before), (len(to_come), -1))
    inputs = tuple(to_come.channel(name) for name in names)
    out = wish.out or wish.inputs.with_name(f"{wish.inputs.stem}.forecast.csv")
    values = np.column_stack([to_come.columns(names), found])
    write_trace(replace(to_come, name=out.stem, channels=(*inputs, *outputs), values=values, usable=None), out)
    shown = ", ".join(channel.name for channel in outputs)
    told = f"{len(to_come)} samples of {shown} written to {out}, expected after {len(before)} measured samples"
    console().print(told, soft_wrap=True, markup=False)


def _apart(wish: ForecastWish, options: InputOptions) -> float | None:
    """Seconds between the first dates of both files; ``None`` where one of them has none."""
    began = []
    for source in (wish.past, wish.inputs):
        table = read_table(source, files=options.files, repairs=options.repairs)
        name = options.files.time.column or table.time
        began += [column.began for column in table.columns if column.name == name and column.began is not None]
    return (began[1].micros - began[0].micros) / 1e6 if len(began) == 2 else None


def _known(past: Trace, outputs: list[str]) -> Trace:
    """The samples after the last at which an output is missing."""
    missing = np.flatnonzero(~past.usable_of(tuple(outputs)))
    first = int(missing[-1]) + 1 if len(missing) else 0
    if first == len(past):
        raise TraceError(
            "the last sample before the forecast is missing", where=past.name,
            expected="measured outputs until its end", got="an empty cell, or a masked one",
            remedy="cut the file behind the last measured sample, and put what follows among the inputs to come",
        )  # fmt: skip
    return past if not first else past[first:]
