"""``sysid run``: a pipeline with everybody who listens to it."""

from __future__ import annotations

from pathlib import Path

from sysid.errors import ConfigError
from sysid.workbench.fits.config import find_pipeline, read_pipeline
from sysid.workbench.fits.run import run_pipeline
from sysid.workbench.kinds import DEFAULT, RunRequest, kind_of, kinds
from sysid.workbench.runner.console import console
from sysid.workbench.runner.listeners import Audience, typed_command
from sysid.workbench.runner.screen import duration, table_of_fits, table_of_steps


def run_command(pipeline: str, *, fresh: bool, out: Path | None, tracking: bool) -> int:
    """Run a pipeline and show how it came out.

    Args:
        pipeline: Its name or file.
        fresh: Do everything again.
        out: The run folder.
        tracking: Whether fits are tracked in MLflow.

    Returns:
        Exit code: 0, or 1 if everything is done and stored but something could not be tracked.

    Raises:
        UserError: If the pipeline, its data or its options cannot be used.
    """
    path = find_pipeline(pipeline)
    request = RunRequest(path=path, typed=pipeline, fresh=fresh, out=out, tracking=tracking)
    return kinds()[kind_of(path)].load_runner()(request)


def plan_command(pipeline: str, *, fresh: bool, out: Path | None) -> None:
    """Say what a run would do and how long it would take, without doing it.

    Args:
        pipeline: Its name or file.
        fresh: Whether everything would be done again.
        out: The run folder.

    Raises:
        UserError: If the pipeline, its data or its options cannot be used.
    """
    from sysid.workbench.runner.plan import plan

    path = find_pipeline(pipeline)
    kind = kind_of(path)
    if kind != DEFAULT:
        raise ConfigError(
            f"there is no dry run for pipelines of kind {kind}",
            where=path,
            expected=f"a pipeline of kind {DEFAULT}",
            got=kind,
            remedy="run it: what is done is stored, and Ctrl-C at any time loses nothing that is finished",
        )
    read = read_pipeline(path)
    planned = plan(read, out or Path("runs") / read.config.name, fresh=fresh)
    target = console()
    target.print(table_of_steps(planned))
    target.print(f"Together at most {duration(sum(one.seconds for one in planned))}. Nothing was run.")


def run_fits(request: RunRequest) -> int:
    """Run a pipeline of kind ``fits``.

    Args:
        request: What was asked.

    Returns:
        Exit code, as :func:`run_command`.

    Raises:
        UserError: If the pipeline, its data or its options cannot be used.
    """
    read, out = read_pipeline(request.path), request.out
    folder, audience = out or Path("runs") / read.config.name, Audience.of(tracking=request.tracking)
    command = typed_command("run", request.typed, out)
    try:
        results = run_pipeline(read, folder, command=command, fresh=request.fresh, watchers=audience.watchers)
    finally:
        audience.screen.close()
    audience.target.print()
    audience.target.print(table_of_fits(results))
    if results.best is not None:
        audience.target.print(f"Best: {results.best.name}. {results.best.chosen_by}")
    code = audience.end(
        {
            "Report": folder / "report" / "index.html",
            "Bundle": folder / "bundle",
            "Results": folder / "results.json",
        }
    )
    if request.tracking and code == 0:
        audience.target.print(f"{'Compare:':<9}sysid ui")
    return code
