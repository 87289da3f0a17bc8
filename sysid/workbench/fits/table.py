"""The fits of a run as a table on the screen."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from sysid.reporting.results import FitRecord, Results


def table_of_fits(results: Results) -> Table:
    """The fits by case: mean squared error of the free run.

    Args:
        results: What the run found.

    Returns:
        The table.
    """
    units = {fit.unit for fit in results.fits}
    unit = f"{units.pop()}²" if len(units) == 1 else "each output's unit, squared"
    # Shown in one power of ten, as publications print them, so that columns compare at a glance.
    table = Table(title=f"Free run, mean squared error in {unit}", title_justify="left", header_style="bold")
    table.add_column("fit")
    table.add_column("structure")
    table.add_column("loop")
    cases = list(results.data.cases)
    for case in cases:
        table.add_column(Text.assemble(f"{case}\n", (results.data.cases[case].role.value, "dim")), justify="right")
    if results.selection:
        table.add_column("selection", justify="right")
    table.add_column("training", justify="right")
    for fit in results.fits:
        best = results.chosen(fit)
        table.add_row(*_row(fit, cases, selection=bool(results.selection)), style="bold" if best else None)
    return table


def _row(fit: FitRecord, cases: list[str], *, selection: bool) -> list[str]:
    figures = [f"{fit.cases[case].free_run.mse:.3e}" for case in cases]
    chosen = [f"{fit.selection_mse:.3e}"] if selection else []
    return [fit.name, fit.label, fit.loop.value, *figures, *chosen, f"{fit.train_time_s:.1f} s"]
