"""What a report warns of: what the records and free runs say against its fits."""

from __future__ import annotations

from sysid.reporting.parts import Section
from sysid.reporting.results import Results
from sysid.reporting.tables import Cell, Table

TITLE = "What to look at"


def warnings_section(results: Results) -> Section | None:
    """All warnings, those of the chosen fit first; what is said of several fits is said once.

    Args:
        results: Of the run.

    Returns:
        The section; ``None`` where there is nothing to warn of.
    """
    said = _said(results)
    if not said:
        return None
    rows = tuple((Cell(text=", ".join(names), header=True), Cell(text=text)) for text, names in said.items())
    table = Table(
        caption="What the records and free runs say against a fit.", head=(("fit", ""), ("warning", "")), rows=rows
    )
    return Section(anchor="warnings", title=TITLE, parts=(table,))


def warning_points(results: Results) -> list[tuple[str, str]]:
    """What of the warnings stands at the head of the report.

    Args:
        results: Of the run.

    Returns:
        One point: of the chosen fit, or of the first one that has any, said not to be the chosen one; none without.
    """
    said = _said(results)
    if not said:
        return []
    text, names = next(iter(said.items()))
    aside = "" if any(fit.name == names[0] for fit in results.best_fits) else ", which was not chosen"
    rest = f" {len(said) - 1} more under '{TITLE}'." if len(said) > 1 else ""
    return [("Warning", f"{names[0]}{aside}: {text}{rest}")]


def _said(results: Results) -> dict[str, list[str]]:
    """The fits that each warning is of, the chosen ones first."""
    chosen, said = {id(fit) for fit in results.best_fits}, dict[str, list[str]]()
    for fit in sorted(results.fits, key=lambda fit: id(fit) not in chosen):
        for text in fit.warnings:
            said.setdefault(text, []).append(fit.name)
    return said
