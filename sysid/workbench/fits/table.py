"""The fits of a run as a table on the screen."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from sysid.estimation.result import Status
from sysid.reporting.results import FitRecord, Results, SystemRecord
from sysid.units import squared


def table_of_fits(results: Results) -> Table:
    """The fits by case: mean squared error of the free run.

    Args:
        results: What the run found.

    Returns:
        The table.
    """
    units = {fit.unit for fit in results.fits}
    unit = squared(units.pop()) if len(units) == 1 else "each output's unit, squared"
    # Shown in one power of ten, as publications print them, so that columns compare at a glance.
    title = (
        "Free run, mean squared error"
        + (f" in {unit}" if unit != "1" else "")
        + ("; of a whole, its outputs' mean fit" if results.systems else "")
    )
    table = Table(title=title, title_justify="left", header_style="bold")
    table.add_column("fit")
    table.add_column("structure")
    table.add_column("loop")
    cases = list(results.data.cases)
    for case in cases:
        table.add_column(Text.assemble(f"{case}\n", (results.data.cases[case].role.value, "dim")), justify="right")
    if results.selection:
        table.add_column("selection", justify="right")
    table.add_column("training", justify="right")
    whole_after = {list(one.fits.values())[-1]: one for one in results.systems}
    for fit in results.fits:
        best = results.chosen(fit)
        table.add_row(*_row(fit, cases, selection=bool(results.selection)), style="bold" if best else None)
        whole = whole_after.get(fit.name)
        if whole is not None:
            row = _whole(whole, fit, cases, selection=bool(results.selection))
            table.add_row(*row, style="bold" if best else None, end_section=True)
    return table


def told_of_fits(results: Results) -> list[str]:
    """What is to be looked at before a figure is believed: of each fit how it ended, where it is of no use, and why.

    Args:
        results: What the run found.

    Returns:
        A line for each fit of which there is something to say; the report has the rest.
    """
    lines = []
    for fit in results.fits:
        ended = Status[fit.status]
        told = [*([ended.value] if not ended.usable else []), *fit.warnings]
        more = f" ({len(told) - 1} more in the report)" if len(told) > 1 else ""
        lines += [f"Look at {fit.name}: {one}{more}" for one in told[:1]]
    return lines


def _whole(whole: SystemRecord, last: FitRecord, cases: list[str], *, selection: bool) -> list[str]:
    figures = [f"{whole.cases[case].mean_fit:.2f} %" for case in cases]
    chosen = [""] if selection else []
    return [whole.name, whole.label, last.loop.value, *figures, *chosen, f"{whole.train_time_s:.1f} s"]


def _row(fit: FitRecord, cases: list[str], *, selection: bool) -> list[str]:
    figures = [f"{fit.cases[case].free_run.mse:.3e}" for case in cases]
    chosen = [f"{fit.selection_mse:.3e}"] if selection else []
    return [fit.name, fit.label, fit.loop.value, *figures, *chosen, f"{fit.train_time_s:.1f} s"]
