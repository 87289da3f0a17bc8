"""Where the free runs of a report begin."""

from __future__ import annotations

from sysid.reporting.fit_records import CaseRecord
from sysid.reporting.parts import Part, Section
from sysid.reporting.results import Results
from sysid.reporting.sections.fit_tables import case_columns
from sysid.reporting.tables import Cell, Table

HOW = {
    "estimated": "The initial state of each free run is estimated on the first samples of its record, for each fit by "
    "itself; these are not scored.",
    "measured": "Each free run goes on from the first samples of its record, which were measured and are not scored.",
    "rest": "Each free run begins at rest: inputs held at their first sample, output at its declared rest value. Every "
    "sample is scored.",
    "first-sample": "Each free run begins where inputs and output have stood at their first sample. Every sample is "
    "scored.",
}
"""In words, by kind of start."""


def beginnings_section(results: Results) -> Section | None:
    """How each free run begins, and over which window its state was estimated.

    Args:
        results: Of the run.

    Returns:
        The section; ``None`` where the results say nothing of it.
    """
    kind = str((results.start or {}).get("kind", ""))
    if kind not in HOW:
        return None
    parts: list[Part] = [HOW[kind]]
    if any(case.begins_at for fit in results.fits for case in fit.cases.values()):
        parts.append(_windows(results))
    return Section(anchor="beginnings", title="How the free runs begin", parts=tuple(parts))


def _windows(results: Results) -> Table:
    columns = case_columns(results.fits)
    rows = [
        (
            Cell(text=fit.name, header=True),
            *(_window(fit.cases.get(name), results.data.sample_time) for name in columns),
        )
        for fit in results.fits
    ]
    return Table(
        caption="Samples at the beginning of each case that give the initial state and are not scored.",
        head=(("fit", ""), *((name, role.value) for name, role in columns.items())),
        rows=tuple(rows),
        note="Small figures: how long they are, and how many samples are scored.",
    )


def _window(case: CaseRecord | None, sample_time: float) -> Cell:
    if case is None:
        return Cell(text="none")
    below = f"{case.begins_at * sample_time:.4g} s; {case.n_samples} scored"
    return Cell(text=str(case.begins_at), value=float(case.begins_at), below=below, mark="number")
