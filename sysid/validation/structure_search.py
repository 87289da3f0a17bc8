"""Structures beside ARX: state spaces, transfer functions, OE, ARMAX and BJ of rising order, each fitted and run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ConfigError, UserError
from sysid.estimation.fitting import fit
from sysid.estimation.linear.order_search import Criterion, OrderLosses, weighed
from sysid.estimation.records.experiment import Experiment
from sysid.estimation.results.result import FitResult
from sysid.models import ARMAX, BJ, OE, AbstractStructure, LinearStateSpace, Mapping, Start, TransferFunction
from sysid.models.contract import gaps
from sysid.traces import Trace
from sysid.validation.order_finalists import Finalist, finalist_of

ARX_KIND, VECTOR_KIND = "ARX", "VectorARX"
Dead = tuple[int, ...]

KINDS: dict[str, Callable[[int, Dead], AbstractStructure]] = {
    "SS": lambda n, nk: LinearStateSpace(states=n, feedthrough=0 in nk, nk=nk),
    "TF": lambda n, nk: TransferFunction(poles=(n,) * len(nk), zeros=(n - 1,) * len(nk), delays=nk),
    "OE": lambda n, nk: OE(nb=(n,) * len(nk), nf=(n,) * len(nk), nk=nk),
    "ARMAX": lambda n, nk: ARMAX(na=n, nb=(n,) * len(nk), nc=n, nk=nk),
    "BJ": lambda n, nk: BJ(nb=(n,) * len(nk), nc=n, nd=n, nf=(n,) * len(nk), nk=nk),
}
"""For each kind the structure of an order, given the dead time of each input."""
WITHOUT_INPUT = ("SS", "ARMAX")
"""Kinds that a time series can be."""
MOST = 4
"""The largest order that is tried by default."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """What became of the structures.

    Args:
        finalists: Those that were fitted, kind by kind and order by order.
        largest: Labels of those of the largest order.
        notes: Which could not be fitted, and why.
    """

    finalists: tuple[Finalist, ...]
    largest: frozenset[str]
    notes: tuple[str, ...]


def check_kinds(kinds: str | Sequence[str]) -> tuple[str, ...]:
    """The kinds as they are written here.

    Args:
        kinds: As they were asked for; a text has commas between.

    Returns:
        Each once, in the given order.

    Raises:
        ConfigError: If one is not known.
    """
    known = {name.lower(): name for name in (ARX_KIND, VECTOR_KIND, *KINDS)}
    kinds = [one.strip() for one in kinds.split(",")] if isinstance(kinds, str) else kinds
    for kind in kinds:
        if kind.lower() not in known:
            raise ConfigError(
                "no structure of this kind is searched",
                where="structures",
                expected=", ".join(known.values()),
                got=kind,
                remedy="write some of these",
            )
    return tuple(dict.fromkeys(known[kind.lower()] for kind in kinds))


def run_structures(
    kinds: Sequence[str],
    traces: Sequence[Trace],
    mapping: Mapping,
    cases: Sequence[Trace],
    *,
    dead_times: Dead,
    start: Start,
    most: int = MOST,
) -> Found:
    """Fit each kind with orders from 1 on, and run each model freely over every case.

    Args:
        kinds: Of :data:`KINDS`; ARX and VectorARX are searched elsewhere and left out here.
        traces: Estimation traces.
        mapping: Which channels go in, which comes out.
        cases: What chooses.
        dead_times: Of each input, in samples: those of the ARX model that was found.
        start: How each free run begins.
        most: The largest order.

    Returns:
        The fits.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
    """
    if isinstance(most, bool) or not isinstance(most, int) or most < 1:
        raise ConfigError(
            "not a largest order", where="most", expected="a whole number, 1 or more", got=most,
            remedy=f"leave it out for {MOST}",
        )  # fmt: skip
    asked = [kind for kind in kinds if kind in KINDS and (mapping.inputs or kind in WITHOUT_INPUT)]
    finalists, notes, largest = [], [], set()
    for kind in asked:
        for n in range(1, most + 1):
            structure = KINDS[kind](n, dead_times)
            try:
                # Who is chosen gets posterior and remarks.
                found = fit(traces, mapping, structure, start=start, stability=None, remarks=False)
            except UserError as error:  # too short a record for it, or no start that stays finite
                notes.append(f"{structure.label} was not fitted: {error.what}.")
                break
            finalists.append(finalist_of(found, cases, start, one_step_mse(found, traces, start)))
            if n == most:
                largest.add(structure.label)
    return Found(finalists=tuple(finalists), largest=frozenset(largest), notes=tuple(notes))


def one_step_mse(found: FitResult, traces: Sequence[Trace], start: Start) -> float:
    """Mean squared error one step ahead; of a model without noise that of its free run, which is the same there.

    Args:
        found: The fit.
        traces: Estimation traces.
        start: How each begins.

    Returns:
        In the output's unit squared.
    """
    model, total, counted = found.model, 0.0, 0
    predicts = model.recursion.predicts
    for trace in traces:
        e = Experiment.for_model(trace, model, start)
        run: NDArray[np.float64] = (
            gaps.predicted(model, e.inputs, e.output, e.history, e.usable)
            if predicts
            else model.simulate(e.inputs, e.history)
        )
        weights = np.ones(len(run)) if e.weights is None else e.weights
        total += float(np.sum(weights * np.where(weights > 0.0, run - e.output, 0.0) ** 2))
        counted += e.n_counted
    return total / max(counted, 1)


def score(finalist: Finalist, losses: OrderLosses, criterion: Criterion) -> float:
    """A criterion of one structure among others; smaller is better.

    Args:
        finalist: The structure.
        losses: Those of the search, whose samples and rounding are the same for all.
        criterion: Which.

    Returns:
        It.
    """
    mse = np.array([max(finalist.one_step_mse, losses.rounding)])
    return float(weighed(mse, np.array([finalist.fit.model.n_parameters]), losses.n_samples, criterion)[0])
