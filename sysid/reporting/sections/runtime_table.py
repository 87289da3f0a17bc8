"""Run times of exported files in one table, beside their model's own compiled free run."""

from __future__ import annotations

from collections.abc import Sequence

from sysid.reporting.fit_records import ExportRecord, RunTimeRecord
from sysid.reporting.numbers import number
from sysid.reporting.results import Results
from sysid.reporting.tables import Cell, Table


def exported_run_times(results: Results) -> Table | None:
    """The table.

    Args:
        results: The results of a run.

    Returns:
        A row for each file and number of cars; ``None`` where none were measured.
    """
    return run_times_of([(fit.name, export) for fit in results.fits for export in fit.exports])


def run_times_of(exports: Sequence[tuple[str, ExportRecord]]) -> Table | None:
    """The table of some files.

    Args:
        exports: Each with the name of its model.

    Returns:
        A row for each file and number of cars; ``None`` where none were measured.
    """
    rows = [
        (
            Cell(text=export.format, header=True),
            Cell(text=name),
            Cell(text=export.file),
            Cell(text=str(one.cars), value=float(one.cars)),
            Cell(text=number(1e3 * one.seconds, digits=3), value=one.seconds),
            _own(one),
            Cell(text=number(one.ratio, digits=3), value=one.ratio),
        )
        for name, export in exports
        for one in export.run_times
    ]
    if not rows:
        return None
    return Table(
        caption="Run times of exported files for 20,000 samples, on one thread; the ratio is to the model's own "
        "compiled free run, measured in turn with it, for each car.",
        head=(
            ("format", ""),
            ("fit", ""),
            ("file", ""),
            ("cars", ""),
            ("run time", "ms"),
            ("own, a car", "ms"),
            ("ratio to own", ""),
        ),
        rows=tuple(rows),
    )


def _own(one: RunTimeRecord) -> Cell:
    """The model's own compiled free run of one car, as it was timed in turn with the file."""
    seconds = one.seconds / (one.ratio * one.cars)
    return Cell(text=number(1e3 * seconds, digits=3), value=seconds)
