"""``sysid simulate RUN --command FILE --positions 1:50``: positions along a line, from the inputs of the whole."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.export.bundle import said_outside
from sysid.export.command_table import read_command
from sysid.ingest import write_trace
from sysid.traces import Channel, Trace
from sysid.workbench.assembly.interpolation import StoredInterpolation
from sysid.workbench.assembly.runner import read_interpolation
from sysid.workbench.commands.simulate import Wish, check_picture
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import meant

DRAWN = 5
"""Positions in the picture at most: more lines of one field are not told apart."""

MOST = 10_000
"""Positions in one call: more are not meant."""


def simulate_line_command(wish: Wish, asked: str) -> None:
    """Simulate a line and write time, inputs and every output at every position, as ``BC17`` for position 17.

    Args:
        wish: What was typed; its bundle is the run folder of an assembly with a line.
        asked: ``1:50``, ``1:50:5`` or ``1,10,25.5``.

    Raises:
        ConfigError: If more than a command was given: a line has no inputs at every sample, and begins at rest.
        UserError: If the line or the command cannot be read, or the output not written.
    """
    given = {
        "no command": wish.command is None,
        f"inputs {wish.inputs}": wish.inputs is not None,
        f"--initial {wish.initial}": wish.initial is not None,
        f"--start {wish.start}": wish.start not in {None, "rest"},
        f"--constant {' '.join(wish.constants)}": bool(wish.constants),
        ", ".join(wish.reading): bool(wish.reading),
    }
    if wish.command is None or sum(given.values()):
        raise ConfigError(
            "that is not how a line is simulated",
            where="sysid simulate --positions",
            expected="--command with a table of a few rows, and nothing else that says what goes in or how it begins",
            got=", ".join(what for what, yes in given.items() if yes),
            remedy="give --command FILE alone",
        )
    check_picture(wish.plot)
    out, stored, positions = wish.written, read_interpolation(meant(wish.bundle)), parse_positions(asked)
    table = read_command(wish.command, stored.inputs, time_unit=wish.time_unit, unit=wish.unit)
    trace = _simulate_line(stored, table.trace(stored.line.sample_time), positions)
    write_trace(replace(trace, name=out.stem), out)
    names = ", ".join(channel.name for channel in stored.outputs)
    units, values = {one.name: one.unit for one in stored.inputs}, trace.columns([one.name for one in stored.inputs])
    told = said_outside(values, units, stored.ranges)
    console().print(f"{len(trace)} samples of {names} at {len(positions)} positions written to {out}", soft_wrap=True)
    if told:
        console().print(told, soft_wrap=True)
    _draw(stored, trace, positions, wish.plot or out.with_suffix(".png"), title=wish.bundle.name)


def _simulate_line(stored: StoredInterpolation, given: Trace, positions: list[float]) -> Trace:
    """The inputs, then each output at each position of a line, as ``BC17`` for position 17."""
    run = stored.line.simulate_trace(given, positions)
    inputs = [channel.name for channel in stored.inputs]
    channels, columns = list(stored.inputs), [given.columns(inputs)]
    for channel in stored.outputs:
        channels += [replace(channel, name=_at(channel, position)) for position in positions]
        columns.append(run[channel.name].T)
    return Trace(
        name=given.name,
        sample_time=given.sample_time,
        channels=tuple(channels),
        values=np.column_stack(columns),
        provenance=(*given.provenance, f"simulated in free run at {len(positions)} positions of a line"),
    )


def _at(channel: Channel, position: float) -> str:
    return f"{channel.name}{position:g}"


def parse_positions(text: str) -> list[float]:
    """Positions as they are written.

    Args:
        text: ``1:50`` for every whole number from 1 to 50, ``1:50:5`` for every fifth, ``1,10,25.5`` for these.

    Returns:
        The positions, in the order in which they are named.

    Raises:
        ConfigError: If they cannot be read, are named twice, or are more than anybody means.

    Example:
        >>> parse_positions("1:9:4,12.5")
        [1.0, 5.0, 9.0, 12.5]
    """
    found: list[float] = []
    number = r"\d+(?:\.\d+)?"
    for part in text.replace(" ", "").split(","):
        numbers = [float(one) for one in part.split(":")] if re.fullmatch(rf"{number}(:{number}){{0,2}}", part) else []
        first, last, step = (*numbers, *numbers[-1:] * (2 - len(numbers)), 1.0)[:3] if numbers else (1.0, 0.0, 0.0)
        if last < first or step <= 0.0 or (last - first) / step > MOST:
            raise _cannot(text, part)
        found += [first + step * i for i in range(int((last - first) / step + 1e-9) + 1)]
    if len(set(found)) < len(found):
        raise _cannot(text, "a position twice")
    return found


def _cannot(text: str, got: str) -> ConfigError:
    return ConfigError(
        "the positions cannot be read",
        where=f"option --positions {text}",
        expected="1:50, 1:50:5 or 1,10,25, each position once",
        got=got or "nothing",
        remedy="correct the positions",
    )


def _draw(stored: StoredInterpolation, trace: Trace, positions: list[float], plot: Path, *, title: str) -> None:
    from sysid.reporting.figures.simulation_figure import simulation_figure
    from sysid.reporting.figures.style import styled

    drawn = [positions[i] for i in np.unique(np.linspace(0, len(positions) - 1, DRAWN).round().astype(int))]
    inputs = tuple(channel.name for channel in stored.inputs)
    names = [*inputs, *(_at(channel, position) for channel in stored.outputs for position in drawn)]
    shown = replace(
        trace, channels=tuple(trace.channel(name) for name in names), values=trace.columns(names), provenance=()
    )
    figure = simulation_figure(shown, inputs, outside=np.zeros(len(trace), dtype=bool), title=title)
    try:
        with replacing(plot) as draft, styled():
            figure.savefig(draft, format=plot.suffix.lower().removeprefix("."), dpi=150)
    except OSError as error:
        raise ConfigError("the picture cannot be written", where=plot, got=str(error)) from error
    console().print(f"positions {', '.join(f'{position:g}' for position in drawn)} drawn in {plot}", soft_wrap=True)
