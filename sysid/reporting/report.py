"""One way in: a run folder becomes a report."""

from __future__ import annotations

from pathlib import Path

from sysid.atomic import replacing
from sysid.reporting.comparing.published import read_published
from sysid.reporting.comparing.published_comparison import with_published
from sysid.reporting.document import build_document
from sysid.reporting.html import render_html
from sysid.reporting.judging.results import read_judgement_results, write_judgement_report
from sysid.reporting.results import read_results, write_results


def write_report(run_folder: Path, *, workspace: Path | None = None) -> Path:
    """Make the report of a run from what the run stored; nothing is fitted or simulated.

    Args:
        run_folder: The run's folder, with ``results.json`` and ``fits/<slug>/signals.npz``.
        workspace: Where the user's own tables of published figures lie; ``None`` is the current folder.

    Returns:
        The page, ``report/index.html``; ``report/results.json`` beside it holds the same numbers.

    Raises:
        ConfigError: If a stored file is missing, damaged or from a newer release, or the table of published
            figures is not known.
    """
    folder = Path(run_folder)
    judged = read_judgement_results(folder)
    if judged is not None:
        return write_judgement_report(folder, judged)
    stored = read_results(folder)
    published = None if stored.published is None else read_published(stored.published, workspace=workspace)
    results = with_published(stored, published)
    page = render_html(build_document(folder, results, published))
    write_results(folder / "report", results)
    path = folder / "report" / "index.html"
    with replacing(path) as draft:
        draft.write_text(page, encoding="utf-8")
    return path
