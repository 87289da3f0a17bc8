"""ARX models that least squares has bent to noise on the output: the same orders by instruments run freely much nearer.

Least squares one step ahead takes the noise for one that has the plant's poles. Noise of a sensor has none, and pulls
them towards a plant that forgets sooner, the more the slower it is against the samples (Ljung 1999, section 7.6). The
error that this leaves in the free run moves with the inputs, so that it looks like a lag or a curve left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sysid.errors import UserError
from sysid.estimation.linear.instrumental import fit_iv4
from sysid.estimation.linear.vector_arx import by_instruments, fit_vector_arx
from sysid.estimation.remarks.fitted_run import MOST_SAMPLES, FreeRun
from sysid.models import ARX, AbstractModel, ARXModel, Start, VectorARX, VectorARXModel
from sysid.traces import Trace

WORTH, LESS = 0.03, 0.7
"""Part of the output's standard deviation that an error must have to be worth it, and part of its square that the other
estimate leaves at most. Of a plant as slow as its record little of it shows there: a gain that is wrong by a third left
4 %, which a constant made up for."""
LEAST_SAMPLES = 100
MOST_FEWER = 3
"""Poles less that are tried as well: those that the plant has not are cancelled by nothing that instruments show."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Unbent:
    """The estimate by instruments that a model is held beside.

    Args:
        told: What is said of the model.
        model: The estimate.
        runs: Its free runs over the records.
    """

    told: str
    model: AbstractModel
    runs: tuple[FreeRun, ...]


def bent_by_noise(
    model: AbstractModel, traces: Sequence[Trace], runs: Sequence[FreeRun], start: Start
) -> Unbent | None:
    """Whether an ARX model stands where noise on the output has pulled it.

    Args:
        model: The fitted model.
        traces: The records that were fitted; of long ones the beginning is looked at.
        runs: Its free runs over them.
        start: What stands before each.

    Returns:
        The better estimate, of whose error causes are to be asked; ``None`` where there is none.
    """
    if not isinstance(model, ARXModel | VectorARXModel) or not model.mapping.inputs:
        return None
    y = np.concatenate([run.output[run.usable] for run in runs])
    own = _error(runs)
    if len(y) < LEAST_SAMPLES or not np.sqrt(own) > WORTH:
        return None
    seen = [trace[: run.first + MOST_SAMPLES] for trace, run in zip(traces, runs, strict=True)]
    tried = [one for orders in _smaller(model.orders) if (one := _by_instruments(model, orders, seen, start))]
    other, free = min(tried, key=lambda one: _error(one[1]), default=(model, tuple(runs)))
    if not _error(free) < LESS * own:
        return None
    fits = [" and ".join(f"{100.0 * (1.0 - np.sqrt(each)):.0f} %" for each in _errors(some)) for some in (runs, free)]
    return Unbent(
        told="Least squares one step ahead has bent this model: over the records that were fitted its free run has a "
        f"fit of {fits[0]}, and that of {other.label} by instruments, which noise does not bend, {fits[1]}. It takes "
        "all that the model leaves for noise with the plant's poles, which that of a sensor is not. Fit what does not: "
        "OE, TF or a state space (SS), or BJ and ARMAX, whose noise has terms of its own.",
        model=other,
        runs=free,
    )


def _smaller(orders: ARX | VectorARX) -> list[ARX | VectorARX]:
    """The orders, and those with some poles less, and as many coefficients of each input at most."""
    if isinstance(orders, VectorARX):
        most = max(max(row) for row in orders.na)
        return [_fewer(orders, most - k) if k else orders for k in range(MOST_FEWER + 1) if most - k > 0]
    fewer = [orders.na - k for k in range(MOST_FEWER + 1) if orders.na - k > 0]
    return [replace(orders, na=na, nb=tuple(min(nb, na) if na < orders.na else nb for nb in orders.nb)) for na in fewer]


def _fewer(orders: VectorARX, most: int) -> VectorARX:
    na, nb = (tuple(tuple(min(n, most) for n in row) for row in rows) for rows in (orders.na, orders.nb))
    return replace(orders, na=na, nb=nb)


def _by_instruments(
    model: ARXModel | VectorARXModel, orders: ARX | VectorARX, traces: Sequence[Trace], start: Start
) -> tuple[AbstractModel, tuple[FreeRun, ...]] | None:
    """The estimate by instruments, and its free runs; ``None`` where there is none, or it is lost."""
    try:
        found = _estimate(model, orders, traces, start)
        runs = tuple(FreeRun.of(found, trace, start) for trace in traces)
    except (UserError, np.linalg.LinAlgError):
        return None
    return (found, runs) if np.isfinite(_error(runs)) else None


def _estimate(
    model: ARXModel | VectorARXModel, orders: ARX | VectorARX, traces: Sequence[Trace], start: Start
) -> AbstractModel:
    if isinstance(orders, VectorARX):
        rests = dict(zip(model.mapping.outputs, model.ends.rest_outputs, strict=True))
        begun = fit_vector_arx(traces, model.mapping, orders, start=start, rest_output=rests).model
        return by_instruments(traces, cast("VectorARXModel", begun), start)
    return fit_iv4(traces, model.mapping, orders, start=start, rest_output=model.rest_output).model


def _errors(runs: Sequence[FreeRun]) -> NDArray[np.float64]:
    """Mean squared error of each output, over its variance."""
    y, simulated = (np.concatenate([getattr(r, name)[r.usable] for r in runs]) for name in ("output", "simulated"))
    return np.asarray(np.mean((y - simulated) ** 2, axis=0) / np.maximum(np.var(y, axis=0), np.finfo(np.float64).tiny))


def _error(runs: Sequence[FreeRun]) -> float:
    return float(np.mean(_errors(runs)))
