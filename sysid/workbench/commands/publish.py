"""``sysid publish``: a run's report in a form that is kept under version control."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.audience import console


def publish_command(run_folder: Path, *, name: str | None, into: Path) -> None:
    """Publish a run.

    Args:
        run_folder: The run folder.
        name: Name of the report; the pipeline's by default.
        into: Folder of the published reports.

    Raises:
        ConfigError: If the folder holds no results.
    """
    from sysid.reporting import publish_run

    console().print(f"Published: {publish_run(run_folder, into, name=name)}", soft_wrap=True)
