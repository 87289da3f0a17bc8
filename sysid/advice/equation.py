"""What an equation with past outputs says of a record: where a response to past inputs alone says too little.

A response over some lags cannot say what rings or lasts for longer than these, and of a plant that runs away by itself,
and is held by a controller, it says what the loop does. One step ahead least squares tells either from few
coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import UserError
from sysid.estimation.linear.arx import fit_arx
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import Criterion, search_orders
from sysid.estimation.remarks.fitted_run import FreeRun
from sysid.models import ARX, ARXModel, Mapping, Start, StartKind
from sysid.traces import Trace

MOST_ORDER, MOST_CANDIDATES = 8, 60_000
BEYOND, FOLDS = 4.0, 10.0
"""By how many standard deviations, and how many times e-fold over the record, a pole must grow to be said to."""
FROM_START = Start(kind=StartKind.ESTIMATED)


@dataclass(frozen=True, kw_only=True)
class Equation:
    """The ARX model of least BIC.

    Args:
        structure: Of the inputs that move.
        order: The largest that was tried.
        explained: Share of the output's variance that its free run explains; not above 1, and below 0 where it is lost.
        pole: The one furthest from the centre.
        grows: Whether that lies outside the unit circle for sure.
    """

    structure: ARX
    order: int
    explained: float
    pole: complex
    grows: bool


def least_bic(traces: Sequence[Trace], mapping: Mapping, dead: Sequence[int], *, at_once: bool) -> Equation | None:
    """The ARX model of least BIC, its dead times near those of the impulse response.

    Args:
        traces: The records.
        mapping: Inputs that move, and the output.
        dead: Likely dead times, in samples.
        at_once: Whether a controller acts within the sample, so that an input of the same sample says nothing.

    Returns:
        The equation; ``None`` where the records are too short for any.
    """
    # The grid has the same range of dead times for each input: what they have in common is taken off the inputs.
    first = int(at_once)
    low = max(min(dead, default=0) - 1, first)
    spread = min(max(dead, default=0) + 1 - low, 4) if dead else 0
    near = _search(traces, mapping, low, spread)
    # A response that is small at first, as of what adds up twice, is taken for a dead time, and a wrong one for poles
    # that grow.
    early = _search(traces, mapping, first, 1) if low > first + 1 else None
    found = min((one for one in (near, early) if one is not None), key=lambda one: one[0], default=None)
    if found is None:
        return None
    _, best, order = found
    try:
        fit = fit_arx(traces, mapping, best, start=FROM_START)
    except UserError:
        return None
    model, known = fit.model, fit.uncertainty
    assert isinstance(model, ARXModel)  # noqa: S101 - that is what was asked for
    pole, deviation = (0j, 0.0) if known is None else _outermost(model, known.covariance)
    beyond = abs(pole) - 1.0
    grows = beyond > BEYOND * deviation and beyond * _samples(traces) > FOLDS
    return Equation(structure=best, order=order, explained=_explained(model, traces), pole=pole, grows=grows)


def _samples(traces: Sequence[Trace]) -> int:
    return sum(int(trace.usable_samples.sum()) for trace in traces)


def _search(traces: Sequence[Trace], mapping: Mapping, low: int, spread: int) -> tuple[float, ARX, int] | None:
    """The criterion for each sample, the structure, and the largest order that was tried; or that none can be."""
    m, samples = len(mapping.inputs), _samples(traces)
    for order in range(MOST_ORDER, 0, -1):
        grid = OrderGrid(max_na=order, max_nb=order, max_nk=low + spread, min_nk=low)
        if 4 * (order + m * (order + low + spread) + 1) > samples or grid.size(m) > MOST_CANDIDATES:
            continue
        try:
            found = search_orders(traces, mapping, grid, start=FROM_START, workers=1)
        except UserError:
            return None
        best = int(np.argmin(found.score(Criterion.BIC)))
        return float(found.score(Criterion.BIC)[best]) / found.n_samples, found.orders(best), order
    return None


def _outermost(model: ARXModel, covariance: NDArray[np.float64]) -> tuple[complex, float]:
    """The pole furthest from the centre, and the standard deviation of how far that is, to first order."""
    n, poles = model.orders.na, model.poles
    if not n:
        return 0j, 0.0
    z = complex(poles[np.argmax(np.abs(poles))])
    last = len(model.coefficients) - n
    slope = complex(np.polyval(np.polyder(np.poly(poles)), z)) or 1e-300
    moves = np.real(np.conj(z) / max(abs(z), 1e-300) * z ** np.arange(n - 1, -1, -1) / slope)
    return z, float(np.sqrt(max(moves @ covariance[last : last + n, last : last + n] @ moves, 0.0)))


def _explained(model: ARXModel, traces: Sequence[Trace]) -> float:
    runs = [FreeRun.of(model, trace, FROM_START) for trace in traces]
    left = total = 0.0
    for run in runs:
        y, error = (x[run.usable, 0] for x in (run.output, run.output - run.simulated))
        if len(y) > 1:
            with np.errstate(over="ignore", invalid="ignore"):
                left, total = (
                    left + float(np.sum((error - error.mean()) ** 2)),
                    total + float(np.sum((y - y.mean()) ** 2)),
                )
    share = 1.0 - left / total if total > 0.0 else 0.0
    return share if np.isfinite(share) else -np.inf
