"""One way in: a run folder becomes a report."""

from __future__ import annotations

from pathlib import Path

from sysid.atomic import replacing
from sysid.reporting.html import render_html
from sysid.reporting.kinds import read_run, run_document
from sysid.reporting.records import RESULTS_FILE, write_record


def write_report(run_folder: Path, *, workspace: Path | None = None) -> Path:
    """Make the report of a run of any kind from what the run stored; nothing is fitted or simulated.

    Args:
        run_folder: The run's folder, with ``results.json`` and the signals beside it.
        workspace: Where the user's own tables of published figures lie; ``None`` is the current folder.

    Returns:
        The page, ``report/index.html``; ``report/results.json`` beside it holds the same numbers.

    Raises:
        ConfigError: If a stored file is missing, damaged or from a newer release, or the table of published
            figures is not known.
    """
    folder = Path(run_folder)
    document = run_document(folder, read_run(folder), workspace=workspace)
    page = render_html(document)
    write_record(folder / "report" / RESULTS_FILE, document.results)
    path = folder / "report" / "index.html"
    with replacing(path) as draft:
        draft.write_text(page, encoding="utf-8")
    return path
