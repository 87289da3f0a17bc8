"""The parameters of equations and of process models as a table: values with intervals, by case where they differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid.estimation import FitResult
from sysid.estimation.results.uncertainty import Uncertainty
from sysid.models import AbstractModel, FittedProcess
from sysid.models.grey_box.grey_box_model import EquationModel
from sysid.reporting.fit_records import FitRecord
from sysid.reporting.numbers import number
from sysid.reporting.tables import Cell, Table, figure_cell

LEVEL = 0.95
DIGITS = 5


def parameter_tables(fit: FitRecord, stored: FitResult) -> list[Table]:
    """The parameters of one fit of equations, and what was found of cases that were not fitted.

    Args:
        fit: As results.json has it.
        stored: The fit.

    Returns:
        The tables; none where nothing with a name was estimated.
    """
    known = stored.uncertainty
    if known is None or not known.names:
        return []
    found = stored.model
    tables = [_table(fit.name, _labelled(known, found), "of its equations" if isinstance(found, EquationModel) else "")]
    if isinstance(found, EquationModel) and found.case_values is not None:
        fitted = found.case_values
        rows = tuple(
            (Cell(text=name, header=True), *(figure_cell(case.constants[one], digits=DIGITS) for one in fitted.names))
            for name, case in fit.cases.items()
            if case.constants and fitted.row(name) is None
        )
        if rows:
            note = "Each from the samples of its record before the first that is scored."
            tables.append(_of_others(fit.name, fitted.names, rows, note))
    return tables


def _of_others(name: str, names: Sequence[str], rows: tuple[tuple[Cell, ...], ...], note: str) -> Table:
    return Table(
        caption=f"{name}: parameters by case of records of cases that were not fitted.",
        head=(("case", ""), *((one, "") for one in names)),
        rows=rows,
        note=note,
    )


def _labelled(known: Uncertainty, model: AbstractModel) -> Uncertainty:
    """The same with each parameter's unit behind its name, which those of equations have already."""
    if not isinstance(model, FittedProcess):
        return known
    units = model.units
    return replace(known, names=tuple(one if units[one] == "1" else f"{one} [{units[one]}]" for one in known.names))


def _table(name: str, known: Uncertainty, of: str) -> Table:
    deviations, ends = known.standard_deviations, known.interval(LEVEL)
    profiled = known.profile is not None
    rows = []
    for i, label in enumerate(known.names):
        cells = [
            Cell(text=label, header=True),
            figure_cell(float(known.values[i]), digits=DIGITS),
            figure_cell(float(deviations[i]), missing="none"),
            Cell(text="none" if np.isnan(deviations[i]) else _between(*ends[i])),
        ]
        if known.profile is not None:
            cells.append(Cell(text=_between(*known.profile[i])))
        rows.append(tuple(cells))
    head = [("parameter", "unit"), ("value", ""), ("deviation", "standard"), ("95 % interval", "from the curvature")]
    return Table(
        caption=f"{name}: parameters{' ' * bool(of)}{of}.",
        head=(*head, *([("95 % interval", "by profile likelihood")] if profiled else [])),
        rows=tuple(rows),
        note="From the curvature at the minimum: short where the run is far from linear in a parameter, and none at a "
        "bound or where the records leave one open; the notes of the fit say which."
        + " By profile likelihood: as far as the others, fitted again, keep the error within what noise allows."
        * profiled,
    )


def _between(low: float, high: float) -> str:
    return f"{number(float(low), digits=DIGITS)} to {number(float(high), digits=DIGITS)}"
