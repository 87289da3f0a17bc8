"""The command line: thin commands that import what they need when they need it.

Exit codes: 0 done, 2 the user's input has to change, 1 ours (a bug, a failed check, or results that are
complete but could not be tracked), 130 stopped by the user.
"""

from __future__ import annotations

import signal
import sys
import warnings
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sysid.errors import SysidError
from sysid.workbench.commands.reader_options import META, ReaderCommand, RecordCommand

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

app = typer.Typer(
    name="sysid",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> None:
    """Entry point of the command ``sysid``."""
    try:
        code = run_cli(sys.argv[1:])
    except KeyboardInterrupt:  # the second one, while the first was being told
        code = 130
    # A further Ctrl-C meets an interpreter that is already leaving, and would end it with a trace.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(code)


def run_cli(arguments: list[str]) -> int:
    """Run a command and turn what it raises into words and an exit code.

    Args:
        arguments: The words after ``sysid``.

    Returns:
        The exit code.
    """
    # Wherever it stands, as people add it to the end of the command that failed.
    debug = "--debug" in arguments
    from sysid.workbench.runner.console import speak_plainly

    speak_plainly()
    with warnings.catch_warnings():
        warnings.showwarning = _note
        warnings.simplefilter("default", FutureWarning)  # once each, whatever the caller's filters say
        return _run(arguments, debug=debug)


def _with_commands_of_fields(words: list[str]) -> None:
    """Add what installed packages bring, where a word is none of ours, or all are to be listed."""
    known = {command.name or "" for command in app.registered_commands} | {
        (command.callback.__name__ if command.callback else "").replace("_", "-") for command in app.registered_commands
    }
    first = next((word for word in words if not word.startswith("-")), None)
    if first in known:
        return
    from importlib.metadata import PackageNotFoundError, distribution, entry_points

    there = {group.name for group in app.registered_groups}
    found: Iterable[EntryPoint] = ()
    if first:
        found = entry_points(group="sysid.commands")
    else:
        # A list of all is wanted at once: to look through every installed package takes a tenth of its time.
        with suppress(PackageNotFoundError):
            found = distribution("sysid-workbench").entry_points.select(group="sysid.commands")
    for entry in found:
        if entry.name not in there and first in {None, entry.name}:
            app.add_typer(entry.load(), name=entry.name)


def _note(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as a person reads it: what is warned of, without the line of ours that found it."""
    _say(f"note: {message}")


def _run(arguments: list[str], *, debug: bool) -> int:
    try:
        _with_commands_of_fields(arguments)
        code = app([word for word in arguments if word != "--debug"], prog_name="sysid", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except KeyboardInterrupt:
        _say("stopped; the same command goes on where this one was")
        return 130
    except BrokenPipeError:
        # The reader of our output went away (sysid ... | head).
        return 0
    except SysidError as error:
        return _refuse(error, debug=debug)
    except Exception as error:  # noqa: BLE001 - the last line of defence: whatever it is, it is named and ends with a code
        return _unexpected(error, arguments, debug=debug)


def _refuse(error: SysidError, *, debug: bool) -> int:
    """What has to change, in words; notes say what was being done."""
    if debug:
        _trace()
    notes = [f"\n  while:    {note}" for note in getattr(error, "__notes__", ())]
    _say(f"error: {error}{''.join(notes)}")
    return error.exit_code


def _unexpected(error: Exception, arguments: list[str], *, debug: bool) -> int:
    """A usage error, a refusal of the operating system, or a bug of ours, which alone shows its trace unasked."""
    from sysid.workbench.runner.faults import refusal

    if callable(getattr(error, "show", None)):
        return _usage(error, arguments, debug=debug)
    if type(error).__name__ == "Abort":
        return 130
    known = refusal(error)
    if known is not None:
        return _refuse(known, debug=debug)
    _trace()
    _say(f"error: this is a fault in sysid ({type(error).__name__}); please report it with the lines above")
    return 1


def _usage(error: Any, arguments: list[str], *, debug: bool) -> int:
    """A command line that cannot be understood, in the same form as every other error."""
    import shlex

    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "sysid"
    if debug:
        _trace()
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        return int(error.exit_code)
    usage = SysidError(
        error.format_message().rstrip("."),
        expected=context.get_usage().removeprefix("Usage: ") if context is not None else None,
        got=shlex.join(["sysid", *arguments]),
        remedy=f"see {command} --help",
    )
    _say(f"error: {usage}")
    return int(getattr(error, "exit_code", 2))


def _trace() -> None:
    import traceback

    _say(traceback.format_exc().rstrip())


def _say(text: str) -> None:
    from sysid.workbench.runner.console import say

    say(text)


def _version(asked: bool) -> None:
    if asked:
        import sysid

        typer.echo(f"sysid {sysid.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[bool, typer.Option("--debug", help="Show the full trace of an error.")] = False,
    __: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")] = False,
) -> None:
    """Reference traces of a slow, trusted model in; a small, fast, frozen surrogate of known accuracy out."""


@app.command(epilog="Example: sysid run service-brake")
def run(
    pipeline: Annotated[str, typer.Argument(help="Name of a pipeline, or its YAML file.")],
    fresh: Annotated[bool, typer.Option("--fresh", help="Do everything again, whatever is stored.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder of the results; runs/<pipeline> by default.")] = None,
    no_tracking: Annotated[bool, typer.Option("--no-tracking", help="Leave MLflow out.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would be done, and how long.")] = False,
) -> None:
    """Run a pipeline: load traces, fit, score, export, report. A run that was killed goes on where it was.

    Ctrl-C ends the fit that is running, keeps its best model so far and goes on; twice stops.
    """
    from sysid.workbench.commands.run import plan_command, run_command

    if dry_run:
        plan_command(pipeline, fresh=fresh, out=out)
        return
    raise typer.Exit(run_command(pipeline, fresh=fresh, out=out, tracking=not no_tracking))


@app.command(epilog="Example: sysid sweep closed-loop-sweep --workers 4")
def sweep(  # noqa: PLR0917 - one parameter an option, by name on the command line
    pipeline: Annotated[str, typer.Argument(help="Name of a pipeline of kind sweep, or its YAML file.")],
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes that train, one thread each; what the YAML says by default.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Only go on with a sweep that was begun; refuse to begin one.")
    ] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Do everything again, whatever is stored.")] = False,
    out: Annotated[Path | None, typer.Option(help="Folder of the results; runs/<pipeline> by default.")] = None,
    no_tracking: Annotated[bool, typer.Option("--no-tracking", help="Leave MLflow out.")] = False,
) -> None:
    """Try what is in the ranges of a pipeline and export the best. A sweep that was killed goes on where it was."""
    from sysid.workbench.commands.sweep import sweep_command

    code = sweep_command(pipeline, workers=workers, resume=resume, fresh=fresh, out=out, tracking=not no_tracking)
    raise typer.Exit(code)


@app.command(epilog="Example: sysid ingest measurements.csv --skip-lines 2 --zone Europe/Berlin", cls=ReaderCommand)
def ingest(
    ctx: typer.Context,
    source: Annotated[str, typer.Argument(help="A file with traces, or the name of a data set.")],
    propose: Annotated[
        Path | None, typer.Option(help="Write the proposed dataset.yaml here, to be checked by you.")
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

    ingest_command(source, propose=propose, given=ctx.meta[META])


@app.command(epilog='Example: sysid orders dryer --mapping "heater -> temperature"')
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
        str, typer.Option(help="Structures beside ARX: some of SS,TF,OE,ARMAX,BJ, with commas, or all.")
    ] = "",
    most: Annotated[int, typer.Option(min=1, max=20, help="Largest order of those.")] = 4,
) -> None:
    """Which orders do the data ask for? ARX models by their one-step loss, others on request, the best in free run."""
    from sysid.workbench.commands.orders import orders_command

    ranges = {"max_na": max_na, "max_nb": max_nb, "max_nk": max_nk}
    orders_command(source, mapping=mapping, ranges=ranges, structures=structures, most=most)


@app.command(epilog='Example: sysid advise dryer --mapping "heater -> temperature"')
def advise(
    source: Annotated[str, typer.Argument(help="The name of a data set, or a file with traces.")],
    mapping: Annotated[
        str | None, typer.Option(help="Inputs and output, as u1+u2 -> y; not needed for two channels.")
    ] = None,
) -> None:
    """What is in this record? Excitation, feedback, dead times, sampling, noise, linearity, and what to try."""
    from sysid.workbench.commands.advise import advise_command

    advise_command(source, mapping=mapping)


@app.command(epilog='Example: sysid auto rig.csv --mapping "pump -> level" --minutes 5')
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


# What is said of an FMU beside its description

Ranges = Annotated[
    list[str] | None, typer.Option("--range", metavar="NAME=LOW:HIGH", help="Of an input of the FMU; repeated.")
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=LOW:HIGH", help="A parameter that varies, an input of the surrogate; repeated."),
]
Outputs = Annotated[list[str] | None, typer.Option(metavar="NAME", help="An output; all by default; repeated.")]
SampleTime = Annotated[float | None, typer.Option(help="Seconds; as the FMU says by default.")]
Duration = Annotated[float | None, typer.Option(help="Seconds an experiment; as the FMU says by default.")]


@app.command(epilog="Example: sysid surrogate cylinder.fmu --minutes 60 --range valve=-10:10 --parameter mass=100:300")
def surrogate(  # noqa: PLR0917 - one parameter an option, by name on the command line
    source: Annotated[
        str, typer.Argument(help="An FMU, or a pipeline of kind experiment. It is code, and is run with your rights.")
    ],
    minutes: Annotated[float, typer.Option(min=0.1, help="Time for experiments, search and proof together.")] = 60.0,
    span: Ranges = None,
    parameter: Parameters = None,
    output: Outputs = None,
    sample_time: SampleTime = None,
    duration: Duration = None,
    proof: Annotated[
        int | None, typer.Option(min=1, help="New experiments of the proof; 1000, or as many as there is time for.")
    ] = None,
    rounds: Annotated[
        int | None, typer.Option(min=1, help="Rounds of experiments that are added where the surrogate is worst.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes.")] = 2,
    seed: Annotated[int, typer.Option(min=0, help="Of everything that is random.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder of the results; runs/surrogate-<name> by default.")] = None,
    no_tracking: Annotated[bool, typer.Option("--no-tracking", help="Leave MLflow out.")] = False,
) -> None:
    """From a slow model to a small one in its place: experiments, a model of them, an FMU with the same ports, a proof.

    What was killed goes on where it was.
    """
    from sysid.workbench.commands.surrogate import surrogate_command, wish_of

    wish = wish_of(span or [], parameter or [], output or [], sample_time=sample_time, duration=duration)
    raise typer.Exit(
        surrogate_command(
            source,
            wish,
            minutes=minutes,
            proof=proof,
            rounds=rounds,
            workers=workers,
            seed=seed,
            out=out,
            tracking=not no_tracking,
        )
    )


@app.command(epilog="Example: sysid excite multisine --samples 4000 --sample-time 0.01 --range 0:10 --out u.csv")
def excite(
    kind: Annotated[
        str, typer.Argument(help="prbs, multisine, noise, chirp, staircase, aprbs, ramps, sine or pulses.")
    ],
    *,
    out: Annotated[Path, typer.Option(help="File to write, .csv or .parquet.")],
    sample_time: Annotated[float, typer.Option(help="Seconds between samples.")],
    samples: Annotated[int | None, typer.Option(help="Length in samples; or --duration.")] = None,
    duration: Annotated[float | None, typer.Option(help="Length in seconds; or --samples.")] = None,
    span: Annotated[str, typer.Option("--range", help="Levels, never left: low:high.")] = "-1:1",
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


@app.command(
    epilog="Example: sysid simulate runs/service-brake new.csv --out simulated.csv --constant valve=3",
    cls=RecordCommand,
)
def simulate(
    ctx: typer.Context,
    bundle: Annotated[Path, typer.Argument(help="Folder or zip of an exported model or cascade, or a run folder.")],
    inputs: Annotated[Path | None, typer.Argument(help="File with the input channels at every sample.")] = None,
    *,
    out: Annotated[Path, typer.Option(help="File to write, .csv or .parquet: time, inputs and simulated outputs.")],
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
        float | None, typer.Option(help="Output before the first sample; its declared level by default.")
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
    from sysid.workbench.commands.simulate import Wish, simulate_command

    if old_positions is not None:
        from sysid.workbench.old_words import tell_old_word

        tell_old_word("--places", "--positions")
        positions = positions or old_positions
    wish = Wish(
        bundle=bundle, inputs=inputs, out=out, initial=initial, start=start, constants=constant or [],
        command=command, time_unit=time_unit, unit=unit, plot=plot, reading=ctx.meta[META],
    )  # fmt: skip
    if positions is None:
        simulate_command(wish)
        return
    from sysid.workbench.commands.simulate_line import simulate_line_command

    simulate_line_command(wish, positions)


@app.command(
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


@app.command(epilog='Example: sysid export service-brake --fit "open loop" --out open-loop')
def export(
    pipeline: Annotated[str, typer.Argument(help="Name of a pipeline that has been run, or its YAML file.")],
    fit: Annotated[
        str,
        typer.Option(help="Name of the fit; in an assembly of a member, of a round, or assembly: the whole."),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder of the bundle; in the run folder by default.")] = None,
    run_folder: Annotated[Path | None, typer.Option(help="The run folder; runs/<pipeline> by default.")] = None,
    pack: Annotated[bool, typer.Option("--zip", help="Pack the bundle into one file beside it.")] = False,
) -> None:
    """Export a fit, a member or a whole of a finished run as files that run elsewhere, checked against the model."""
    from sysid.workbench.commands.export import export_command

    export_command(pipeline, fit=fit, out=out, run_folder=run_folder, pack=pack)


@app.command(epilog="Example: sysid promote bp-ar-to-bc")
def promote(
    model: Annotated[
        str, typer.Argument(help="Name of a registered model, its mapping, or the pipeline that exported it.")
    ],
    version: Annotated[str | None, typer.Option(help="The version; the candidate by default.")] = None,
) -> None:
    """Make the newest export of a model, or an earlier one, the champion that others load from MLflow."""
    from sysid.workbench.commands.promote import promote_command

    promote_command(model, version=version)


@app.command(epilog="Example: sysid report runs/service-brake")
def report(
    run_folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    against: Annotated[Path | None, typer.Option(help="Folder of another run: report this one against it.")] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Print it as PDF too; needs Chromium, Chrome or Edge.")] = False,
) -> None:
    """Write the report of a run again, or against another run, from stored results; nothing is fitted."""
    from sysid.workbench.commands.report import report_command

    report_command(run_folder, against=against, pdf=pdf)


@app.command(epilog="Example: sysid publish runs/service-brake")
def publish(
    run_folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    name: Annotated[str | None, typer.Option("--as", help="Name of the report; the pipeline's by default.")] = None,
    into: Annotated[Path, typer.Option(help="Folder of the published reports.")] = Path("reports"),
    bundle: Annotated[
        bool, typer.Option("--bundle", help="The frozen surrogate that the run exported as well.")
    ] = False,
) -> None:
    """Publish a run's report: a page of text and a few figures, small enough to be kept under version control."""
    from sysid.workbench.commands.publish import publish_command

    publish_command(run_folder, name=name, into=into, bundle=bundle)


@app.command(epilog="Example: sysid ui")
def ui(
    port: Annotated[
        int, typer.Option(min=1, max=65535, help="Port on this machine; the next free one if it is taken.")
    ] = 5000,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
) -> None:
    """Compare fits in the browser (MLflow). Ctrl-C ends it."""
    from sysid.workbench.commands.ui import ui_command

    raise typer.Exit(ui_command(port, browser=not no_browser))


@app.command(epilog="Example: sysid schema .  sysid schema --results")
def schema(
    folder: Annotated[Path, typer.Argument(help="A workspace.")] = Path(),
    results: Annotated[bool, typer.Option("--results", help="Print the schema of results.json instead.")] = False,
) -> None:
    """Write the JSON schemas of pipelines and data sets into a workspace: editors complete and check by them."""
    from sysid.workbench.commands.schema import print_results_schema, schema_command

    if results:
        print_results_schema()
    else:
        schema_command(folder)


@app.command(epilog="Example: sysid init mine  sysid init mine --reference cylinder.fmu --range valve=-10:10")
def init(  # noqa: PLR0917 - one parameter an option, by name on the command line
    folder: Annotated[Path, typer.Argument(help="Folder to make.")],
    reference: Annotated[
        Path | None, typer.Option(help="An FMU: the workspace has a pipeline of experiments on it. Nothing is run.")
    ] = None,
    span: Ranges = None,
    parameter: Parameters = None,
    output: Outputs = None,
    sample_time: SampleTime = None,
    duration: Duration = None,
) -> None:
    """Make a workspace: folders for data sets, pipelines and reports, with a first pipeline that runs in seconds."""
    from sysid.workbench.commands.init import init_command
    from sysid.workbench.commands.surrogate import wish_of

    wish = wish_of(span or [], parameter or [], output or [], sample_time=sample_time, duration=duration)
    init_command(folder, reference=reference, wish=wish)
