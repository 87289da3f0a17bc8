"""Commands that go from somebody's slow model to a surrogate, and make a workspace of one's own."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from sysid.references.described import Wish

commands = typer.Typer()

Ranges = Annotated[
    list[str] | None,
    typer.Option("--range", metavar="NAME=LOW:HIGH", help="Of an input, 'valve [V]=0:10' with its unit; repeated."),
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=LOW:HIGH", help="A parameter that varies, an input of the surrogate; repeated."),
]
Outputs = Annotated[
    list[str] | None, typer.Option(metavar="NAME", help="An output; all of an FMU by default; repeated.")
]
SampleTime = Annotated[float | None, typer.Option(help="Seconds; as an FMU says by default.")]
Duration = Annotated[float | None, typer.Option(help="Seconds an experiment; as an FMU says by default.")]


@commands.command(
    epilog="Example: sysid surrogate cylinder.fmu --minutes 60 --range valve=-10:10 --parameter mass=100:300"
)
def surrogate(  # noqa: PLR0917 - one parameter an option, by name on the command line
    source: Annotated[
        str,
        typer.Argument(
            help="An FMU, file.py:function, 'a command line with {inputs} and {outputs}', a YAML that has one of these "
            "under reference, or a pipeline of kind experiment. It is code, and is run with your rights."
        ),
    ],
    minutes: Annotated[float, typer.Option(min=0.1, help="Time for experiments, search and proof together.")] = 60.0,
    span: Ranges = None,
    parameter: Parameters = None,
    output: Outputs = None,
    sample_time: SampleTime = None,
    duration: Duration = None,
    proof: Annotated[
        int | None,
        typer.Option(
            min=1, help="New experiments of the proof, beside --minutes; 1000, or as many as these have time for."
        ),
    ] = None,
    rounds: Annotated[
        int | None, typer.Option(min=1, help="Rounds of experiments that are added where the surrogate is worst.")
    ] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as the pipeline says, two by default.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of everything that is random.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder of the results; runs/surrogate-<name> by default.")] = None,
    no_tracking: Annotated[bool, typer.Option("--no-tracking", help="Leave MLflow out.")] = False,
) -> None:
    """From a slow model to a small one in its place: experiments, a model of them, an FMU with the same ports, a proof.

    What was killed goes on where it was.
    """
    began = time.monotonic()  # what is imported counts
    from sysid.workbench.commands.surrogate import surrogate_command

    wish = wished(span, parameter, output, sample_time, duration)
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
            began=began,
        )
    )


def wished(
    ranges: list[str] | None, parameters: list[str] | None, outputs: list[str] | None, sample_time: float | None,
    duration: float | None,
) -> Wish:  # fmt: skip
    """What is asked of a surrogate, from the options of the command line.

    Args:
        ranges: Of inputs, each ``NAME=LOW:HIGH``.
        parameters: Likewise of parameters that vary.
        outputs: Names.
        sample_time: Seconds.
        duration: Seconds of an experiment.

    Returns:
        The wish.
    """
    from sysid.workbench.surrogates.asked import pairs, wish_of

    inputs, varied = pairs(ranges or [], "--range"), pairs(parameters or [], "--parameter")
    return wish_of(inputs, varied, outputs or [], sample_time=sample_time, duration=duration)
