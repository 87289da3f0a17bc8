"""``sysid orders``: which ARX orders a data set asks for."""

from __future__ import annotations

import math
from pathlib import Path

from rich.table import Table

from sysid.api.fitting import load
from sysid.api.looking import mapping_of
from sysid.api.orders import OrderSearch, search_orders
from sysid.estimation.linear.order_search import Criterion
from sysid.names import slug
from sysid.reporting.figures.style import styled
from sysid.reporting.figures.svg import svg
from sysid.reporting.numbers import number
from sysid.validation.metrics import percent
from sysid.workbench.runner.console import console
from sysid.workbench.runner.naming import nearby
from sysid.workbench.runner.store import write_bytes

ROWS = 15
"""Structures that the table shows."""


def orders_command(
    source: str, *, mapping: str | None, max_na: int | None, max_nb: int | None, max_nk: int | None
) -> None:
    """Show which orders a data set asks for: a table on the screen, a picture beside.

    Args:
        source: A data set's name or path, or a file with traces.
        mapping: Inputs and output; needed where the data set has more than two channels.
        max_na: Largest number of past outputs.
        max_nb: Largest number of past values of each input.
        max_nk: Largest dead time.

    Raises:
        UserError: If the data cannot be read, or the mapping is missing or wrong.
    """
    traces = load(source)
    chosen = mapping_of(traces, mapping)
    found = search_orders(traces, chosen, max_na=max_na, max_nb=max_nb, max_nk=max_nk)
    console().print(_table(found))
    for note in found.notes:
        console().print(f"note: {note}", soft_wrap=True)
    with styled():
        drawing = svg(found.plot(), title="Orders", description=f"Loss against size, {chosen}", name="orders")
    picture = Path(f"{slug(traces.name)}.orders.svg")
    write_bytes(picture, drawing.encode())
    console().print(f"picture: {nearby(picture)}", soft_wrap=True)
    best = found.best()
    nb, nk = list(best.nb), list(best.nk)
    console().print(f"in a pipeline: structure: {{kind: ARX, na: {best.na}, nb: {nb}, nk: {nk}}}", soft_wrap=True)


def _table(found: OrderSearch) -> Table:
    title = f"{len(found.losses):,} structures of {found.mapping}, {found.chosen_by}"
    table = Table(title=title, title_justify="left")
    table.add_column("structure")
    for head in ("parameters", f"one-step mse [{found.unit}²]", "AICc", "BIC", "free run, fit %"):
        table.add_column(head, justify="right")
    for one in found.finalists[:ROWS]:
        aicc, bic = (found.score(one, criterion) for criterion in (Criterion.AICC, Criterion.BIC))
        table.add_row(
            one.fit.model.structure.label,
            str(one.fit.model.n_parameters),
            number(one.one_step_mse),
            f"{aicc:.1f}",
            f"{bic:.1f}",
            "diverges" if one.mean_fit == -math.inf else percent(one.mean_fit),
        )
    return table
