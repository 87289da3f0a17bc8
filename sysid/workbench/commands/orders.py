"""``sysid orders``: which orders a data set asks for, of ARX models and of other structures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import yaml
from rich.table import Table

from sysid.api.fitting import load
from sysid.api.looking import mapping_of
from sysid.api.order_search import OrderSearch, SystemOrderSearch
from sysid.api.orders import search_orders
from sysid.api.vector_order_search import VectorOrderSearch
from sysid.estimation.linear.order_search import Criterion
from sysid.models import AbstractStructure
from sysid.names import slug
from sysid.reporting.figures.style import styled
from sysid.reporting.figures.svg import svg
from sysid.reporting.numbers import number, pole
from sysid.units import squared
from sysid.validation.metrics import percent
from sysid.validation.structure_search import KINDS, MOST, VECTOR_KIND
from sysid.workbench.commands.pictures import kept_picture
from sysid.workbench.runner.console import console

ROWS = 15
"""Structures that the table shows."""


def orders_command(
    source: str, *, mapping: str | None, ranges: dict[str, int | None], structures: str = "", most: int = MOST
) -> None:
    """Show which orders a data set asks for: a table on the screen, a picture beside."""
    traces = load(source)
    chosen = mapping_of(traces, mapping, option="--mapping ")
    kinds = [k.strip() for k in structures.split(",") if k.strip()]
    if structures.strip().lower() == "all":
        kinds = [*KINDS, *([VECTOR_KIND] if len(chosen.outputs) > 1 else [])]
    asked: dict[str, Any] = {**ranges, "structures": kinds, "most": most}
    found = search_orders(traces, chosen, **asked)
    several: list[tuple[str, OrderSearch | VectorOrderSearch]] = (
        [*found.outputs.items()] if isinstance(found, SystemOrderSearch) else [("", found)]
    )
    if isinstance(found, SystemOrderSearch) and found.together is not None:
        several.append(("together", found.together))
    for name, one in several:
        _show(one, f"{slug(traces.name)}.{slug(name)}" if name else slug(traces.name), most)


def _show(found: OrderSearch | VectorOrderSearch, stem: str, most: int) -> None:
    """The search of one output, its picture beside."""
    console().print(_table(found))
    for note in found.notes:
        console().print(f"note: {note}", soft_wrap=True)
    with styled():
        drawing = svg(found.plot(), title="Orders", description=f"Loss against size, {found.mapping}", name="orders")
    picture = kept_picture(Path(f"{stem}.orders.svg"), drawing)
    console().print(f"picture: {picture}", soft_wrap=True, markup=False)
    if found.states is not None:
        sizes = ", ".join(f"{size:.3f}" for size in found.states.correlations[: most + 3])
        console().print(f"canonical correlations of past and future: {sizes}: those that stand out are states")
    console().print(f"in a pipeline: structure: {_written(found.fit.model.structure)}", soft_wrap=True)


def _written(structure: AbstractStructure) -> str:
    """A structure as a pipeline has it, in one line."""
    own = {name: value for name, value in structure.to_dict().items() if value is not None}
    return yaml.safe_dump(own, default_flow_style=True, sort_keys=False, allow_unicode=True, width=1_000).strip()


def _table(found: OrderSearch | VectorOrderSearch) -> Table:
    others = "" if found.others is None else " and other structures"
    tried = "equations" if isinstance(found, VectorOrderSearch) else "ARX structures"
    title = f"{len(found):,} {tried}{others} of {found.mapping}, {found.chosen_by}"
    table = Table(title=title, title_justify="left")
    table.add_column("structure")
    for head in (
        "parameters",
        f"one-step mse [{squared(found.unit)}]",
        "AICc",
        "BIC",
        "free run, fit %",
        "largest pole",
    ):
        table.add_column(head, justify="right")
    for one in found.contenders[: ROWS if found.others is None else None]:
        aicc, bic = (found.score(one, criterion) for criterion in (Criterion.AICC, Criterion.BIC))
        table.add_row(
            one.fit.model.structure.label,
            str(one.fit.model.n_parameters),
            number(one.one_step_mse),
            f"{aicc:.1f}",
            f"{bic:.1f}",
            "diverges" if one.mean_fit == -math.inf else percent(one.mean_fit),
            pole(one.pole_radius),
        )
    return table
