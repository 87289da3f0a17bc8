"""``sysid simulate``: a bundle over a file of inputs, or over a command of a few rows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sysid.atomic import replacing
from sysid.errors import ConfigError
from sysid.export.flags import Flag
from sysid.export.reading import read_bundle
from sysid.export.simulation import Simulation, read_inputs, simulate_bundle
from sysid.ingest import write_trace
from sysid.workbench.runner.console import console

PICTURES = (".png", ".svg", ".pdf")
"""What a picture may end in."""


def simulate_command(
    bundle: Path,
    inputs: Path | None,
    out: Path,
    *,
    initial: float | None = None,
    command: Path | None = None,
    time_unit: str | None = None,
    unit: str | None = None,
    plot: Path | None = None,
) -> None:
    """Simulate and write time, inputs and outputs.

    Args:
        bundle: The bundle's folder, or its zip.
        inputs: A file with the input channels; units are converted to the bundle's.
        out: The file to write, ``.csv`` or ``.parquet``.
        initial: The output's value before the first sample; ``None`` is its declared level.
        command: A command table in place of ``inputs``.
        time_unit: Unit of the command's times, where it does not say.
        unit: Unit of the command's values, likewise.
        plot: A picture to draw; by default beside ``out`` for a command, and none for inputs.

    Raises:
        BundleError: If the bundle is damaged or incomplete.
        UserError: If the inputs cannot be read, or the output not written.
    """
    _check(inputs, command, initial, plot)
    read = read_bundle(bundle)
    if command is not None:
        simulation = simulate_bundle(read, command, time_unit=time_unit, unit=unit, initial=initial)
        plot = plot or out.with_suffix(".png")
    else:
        simulation = simulate_bundle(read, read_inputs(read, Path(str(inputs))), initial=initial)
    write_trace(replace(simulation.trace, name=out.stem), out)
    _tell(simulation, out)
    if plot is not None:
        _draw(simulation, plot, title=read.metadata["mapping"])
        console().print(f"drawn in {plot}", soft_wrap=True)


def _check(inputs: Path | None, command: Path | None, initial: float | None, plot: Path | None) -> None:
    if (inputs is None) == (command is None):
        raise ConfigError(
            "nothing says what to simulate" if inputs is None else "two files say what to simulate",
            where="sysid simulate",
            expected="a file of inputs at every sample, or --command with a table of a few rows",
            got="neither" if inputs is None else f"{inputs} and --command {command}",
            remedy="give one of them",
        )
    if initial is not None and not np.isfinite(initial):
        raise ConfigError(
            "the output cannot begin there",
            where="option --initial",
            expected="a finite number, in the output's unit",
            got=f"--initial {initial}",
            remedy="give the output's value before the first sample, or leave --initial out",
        )
    check_picture(plot)


def check_picture(plot: Path | None) -> None:
    """Refuse a picture of a kind that cannot be drawn.

    Args:
        plot: The picture; ``None`` for none.

    Raises:
        ConfigError: If its ending is of another kind.
    """
    if plot is not None and plot.suffix.lower() not in PICTURES:
        raise ConfigError(
            "no picture of this kind can be drawn",
            where="option --plot",
            expected=f"a name that ends in {', '.join(PICTURES)}",
            got=f"--plot {plot}",
            remedy="change the ending",
        )


def _tell(simulation: Simulation, out: Path) -> None:
    names = ", ".join(simulation.outputs)
    console().print(f"{len(simulation.trace)} samples of {names} written to {out}", soft_wrap=True)
    for sentence in simulation.sentences:
        console().print(sentence, soft_wrap=True)


def _draw(simulation: Simulation, plot: Path, *, title: str) -> None:
    from sysid.reporting.figures.simulation_figure import simulation_figure
    from sysid.reporting.figures.style import styled

    outside = (simulation.flags & int(Flag.OUTSIDE_RANGE)) > 0
    figure = simulation_figure(simulation.trace, simulation.inputs, outside=outside, title=title)
    try:
        with replacing(plot) as draft, styled():
            figure.savefig(draft, format=plot.suffix.lower().removeprefix("."), dpi=150)
    except OSError as error:
        raise ConfigError("the picture cannot be written", where=plot, got=str(error)) from error
