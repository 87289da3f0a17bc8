"""What a report warns of: what the records and free runs say against its fits."""

from __future__ import annotations

from sysid.reporting.parts import Section
from sysid.reporting.results import FitRecord, Results
from sysid.reporting.tables import Cell, Table

TITLE = "What to look at"


def warnings_section(results: Results) -> Section | None:
    """All warnings, those of the chosen fit first.

    Args:
        results: Of the run.

    Returns:
        The section; ``None`` where there is nothing to warn of.
    """
    rows = tuple(
        (Cell(text=fit.name, header=True), Cell(text=text)) for fit in _warned(results) for text in fit.warnings
    )
    if not rows:
        return None
    table = Table(
        caption="What the records and free runs say against a fit.", head=(("fit", ""), ("warning", "")), rows=rows
    )
    return Section(anchor="warnings", title=TITLE, parts=(table,))


def warning_points(results: Results) -> list[tuple[str, str]]:
    """What of the warnings stands at the head of the report.

    Args:
        results: Of the run.

    Returns:
        One point: of the chosen fit, or of the first one that has any; none without.
    """
    warned = _warned(results)
    if not warned:
        return []
    more = sum(len(fit.warnings) for fit in warned) - 1
    rest = f" {more} more under '{TITLE}'." if more else ""
    return [("Warning", f"{warned[0].name}: {warned[0].warnings[0]}{rest}")]


def _warned(results: Results) -> list[FitRecord]:
    chosen = {id(fit) for fit in results.best_fits}
    return sorted((fit for fit in results.fits if fit.warnings), key=lambda fit: id(fit) not in chosen)
