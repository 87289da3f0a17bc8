"""``sysid report``: the report of stored results, or of one run against another."""

from __future__ import annotations

from pathlib import Path

from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import meant


def report_command(run_folder: Path, *, against: Path | None, pdf: bool) -> None:
    """Write a run's report."""
    from sysid.reporting import write_comparison, write_pdf, write_report

    run = meant(run_folder)
    page = write_report(run) if against is None else write_comparison(run, meant(against))
    console().print(f"Report: {page}", soft_wrap=True)
    if pdf:
        console().print(f"PDF:    {write_pdf(page, page.with_suffix('.pdf'))}", soft_wrap=True)
