"""Commands that take a frozen model: run it, find its worst, write it out, make it the champion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sysid.workbench.commands.reader_options import META, RecordCommand

commands = typer.Typer()


@commands.command(
    epilog="Example: sysid simulate runs/service-brake new.csv --out simulated.csv --constant valve=3",
    cls=RecordCommand,
)
def simulate(
    ctx: typer.Context,
    bundle: Annotated[Path, typer.Argument(help="Folder or zip of an exported model or cascade, or a run folder.")],
    inputs: Annotated[
        Path | None, typer.Argument(help="File with the input channels at every sample, or the name of a data set.")
    ] = None,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write, .csv or .parquet: time, inputs and simulated outputs; NAME.simulated.csv by default."
        ),
    ] = None,
    command: Annotated[
        Path | None,
        typer.Option(
            help="In place of INPUTS: a table of a few rows, each held to the next one's time. CSV, JSON, YAML."
        ),
    ] = None,
    time_unit: Annotated[str | None, typer.Option(help="Unit of the command's times, as s or ds.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the command's values, as psi or kPa.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Picture to draw, .png, .svg or .pdf; beside OUT by default for a command.")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            help="How the run begins: estimated, rest, first-sample or measured=N. By default as the pipeline said "
            "where INPUTS has the measured output, and at rest without it."
        ),
    ] = None,
    initial: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NUMBER",
            help="Output before the first sample; its declared level by default. NAME=NUMBER of several, repeated.",
        ),
    ] = None,
    constant: Annotated[
        list[str] | None, typer.Option(metavar="NAME=NUMBER", help="An input that is a number and no column; repeated.")
    ] = None,
    positions: Annotated[
        str | None,
        typer.Option(
            help="Positions along a line, as 1:50; BUNDLE is then the folder of its run, or of its published page."
        ),
    ] = None,
    old_positions: Annotated[str | None, typer.Option("--places", hidden=True)] = None,
) -> None:
    """Run an exported model or cascade on a file of inputs or a command, fed with nothing but its own past."""
    from sysid.workbench.commands.simulate import Wish, parse_initial, simulate_command

    if old_positions is not None:
        from sysid.workbench.old_words import tell_old_word

        tell_old_word("--places", "--positions")
        positions = positions or old_positions
    wish = Wish(
        bundle=bundle, inputs=inputs, out=out, initial=parse_initial(initial or []), start=start,
        constants=constant or [], command=command, time_unit=time_unit, unit=unit, plot=plot, reading=ctx.meta[META],
    )  # fmt: skip
    if positions is None:
        simulate_command(wish)
        return
    from sysid.workbench.commands.simulate_line import simulate_line_command

    simulate_line_command(wish, positions)


@commands.command(epilog="Example: sysid forecast runs/dryer past.csv to-come.csv", cls=RecordCommand)
def forecast(
    ctx: typer.Context,
    bundle: Annotated[Path, typer.Argument(help="Folder or zip of an exported model, or a run folder.")],
    past: Annotated[Path, typer.Argument(help="File of the samples before: inputs and measured outputs.")],
    inputs: Annotated[Path, typer.Argument(help="File of the inputs to come.")],
    *,
    out: Annotated[
        Path | None, typer.Option(help="File to write, .csv or .parquet; NAME.forecast.csv by default.")
    ] = None,
    constant: Annotated[
        list[str] | None, typer.Option(metavar="NAME=NUMBER", help="An input that is a number and no column; repeated.")
    ] = None,
) -> None:
    """Say what is to be expected after measured samples: the free run, with what is known of the noise carried on."""
    from sysid.workbench.commands.forecast import ForecastWish, forecast_command

    forecast_command(
        ForecastWish(bundle=bundle, past=past, inputs=inputs, out=out, constants=constant or [], reading=ctx.meta[META])
    )


@commands.command(
    epilog="Example: sysid worst runs/tank/bundle --like tank-random --seeds 1000:1999 --output h2 --keep 100 "
    "--into datasets/found"
)
def worst(
    bundle: Annotated[Path, typer.Argument(help="Folder or zip of an exported model or cascade.")],
    *,
    like: Annotated[str, typer.Option(help="Data set of random sequences; new ones are drawn as a case of it is.")],
    seeds: Annotated[str, typer.Option(help="Seeds of the new sequences, the first and the last: 130000:132999.")],
    output: Annotated[str, typer.Option(help="Output whose error counts.")],
    keep: Annotated[int, typer.Option(help="How many are kept, the worst ones.")],
    into: Annotated[Path, typer.Option(help="Folder of the data set that is written.")],
    case: Annotated[str | None, typer.Option(help="The case; the first by default.")] = None,
) -> None:
    """Find what an exported model is worst at among new sequences of the reference, as a data set to train on."""
    from sysid.workbench.commands.worst import worst_command

    worst_command(bundle, like=like, case=case, seeds=seeds, output=output, keep=keep, into=into)


@commands.command(epilog="Example: sysid response runs/dryer --fit ARX")
def response(
    model: Annotated[Path, typer.Argument(help="Folder of a run, whose fits have intervals; or a bundle, without.")],
    *,
    fit: Annotated[str | None, typer.Option(help="Name of a fit of the run; the best by default.")] = None,
    seconds: Annotated[float | None, typer.Option(help="Length of the step response; until it has settled.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for pictures and tables; the current one by default.")
    ] = None,
    frequency: Annotated[str, typer.Option(help="Unit of the frequencies that are drawn: Hz or rad/s.")] = "Hz",
    frequencies: Annotated[
        str | None,
        typer.Option(help="Of the Bode diagram, in that unit: 0.1,1,10 or low:high:points; four decades by default."),
    ] = None,
) -> None:
    """Step response, Bode diagram and poles of a linear model: numbers, tables and pictures, with intervals."""
    from sysid.workbench.commands.response import response_command

    response_command(model, fit=fit, seconds=seconds, out=out, frequency=frequency, frequencies=frequencies)


@commands.command(epilog='Example: sysid export service-brake --fit "open loop" --out open-loop')
def export(
    pipeline: Annotated[
        str,
        typer.Argument(help="Name of a pipeline that has been run, or its YAML file; or a bundle, written again."),
    ],
    fit: Annotated[
        str | None,
        typer.Option(help="Name of the fit; in an assembly of a member, of a round, or assembly: the whole."),
    ] = None,
    *,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the bundle; in the run folder by default, of a bundle itself.")
    ] = None,
    formats: Annotated[
        str | None, typer.Option(help="Of a bundle, formats to write, with commas; those that it has by default.")
    ] = None,
    run_folder: Annotated[Path | None, typer.Option(help="The run folder; runs/<pipeline> by default.")] = None,
    pack: Annotated[bool, typer.Option("--zip", help="Pack the bundle into one file beside it.")] = False,
    doubt: Annotated[
        Path | None,
        typer.Option(help="YAML with what the whole of a bundle is to doubt: the section doubt of a pipeline."),
    ] = None,
    mean: Annotated[
        Path | None,
        typer.Option(help="YAML with other bundles, the mean of which and of this one answers: the section mean."),
    ] = None,
) -> None:
    """Export a fit, a member or a whole of a finished run as files that run elsewhere, checked against the model.

    Of a bundle, its files are written again by this version, without training.
    """
    from sysid.workbench.commands.export import export_command

    export_command(
        pipeline, fit=fit, out=out, run_folder=run_folder, formats=formats, pack=pack, doubt=doubt, mean=mean
    )


@commands.command(epilog="Example: sysid promote bp-ar-to-bc")
def promote(
    model: Annotated[
        str, typer.Argument(help="Name of a registered model, its mapping, or the pipeline that exported it.")
    ],
    version: Annotated[str | None, typer.Option(help="The version; the candidate by default.")] = None,
) -> None:
    """Make the newest export of a model, or an earlier one, the champion that others load from MLflow."""
    from sysid.workbench.commands.promote import promote_command

    promote_command(model, version=version)
