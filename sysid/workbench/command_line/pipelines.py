"""Commands that run a pipeline and write what comes of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

commands = typer.Typer()


@commands.command(epilog="Example: sysid run service-brake")
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


@commands.command(epilog="Example: sysid sweep closed-loop-sweep --workers 4")
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


@commands.command(epilog="Example: sysid report runs/service-brake")
def report(
    run_folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    against: Annotated[Path | None, typer.Option(help="Folder of another run: report this one against it.")] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Print it as PDF too; needs Chromium, Chrome or Edge.")] = False,
) -> None:
    """Write the report of a run again, or against another run, from stored results; nothing is fitted."""
    from sysid.workbench.commands.report import report_command

    report_command(run_folder, against=against, pdf=pdf)


@commands.command(epilog="Example: sysid publish runs/service-brake")
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


@commands.command(epilog="Example: sysid equations service-cascade")
def equations(
    pipeline: Annotated[str, typer.Argument(help="Name of a pipeline of kind assembly, or its YAML file.")],
) -> None:
    """Print the fixed members of an assembly as equations, in the form that its YAML takes now."""
    from sysid.workbench.commands.equations import equations_command

    equations_command(pipeline)
