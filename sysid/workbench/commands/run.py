"""``sysid run``: a pipeline of any kind, or what a run of it would do."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.fits.config import find_pipeline
from sysid.workbench.kinds import RunRequest, kind_of, kinds
from sysid.workbench.listeners import foresee, perform
from sysid.workbench.runner.console import console
from sysid.workbench.runner.dry_run import together
from sysid.workbench.runner.screen import duration, table_of_steps


def run_command(pipeline: str, *, fresh: bool, out: Path | None, tracking: bool) -> int:
    """Run a pipeline and show how it came out."""
    return run_request(
        RunRequest(path=find_pipeline(pipeline), typed=pipeline, fresh=fresh, out=out, tracking=tracking)
    )


def run_request(request: RunRequest) -> int:
    """Run the pipeline of a file, of whatever kind it is.

    Args:
        request: What was asked.

    Returns:
        Exit code, as :func:`run_command`.

    Raises:
        UserError: If the pipeline, its data or its options cannot be used.
    """
    return perform(kinds()[kind_of(request.path)].load_program()(request), request)


def plan_command(pipeline: str, *, fresh: bool, out: Path | None) -> None:
    """Say what a run would do and how long it would take, without doing it."""
    request = RunRequest(path=find_pipeline(pipeline), typed=pipeline, fresh=fresh, out=out)
    planned = foresee(kinds()[kind_of(request.path)].load_program()(request), request)
    target, whole = console(), together(planned)
    target.print(table_of_steps(planned))
    said = f"Together at most {duration(whole.seconds or 0.0)}"
    target.print(f"{said}{f', and {whole.basis}' if whole.basis else ''}. Nothing was run.", soft_wrap=True)
