"""Our figures with the published ones beside them."""

from __future__ import annotations

import math

from sysid.reporting.fit_records import CaseRecord, FitRecord, PublishedRecord
from sysid.reporting.published.tables import PublishedTable
from sysid.reporting.results import Results

KINDS = ("free_run", "one_step", "run_time")
"""Which figures are compared: mse of the free run, mse of one step ahead, and run time of the free run."""


def with_published(results: Results, table: PublishedTable | None) -> Results:
    """The results with ``published`` filled in for every case that has a yardstick.

    Args:
        results: The results.
        table: The published figures; without it nothing is compared.

    Returns:
        A copy.
    """
    if table is None:
        return results
    fits = [
        fit.model_copy(
            update={
                "cases": {
                    name: case.model_copy(update={"published": _compare(table, fit, name, case) or None})
                    for name, case in fit.cases.items()
                }
            }
        )
        for fit in results.fits
    ]
    return results.model_copy(update={"fits": fits})


def _compare(table: PublishedTable, fit: FitRecord, name: str, case: CaseRecord) -> dict[str, PublishedRecord]:
    squared = f"{case.free_run.unit}^2"
    questions = {
        "free_run": (case.free_run.mse, "mse", "free_run", squared),
        "one_step": (case.one_step.mse, "mse", "one_step", squared),
        "run_time": (case.run_time_s, "run_time", "free_run", "s"),
    }
    found = {}
    for kind, (ours, quantity, run, unit) in questions.items():
        figure = table.find(mapping=fit.mapping, quantity=quantity, run=run, case=name, unit=unit)
        if figure is not None:
            found[kind] = PublishedRecord(
                value=figure.value,
                unit=figure.unit,
                source=figure.source,
                label=figure.label,
                ratio=ours / figure.value if figure.value > 0.0 else math.nan,
            )
    return found
