"""Which orders the data ask for, as a step of a pipeline: the search of ``sysid orders``, kept for the report."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

from pydantic import BaseModel, Field

from sysid.code_digest import code_digest
from sysid.estimation.linear.order_search import Criterion
from sysid.validation.structure_search import MOST
from sysid.workbench.old_words import STRICT
from sysid.workbench.runner.store import digest

if TYPE_CHECKING:
    from sysid.api.order_search import OrderSearch
    from sysid.api.vector_order_search import VectorOrderSearch
    from sysid.workbench.fits.config import PipelineConfig
    from sysid.workbench.fits.data import Data

ROWS = 15
"""Structures that are kept for the table."""

FREE_RUN: Final = "free run"


class OrdersConfig(BaseModel):
    """A search over the orders of ARX models, and of other structures, told in the report; it decides nothing.

    Args:
        max_na: Largest number of past outputs; by default as many as record and inputs allow, ten at most.
        max_nb: Largest number of past values of each input, likewise.
        max_nk: Largest dead time, likewise.
        criterion: What names the best: the free run over the traces that choose, or one of ``AIC``, ``AICc``, ``BIC``
            and ``loss``, which choose among the ARX models.
        structures: Kinds beside ARX that are fitted with orders from 1 on: ``SS``, ``TF``, ``OE``, ``ARMAX``, ``BJ``;
            and ``VectorARX``, one model of several outputs.
        most: Largest order of those.
    """

    model_config = STRICT

    max_na: int | None = Field(default=None, ge=0)
    max_nb: int | None = Field(default=None, ge=0)
    max_nk: int | None = Field(default=None, ge=0)
    criterion: Literal["free run", "AIC", "AICc", "BIC", "loss"] = FREE_RUN
    structures: tuple[Literal["ARX", "SS", "TF", "OE", "ARMAX", "BJ", "VectorARX"], ...] = ()
    most: int = Field(default=MOST, ge=1, le=20)


def orders_key(config: PipelineConfig, data: Data) -> str:
    """Digest of everything that the search depends on.

    Args:
        config: The pipeline, with ``orders``.
        data: The traces.

    Returns:
        64 hexadecimal digits.
    """
    terms = {
        "orders": None if config.orders is None else config.orders.model_dump(mode="json"),
        "mapping": str(config.mapping),
        "start": {"kind": config.start.kind.value, "n_measured": config.start.n_measured},
        "traces": [trace.digest for trace in data.estimation],
        "selection": [trace.digest for trace in data.selection],
        "code": code_digest("sysid.api.orders:search_orders", "sysid.workbench.fits.orders:search"),
    }
    return digest(terms)


def search(config: PipelineConfig, data: Data) -> list[dict[str, Any]]:
    """Search the orders of every output.

    Args:
        config: The pipeline, with ``orders``.
        data: The traces.

    Returns:
        For each output, and for one model of all where it was asked for, what results.json keeps of it, as JSON values.
    """
    from sysid.api.order_search import SystemOrderSearch
    from sysid.api.orders import search_orders

    asked = config.orders or OrdersConfig()
    ranges = {name: getattr(asked, name) for name in ("max_na", "max_nb", "max_nk", "structures", "most")}
    criterion = None if asked.criterion == FREE_RUN else asked.criterion
    found = search_orders(
        data.traces, config.mapping, **ranges, start=config.start, selection=data.selection, workers=1
    )
    if isinstance(found, SystemOrderSearch):
        together = [] if found.together is None else [_record(found.together, criterion)]
        return [*(_record(one, criterion) for one in found.outputs.values()), *together]
    return [_record(found, criterion)]


def _record(found: OrderSearch | VectorOrderSearch, criterion: str | None) -> dict[str, Any]:
    best = found.fit.model.structure if criterion is None else found.best(criterion)
    return {
        "mapping": str(found.mapping),
        "unit": found.unit,
        "best": best.to_dict(),
        "label": best.label,
        "chosen_by": found.chosen_by if criterion is None else f"least {criterion}",
        "notes": list(found.notes),
        "correlations": [] if found.states is None else found.states.correlations[: found.states.most + 3].tolist(),
        "curve": dataclasses.asdict(found.curve),
        "rows": [
            {
                "label": one.fit.model.structure.label,
                "n_parameters": one.fit.model.n_parameters,
                "one_step_mse": one.one_step_mse,
                "aicc": found.score(one, Criterion.AICC),
                "bic": found.score(one, Criterion.BIC),
                "free_run_fit": one.mean_fit if math.isfinite(one.mean_fit) else None,
                "pole_radius": one.pole_radius if math.isfinite(one.pole_radius) else None,
            }
            for one in found.contenders[: ROWS if found.others is None else None]
        ],
    }


def said(found: Sequence[dict[str, Any]]) -> str:
    """How a search came out, in a line."""
    return ", ".join(f"{one['mapping']}: {one['label']}" for one in found)
