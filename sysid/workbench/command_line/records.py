"""Commands that look at a record, find a model of it, or draw the inputs of the next one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sysid.workbench.commands.reader_options import META, TYPED, ReaderCommand

commands = typer.Typer()


@commands.command(
    epilog="Example: sysid ingest measurements.csv --skip-lines 2 --zone Europe/Berlin", cls=ReaderCommand
)
def ingest(
    ctx: typer.Context,
    source: Annotated[str, typer.Argument(help="A file with traces, or the name of a data set.")],
    *,
    propose: Annotated[
        Path | None, typer.Option(help="Write the proposed dataset.yaml here, to be checked by you.")
    ] = None,
    split: Annotated[
        str | None,
        typer.Option(help="With --propose: shares of estimation, selection and validation, as 0.7 or 0.6,0.2,0.2."),
    ] = None,
    annotate: Annotated[
        str | None, typer.Option(help="Name of an annotator that says in which state each sample is.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="With --annotate: folder for the annotated data set.")] = None,
) -> None:
    """Look into a file of traces and propose a data set for it, or load a data set and sum it up."""
    if annotate is not None:
        from sysid.workbench.commands.annotate import annotate_command

        annotate_command(source, annotator=annotate, out=out)
        return
    from sysid.workbench.commands.ingest import ingest_command

    ingest_command(source, propose=propose, given=ctx.meta[META], split=split)


@commands.command(epilog='Example: sysid orders dryer --mapping "heater -> temperature"')
def orders(
    source: Annotated[str, typer.Argument(help="The name of a data set, or a file with traces.")],
    *,
    mapping: Annotated[
        str | None, typer.Option(help="Inputs and output, as u1+u2 -> y; not needed for two channels.")
    ] = None,
    max_na: Annotated[int | None, typer.Option(min=0, help="Largest number of past outputs.")] = None,
    max_nb: Annotated[int | None, typer.Option(min=0, help="Largest number of past values of each input.")] = None,
    max_nk: Annotated[int | None, typer.Option(min=0, help="Largest dead time in samples.")] = None,
    structures: Annotated[
        str, typer.Option(help="Structures beside ARX: some of SS,TF,OE,ARMAX,BJ,VectorARX, with commas, or all.")
    ] = "",
    most: Annotated[int, typer.Option(min=1, max=20, help="Largest order of those.")] = 4,
) -> None:
    """Which orders do the data ask for? ARX models by their one-step loss, others on request, the best in free run."""
    from sysid.workbench.commands.orders import orders_command

    ranges = {"max_na": max_na, "max_nb": max_nb, "max_nk": max_nk}
    orders_command(source, mapping=mapping, ranges=ranges, structures=structures, most=most)


@commands.command(epilog='Example: sysid advise dryer --mapping "heater -> temperature"')
def advise(
    source: Annotated[str, typer.Argument(help="The name of a data set, or a file with traces.")],
    mapping: Annotated[
        str | None, typer.Option(help="Inputs and output, as u1+u2 -> y; not needed for two channels.")
    ] = None,
    frequency: Annotated[str, typer.Option(help="Unit of the frequencies that are drawn: Hz or rad/s.")] = "Hz",
) -> None:
    """What is in this record? Excitation, feedback, dead times, sampling, noise, linearity, and what to try."""
    from sysid.workbench.commands.advise import advise_command

    advise_command(source, mapping=mapping, frequency=frequency)


@commands.command(epilog='Example: sysid auto rig.csv --mapping "pump -> level" --minutes 5')
def auto(  # noqa: PLR0917 - one parameter an option, by name on the command line
    source: Annotated[str, typer.Argument(help="The name of a data set, or a file with traces.")],
    mapping: Annotated[
        str | None, typer.Option(help="Inputs and outputs, as u1+u2 -> y; not needed for two channels.")
    ] = None,
    minutes: Annotated[float | None, typer.Option(help="Time for the search; 10 by default.")] = None,
    iterations: Annotated[
        int | None, typer.Option(min=1, help="In place of minutes: the same result on every machine.")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(help="How free runs begin: estimated (by default), rest, first-sample or measured=N."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of everything that is random.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes that train, one thread each.")] = 2,
    fresh: Annotated[bool, typer.Option("--fresh", help="Do everything again, whatever is stored.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder of the results; runs/auto-<data> by default.")] = None,
    no_tracking: Annotated[bool, typer.Option("--no-tracking", help="Leave MLflow out.")] = False,
) -> None:
    """Find a model without being told which: linear ones first, then others, as long as they gain.

    Exports the best and reports what accuracy costs. A search that was killed goes on where it was.
    """
    from sysid.workbench.commands.auto import auto_command

    given = {
        **{"mapping": mapping, "minutes": minutes, "iterations": iterations, "start": start, "seed": seed},
        **{"workers": workers},
    }
    raise typer.Exit(auto_command(source, given=given, fresh=fresh, out=out, tracking=not no_tracking))


@commands.command(
    "fit-response", epilog="Example: sysid fit-response sweep.csv --poles 2 --unit phase=deg", cls=ReaderCommand
)
def fit_response(
    ctx: typer.Context,
    source: Annotated[Path, typer.Argument(help="File of a frequency response: gain and phase, or complex numbers.")],
    *,
    poles: Annotated[
        str, typer.Option(help="Number of poles, or a range of which the best is taken; 1:6 by default.")
    ] = "",
    zeros: Annotated[
        int | None,
        typer.Option(min=0, help="Number of zeros; by default one less than poles, of a range as many as needed."),
    ] = None,
    dead_time: Annotated[float | None, typer.Option(min=0.0, help="In seconds; it is searched by default.")] = None,
    sample_time: Annotated[
        float | None,
        typer.Option(help="Of the model in seconds; by default some 20th of the period of the highest frequency."),
    ] = None,
    discrete: Annotated[bool, typer.Option("--discrete", help="A discrete model, of --sample-time.")] = False,
    weighting: Annotated[
        str,
        typer.Option(help="What counts of the error: none, relative to the response's size, root of it, or coherence."),
    ] = "none",
    mapping: Annotated[str, typer.Option(help="What input and output are called.")] = "u -> y",
    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ROLE=NAME",
            help="Which column is frequency, gain, phase, real, imaginary, complex or coherence; repeated.",
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(metavar="ROLE=UNIT", help="frequency=Hz, kHz, rad/s; gain=dB, 1; phase=deg, rad, -deg; repeated."),
    ] = None,
    frequency: Annotated[str, typer.Option(help="Unit of the frequencies that are drawn: Hz or rad/s.")] = "Hz",
    seed: Annotated[int, typer.Option(min=0, help="Of everything that is random.")] = 0,
    fresh: Annotated[bool, typer.Option("--fresh", help="Do everything again, whatever is stored.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder of the results; runs/response-<file> by default.")] = None,
    no_tracking: Annotated[bool, typer.Option("--no-tracking", help="Leave MLflow out.")] = False,
) -> None:
    """Fit a transfer function to a measured frequency response, as a sweep or an analyser saves it.

    Exports it and reports how well it is known; a pipeline of kind response is the same as a file.
    """
    from sysid.workbench.commands.fit_response import fit_response_command

    given = {
        **{"poles": poles or None, "zeros": zeros, "dead_time": dead_time, "sample_time": sample_time},
        **{"domain": "discrete" if discrete else None, "weighting": weighting, "mapping": mapping, "seed": seed},
        "report": {"frequency": frequency},
    }
    raise typer.Exit(
        fit_response_command(
            source, given=given, columns=column or [], units=unit or [], reading=ctx.meta[META],
            typed=ctx.meta[TYPED], fresh=fresh, out=out, tracking=not no_tracking,
        )
    )  # fmt: skip


@commands.command(epilog="Example: sysid excite multisine --samples 4000 --sample-time 0.01 --range 0:10 --out u.csv")
def excite(
    kind: Annotated[
        str, typer.Argument(help="prbs, multisine, noise, chirp, staircase, aprbs, ramps, sine or pulses.")
    ],
    *,
    out: Annotated[Path, typer.Option(help="File to write, .csv or .parquet.")],
    sample_time: Annotated[float, typer.Option(help="Seconds between samples.")],
    samples: Annotated[int | None, typer.Option(help="Length in samples; or --duration.")] = None,
    duration: Annotated[float | None, typer.Option(help="Length in seconds; or --samples.")] = None,
    span: Annotated[str, typer.Option("--range", help="Levels, never left: low:high, for all or by commas.")] = "-1:1",
    band: Annotated[str | None, typer.Option(help="Frequencies in Hz, low:high (multisine, noise, chirp).")] = None,
    names: Annotated[str, typer.Option(help="Of the channels, by commas; each has a signal of its own.")] = "u",
    units: Annotated[str, typer.Option(help="Of the channels: one for all, or by commas.")] = "1",
    seed: Annotated[int, typer.Option(help="Of everything that is random.")] = 0,
    clock: Annotated[int | None, typer.Option(help="prbs: samples that a level is held at least.")] = None,
    order: Annotated[int | None, typer.Option(help="prbs: bits of the shift register; noise: of the filter.")] = None,
    periods: Annotated[int | None, typer.Option(help="multisine, sine: how many.")] = None,
    lines: Annotated[str | None, typer.Option(help="multisine: full, odd or odd-random.")] = None,
    iterations: Annotated[int | None, typer.Option(help="multisine: for a low peak; 0 keeps random phases.")] = None,
    peak: Annotated[float | None, typer.Option(help="noise: standard deviations at which it is cut.")] = None,
    sweep: Annotated[str | None, typer.Option(help="chirp: linear or logarithmic.")] = None,
    levels: Annotated[int | None, typer.Option(help="staircase: how many.")] = None,
    hold: Annotated[
        int | None, typer.Option(help="staircase, aprbs, ramps, pulses: samples at a level, at least.")
    ] = None,
    longest: Annotated[int | None, typer.Option(help="aprbs, pulses: samples at a level at most.")] = None,
    direction: Annotated[str | None, typer.Option(help="staircase: up-down or random.")] = None,
    rise: Annotated[int | None, typer.Option(help="ramps: samples of the shortest.")] = None,
    longest_rise: Annotated[int | None, typer.Option(help="ramps: samples of the longest.")] = None,
    depth: Annotated[float | None, typer.Option(help="pulses: how far, as a share of the range.")] = None,
) -> None:
    """Draw the inputs of an experiment: signals that stay within a range and hold the frequencies asked for."""
    from sysid.workbench.commands.excite import excite_command

    given = {
        **{"samples": samples, "duration": duration, "sample_time": sample_time, "seed": seed, "clock": clock},
        **{"order": order, "periods": periods, "lines": lines, "iterations": iterations, "peak": peak, "sweep": sweep},
        **{"levels": levels, "hold": hold, "longest": longest, "direction": direction},
        **{"rise": rise, "longest_rise": longest_rise, "depth": depth},
    }
    excite_command(kind, out, given=given, span=span, band=band, names=names, units=units)
