"""Which orders the data ask for: the table and the picture of a search."""

from __future__ import annotations

from sysid.reporting.figures.order_figure import OrderCurve, order_figure, states_figure
from sysid.reporting.numbers import pole
from sysid.reporting.parts import Part, Section, picture
from sysid.reporting.results import OrdersRecord, Results
from sysid.reporting.tables import DIVERGED, Cell, Table, figure_cell
from sysid.units import squared


def orders_section(results: Results) -> Section | None:
    """What a search of the orders found, output by output.

    Args:
        results: The run.

    Returns:
        The section; ``None`` where nothing was searched.
    """
    if not results.orders:
        return None
    parts: list[Part] = []
    for index, found in enumerate(results.orders):
        parts.append(f"{found.mapping}: {found.label}, {found.chosen_by}. {' '.join(found.notes)}".strip())
        parts += [_picture(found, index)]
        parts += [_states(found, index)] if found.correlations else []
        parts += [_table(found)]
    return Section(anchor="orders", title="Which orders the data ask for", parts=tuple(parts))


def _picture(found: OrdersRecord, index: int) -> Part:
    curve = OrderCurve(
        candidates=found.curve.candidates,
        sizes=tuple(found.curve.sizes),
        lowest=tuple(found.curve.lowest),
        highest=tuple(found.curve.highest),
        choices=tuple(found.curve.choices),
    )
    caption = (
        f"{found.mapping}: one-step error on the estimation traces of every ARX model, by size. Where the line no "
        "longer falls, more parameters say nothing more."
    )
    return picture(order_figure(curve, unit=found.unit), f"Orders of {found.mapping}", caption, f"orders-{index}")


def _states(found: OrdersRecord, index: int) -> Part:
    caption = (
        f"{found.mapping}: canonical correlations of past and future. Each that stands out above the rest is a "
        "state that the record shows."
    )
    return picture(states_figure(found.correlations), f"States of {found.mapping}", caption, f"states-{index}")


def _table(found: OrdersRecord) -> Table:
    rows = tuple(
        (
            Cell(text=row.label, header=True, mark="best" if row.label == found.label else ""),
            Cell(text=str(row.n_parameters), value=row.n_parameters, mark="number"),
            figure_cell(row.one_step_mse),
            figure_cell(row.aicc, digits=6),
            figure_cell(row.bic, digits=6),
            figure_cell(row.free_run_fit, digits=4, missing=DIVERGED),
            Cell(text=pole(row.pole_radius), value=row.pole_radius, mark="number"),
        )
        for row in found.rows
    )
    return Table(
        caption=f"Structures in free run, {found.mapping}: {found.chosen_by}.",
        head=(
            ("structure", ""),
            ("parameters", ""),
            ("one-step mse", squared(found.unit)),
            ("AICc", ""),
            ("BIC", ""),
            ("free run, fit", "%"),
            ("largest pole", ""),
        ),
        rows=rows,
    )
