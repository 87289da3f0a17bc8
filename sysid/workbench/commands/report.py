"""``sysid report``: the report of stored results."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.commands.run import console


def report_command(run_folder: Path) -> None:
    """Write a run's report.

    Args:
        run_folder: The run folder.

    Raises:
        ConfigError: If the folder holds no results.
    """
    from sysid.reporting.report import write_report

    console().print(f"Report: {write_report(run_folder)}", soft_wrap=True)
