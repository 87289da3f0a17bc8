"""``sysid publish``: a run's report in a form that is kept under version control."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import meant


def publish_command(run_folder: Path, *, name: str | None, into: Path, bundle: bool) -> None:
    """Publish a run."""
    from sysid.reporting import publish_run

    console().print(f"Published: {publish_run(meant(run_folder), into, name=name, bundle=bundle)}", soft_wrap=True)
