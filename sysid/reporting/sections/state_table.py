"""Errors by state: where an annotator says in which state each sample is, the free run is scored state by state."""

from __future__ import annotations

from sysid.reporting.fit_records import FitRecord
from sysid.reporting.parts import Section
from sysid.reporting.results import Results
from sysid.reporting.sections.fit_tables import SCORED
from sysid.reporting.tables import Cell, Table, figure_cell
from sysid.units import squared


def state_section(results: Results) -> Section | None:
    """The section of errors by state.

    Args:
        results: Of a run.

    Returns:
        One table for each mapping; ``None`` for a run whose traces nobody annotated.
    """
    tables = [table for fits in results.mappings().values() if (table := _table(fits)) is not None]
    return Section(anchor="states", title="Error by state", parts=tuple(tables)) if tables else None


def _table(fits: list[FitRecord]) -> Table | None:
    labels = dict.fromkeys(label for fit in fits for case in fit.cases.values() for label in case.by_state or {})
    if not labels:
        return None
    rows = tuple((Cell(text=fit.name, header=True), *(_mean(fit, label) for label in labels)) for fit in fits)
    return Table(
        caption=f"Free run: mean squared error [{squared(fits[0].unit)}] by state, over the unseen cases. "
        f"{fits[0].mapping}.",
        head=(("fit", ""), *((label, _share(fits[0], label)) for label in labels)),
        rows=rows,
        note="Each state weighs by its samples in a case, and each case by its samples.",
    )


def _mean(fit: FitRecord, label: str) -> Cell:
    """The mean squared error over all samples of a state."""
    total, samples = 0.0, 0.0
    for case in fit.cases.values():
        record = (case.by_state or {}).get(label)
        if record is None or case.role not in SCORED:
            continue
        count = record.share * case.n_samples
        total, samples = total + count * record.mse, samples + count
    return figure_cell(total / samples) if samples else Cell(text="not in these cases")


def _share(fit: FitRecord, label: str) -> str:
    """How much of the unseen cases a state is."""
    chosen = [case for case in fit.cases.values() if case.role in SCORED]
    everything = sum(case.n_samples for case in chosen)
    share = sum(
        case.n_samples * (case.by_state or {})[label].share for case in chosen if label in (case.by_state or {})
    )
    return f"{100.0 * share / everything:.2g} % of the samples" if everything else ""
