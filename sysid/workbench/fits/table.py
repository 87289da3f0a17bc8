"""The fits of a run as a table on the screen."""

from __future__ import annotations

from statistics import median

from rich.table import Table
from rich.text import Text

from sysid.estimation.results.result import Status
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.results import Results, SystemRecord
from sysid.reporting.sections.fit_tables import scored_cases
from sysid.units import squared
from sysid.validation.metrics import mean_fit, percent

MOST = 6
"""Cases that have a column of their own. Of more each role has one, with their median: the report has them all."""


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
    cases, columns = list(results.data.cases), _columns(results)
    for head, _ in columns:
        table.add_column(head, justify="right")
    # One trace that chooses, and is a case too, has its figure already.
    selection = results.selection is not None and not (
        len(results.selection.cases) == 1 and {*results.selection.cases} <= {*cases}
    )
    if selection:
        table.add_column("selection\nmean", justify="right")
    whole_after = {list(one.fits.values())[-1]: one for one in results.systems}
    if not results.systems:
        table.add_column(f"fit\n{_judged(results)}", justify="right")
    table.add_column("training", justify="right")
    for fit in results.fits:
        best = results.chosen(fit)
        fitted = [] if results.systems else [_mean_fit(fit)]
        row = _row(fit, columns, fitted, selection=selection)
        table.add_row(*row, style="bold" if best else None)
        whole = whole_after.get(fit.name)
        if whole is not None:
            row = _whole(whole, fit, columns, selection=selection)
            table.add_row(*row, style="bold" if best else None, end_section=True)
    return table


Columns = list[tuple[Text, list[str]]]
"""Heads, and the cases whose median each holds."""


def _columns(results: Results) -> Columns:
    cases = results.data.cases
    if len(cases) <= MOST:
        return [(Text.assemble(f"{name}\n", (one.role.value, "dim")), [name]) for name, one in cases.items()]
    by_role = dict[str, list[str]]()
    for name, one in cases.items():
        by_role.setdefault(one.role.value, []).append(name)
    return [
        (Text.assemble(f"median of {len(names)}\n" if len(names) > 1 else f"{names[0]}\n", (role, "dim")), names)
        for role, names in by_role.items()
    ]


def _judged(results: Results) -> str:
    """What the fit in percent is of: cases that neither were fitted nor chose, or else all."""
    return "unseen" if any(scored_cases(fit) for fit in results.fits) else "all"


def _mean_fit(fit: FitRecord) -> str:
    judged = scored_cases(fit) or fit.cases
    return f"{percent(mean_fit(case.free_run.nrmse_fit for case in judged.values()))} %"


def told_of_fits(results: Results, *, in_full: bool = False) -> list[str]:
    """What is to be looked at before a figure is believed: of each fit how it ended, where it is of no use, and why.

    Args:
        results: What the run found.
        in_full: Whether all of it is said, as where no report is written.

    Returns:
        A line for each thing to say, of one fit or of several alike; the report has the rest.
    """
    alike = dict[str, list[str]]()
    for fit in results.fits:
        ended = Status[fit.status]
        told = [*([ended.value] if not ended.usable else []), *fit.warnings]
        more = f" ({len(told) - 1} more in the report)" if len(told) > 1 and not in_full else ""
        for one in told if in_full else told[:1]:
            alike.setdefault(f"{one}{more}", []).append(fit.name)
    return [f"Look at {'; '.join(names)}: {one}" for one, names in alike.items()]


def _whole(whole: SystemRecord, last: FitRecord, columns: Columns, *, selection: bool) -> list[str]:
    figures = [f"{median(whole.cases[case].mean_fit for case in cases):.2f} %" for _, cases in columns]
    chosen = [""] if selection else []
    return [whole.name, whole.label, last.loop.value, *figures, *chosen, f"{whole.train_time_s:.1f} s"]


def _row(fit: FitRecord, columns: Columns, fitted: list[str], *, selection: bool) -> list[str]:
    figures = [f"{median(fit.cases[case].free_run.mse for case in cases):.3e}" for _, cases in columns]
    chosen = [f"{fit.selection_mse:.3e}"] if selection else []
    return [fit.name, fit.label, fit.loop.value, *figures, *chosen, *fitted, f"{fit.train_time_s:.1f} s"]
