"""Models of several outputs from the equations of each: the second half of a search for the orders of a VectorARX."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence

import numpy as np

from sysid.estimation.linear.order_search import Criterion, OrderLosses
from sysid.estimation.linear.vector_arx import fit_vector_arx
from sysid.models import ARX, Mapping, Start, VectorARX
from sysid.traces import Trace
from sysid.validation.order_finalists import Finalist, finalist_of

PENALTIES = np.geomspace(0.5, 64.0, 22)
"""What a parameter costs, as a multiple of that of BIC: from the largest equations to the smallest."""


def joined(equations: Sequence[ARX], inputs: int) -> VectorARX:
    """One structure of the equation of each output.

    Args:
        equations: Of each output, in their order: what it reads of the inputs, then of the other outputs.
        inputs: How many inputs there are.

    Returns:
        The structure.
    """
    past = []
    for i, one in enumerate(equations):
        others = list(one.nb[inputs:])
        past.append([*others[:i], one.na, *others[i:]])
    return VectorARX(
        na=past,  # type: ignore[arg-type]  # rows, as they are written
        nb=[one.nb[:inputs] for one in equations],  # type: ignore[arg-type]
        nk=[one.nk[:inputs] for one in equations],  # type: ignore[arg-type]
        intercept=all(one.intercept for one in equations),
    )


def structures_of(losses: Dict[str, OrderLosses], inputs: int) -> list[VectorARX]:
    """Structures worth a free run: at each price of a parameter every output's best equation, and with none crossing.

    Args:
        losses: By output: its equations.
        inputs: How many inputs there are.

    Returns:
        Each once.
    """
    found: dict[str, VectorARX] = {}

    def add(equations: Sequence[ARX]) -> None:
        one = joined(equations, inputs)
        found.setdefault(one.label, one)

    for criterion in (Criterion.BIC, Criterion.AICC, Criterion.AIC):
        add([one.best(criterion) for one in losses.values()])
    for price in PENALTIES:
        for alone in (False, True):
            add([_best(one, float(price), inputs, alone=alone) for one in losses.values()])
    return list(found.values())


def _best(losses: OrderLosses, price: float, inputs: int, *, alone: bool) -> ARX:
    """The equation of least error and price; of those that read no other output where it is alone."""
    n = losses.n_samples
    fit = n * np.log(np.maximum(np.maximum(losses.mse, losses.rounding), np.finfo(np.float64).tiny))
    total = fit + price * np.log(n) * losses.n_parameters
    if alone:
        total = np.where(losses.nb[:, inputs:].any(axis=1), np.inf, total)
    return losses.orders(int(np.argmin(total)))


def run_vector_structures(
    structures: Sequence[VectorARX],
    traces: Sequence[Trace],
    mapping: Mapping,
    cases: Sequence[Trace],
    *,
    start: Start,
) -> tuple[Finalist, ...]:
    """Fit each structure and run it freely over every case.

    Args:
        structures: Which.
        traces: Estimation traces, those of the search.
        mapping: Which channels go in, which come out.
        cases: What chooses.
        start: How each free run begins.

    Returns:
        The candidates, best mean fit first.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
    """
    found = []
    for one in structures:
        fit = fit_vector_arx(traces, mapping, one, start=start)
        found.append(finalist_of(fit, cases, start, float(fit.history["mse"][-1])))
    return tuple(sorted(found, key=lambda entry: -entry.mean_fit))
