"""Commands around a workspace: to make one, the page of its fits, the schemas of its files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sysid.workbench.command_line.surrogates import Duration, Outputs, Parameters, Ranges, SampleTime, wished

commands = typer.Typer()


@commands.command(epilog="Example: sysid init mine  sysid init mine --reference cylinder.fmu --range valve=-10:10")
def init(  # noqa: PLR0917 - one parameter an option, by name on the command line
    folder: Annotated[Path, typer.Argument(help="Folder to make.")],
    reference: Annotated[
        str | None,
        typer.Option(
            help="A slow model, as sysid surrogate takes it: the workspace has a pipeline of experiments on it. "
            "Nothing is run."
        ),
    ] = None,
    span: Ranges = None,
    parameter: Parameters = None,
    output: Outputs = None,
    sample_time: SampleTime = None,
    duration: Duration = None,
) -> None:
    """Make a workspace: folders for data sets, pipelines and reports, with a first pipeline that runs in seconds."""
    from sysid.workbench.commands.init import init_command

    init_command(folder, reference=reference, wish=wished(span, parameter, output, sample_time, duration))


@commands.command(epilog="Example: sysid ui")
def ui(
    port: Annotated[
        int, typer.Option(min=1, max=65535, help="Port on this machine; the next free one if it is taken.")
    ] = 5000,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
) -> None:
    """Compare fits in the browser (MLflow). Ctrl-C ends it."""
    from sysid.workbench.commands.ui import ui_command

    raise typer.Exit(ui_command(port, browser=not no_browser))


@commands.command(epilog="Example: sysid schema .  sysid schema --results")
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
