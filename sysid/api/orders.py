"""Which orders? Every ARX structure of a grid by its one-step loss, and the best of each size in free run."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sysid.api.given import ESTIMATED, TracesLike, traces_of
from sysid.api.order_search import BY_SELECTION, OrderSearch, SystemOrderSearch
from sysid.api.vector_order_search import VectorOrderSearch
from sysid.errors import ConfigError, shortened
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear import order_search
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import Criterion, OrderLosses
from sysid.estimation.linear.state_space.orders import state_orders
from sysid.estimation.nonparametric.dead_time import longest_dead_time, shares
from sysid.estimation.nonparametric.feedback import feedback_of
from sysid.models import Mapping, Start, StartLike
from sysid.models.orders.lags import whole
from sysid.traces import Role, Trace, TraceSet
from sysid.validation.order_finalists import run_finalists, smallest_first
from sysid.validation.structure_search import ARX_KIND, MOST, VECTOR_KIND, check_kinds, run_structures, score
from sysid.validation.vector_orders import run_vector_structures, structures_of

LARGEST = 400_000
"""Candidates that a search without orders of its own tries at most: some seconds."""

LATE_SHARE, LATE_GAIN = 0.2, 1.2
"""Part of the output that a longer dead time than the usual ones must explain, and how much more than they do."""
BY_BIC = "sorted by BIC, for want of selection traces"
FINALISTS = 40
"""Candidates that are run freely."""


@one_blas_thread()
def search_orders(
    traces: TracesLike,
    mapping: str | Mapping | Dict[str, Any],
    *,
    max_na: int | None = None,
    max_nb: int | None = None,
    max_nk: int | None = None,
    start: StartLike = ESTIMATED,
    structures: str | Sequence[str] = (ARX_KIND,),
    most: int = MOST,
    selection: Sequence[Trace] | None = None,
    workers: int = 2,
) -> OrderSearch | SystemOrderSearch:
    """Search the orders of an ARX model: the exact loss of every candidate, and the free run of the best of each size.

    Other structures are fitted beside it where they are asked for, with orders from 1 on and the dead times of the ARX
    model that BIC chooses, and stand in one table with the best ARX models.

    Args:
        traces: The data set; its selection traces choose where there are some.
        mapping: Which channels go in, which come out; of several outputs each is searched by itself.
        max_na: Largest number of past outputs; by default as large as the record and the number of inputs allow, ten
            at most.
        max_nb: Largest number of past values of each input, likewise.
        max_nk: Largest dead time, likewise; longer where one plainly explains more of the output. The smallest is 0,
            and 1 where an input is set from the output of its own sample (closed loop).
        start: How each free run begins.
        structures: Kinds beside ARX: ``SS``, ``TF``, ``OE``, ``ARMAX``, ``BJ``; and of several outputs ``VectorARX``,
            one model whose outputs read each other's past.
        most: Largest order of those.
        selection: Traces that choose, in place of those of the data set.
        workers: Threads.

    Returns:
        The search: its best structure, its table, its picture. Of several outputs, that of each, ``found["y1"]``, and
        that of one model of all, ``found.together``, where it was asked for.

    Raises:
        ConfigError: If no trace is for estimation, or the grid has more candidates than memory.
        ChannelError: If a channel of the mapping is missing.
        TraceError: If the record is too short for the orders.

    Example:
        >>> import numpy as np, sysid
        >>> rng = np.random.default_rng(0)
        >>> u, y = rng.standard_normal(300), np.zeros(300)
        >>> for k in range(3, 300):
        ...     y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + u[k - 3] + 0.05 * rng.standard_normal()
        >>> sysid.search_orders(sysid.data((u, y), sample_time=1.0, split=0.6), "u -> y").best("BIC").label
        'ARX [2; 1; 3]'
    """
    traces, chosen, start = traces_of(traces, word="search_orders"), Mapping.of(mapping), Start.of(start)
    selection = traces.with_role(Role.SELECTION) if selection is None else tuple(selection)
    asked, kinds = {"max_na": max_na, "max_nb": max_nb, "max_nk": max_nk}, check_kinds(structures)
    found = {
        one.output: _of_output(traces, one, asked, start, kinds=kinds, most=most, selection=selection, workers=workers)
        for one in chosen.each
    }
    if VECTOR_KIND not in kinds:
        return SystemOrderSearch(outputs=found) if len(found) > 1 else next(iter(found.values()))
    together = _together(traces, chosen, asked, start, selection=selection, workers=workers)
    return SystemOrderSearch(outputs=found, together=together)


def _together(
    traces: TraceSet,
    chosen: Mapping,
    asked: Dict[str, int | None],
    start: Start,
    *,
    selection: tuple[Trace, ...],
    workers: int,
) -> VectorOrderSearch:
    """The search of one ARX model of all outputs: equations output by output, then the free runs of whole models."""
    if len(chosen.outputs) == 1:
        raise ConfigError(
            "VectorARX is a model of several outputs",
            where="structures",
            expected="a mapping as u -> y1+y2",
            got=str(chosen),
            remedy="name all outputs, or leave VectorARX out: of one output it is ARX",
        )
    losses, estimation = dict[str, OrderLosses](), traces.estimation
    for one in chosen.each:
        others = [name for name in chosen.outputs if name != one.output]
        wider = Mapping(inputs=(*one.inputs, *others), output=one.output)
        losses[one.output] = _searched(estimation, wider, asked, start, workers=workers, read=len(others))[1]
    found = run_vector_structures(
        structures_of(losses, len(chosen.inputs)), estimation, chosen, selection or estimation, start=start
    )
    search = VectorOrderSearch(
        losses=losses, finalists=found, chosen_by=BY_BIC, mapping=chosen, traces=traces, start=start
    )
    if selection:
        return replace(search, finalists=smallest_first(found), chosen_by=BY_SELECTION)
    return replace(search, finalists=tuple(sorted(found, key=lambda one: search.score(one, Criterion.BIC))))


def _of_output(
    traces: TraceSet,
    chosen: Mapping,
    asked: Dict[str, int | None],
    start: Start,
    *,
    kinds: Sequence[str],
    most: int,
    selection: tuple[Trace, ...],
    workers: int,
) -> OrderSearch:
    """The search of one output."""
    estimation = traces.estimation
    grid, losses = _searched(estimation, chosen, asked, start, workers=workers)
    found = run_finalists(
        losses, estimation, chosen, selection or estimation, count=FINALISTS, start=start, workers=workers
    ).ranked
    beside, others, states = [kind for kind in kinds if kind not in {ARX_KIND, VECTOR_KIND}], None, None
    if beside:
        others = run_structures(
            beside, estimation, chosen, selection or estimation, dead_times=losses.best().nk, start=start, most=most
        )
    if "SS" in beside:
        states = state_orders(estimation, chosen, most=most)
    if selection:
        found, said = smallest_first(found), BY_SELECTION
    else:
        found = tuple(sorted(found, key=lambda one: score(one, losses, Criterion.BIC)))
        said = BY_BIC
    return OrderSearch(
        losses=losses, finalists=found, chosen_by=said, grid=grid, mapping=chosen, traces=traces, start=start,
        others=others, states=states,
    )  # fmt: skip


def _searched(
    estimation: tuple[Trace, ...],
    mapping: Mapping,
    asked: Dict[str, int | None],
    start: Start,
    *,
    workers: int,
    read: int = 0,
) -> tuple[OrderGrid, OrderLosses]:
    """The losses over the orders that were asked for, and over longer dead times where one plainly explains more.

    The last inputs of the mapping may be other outputs that are read; of those there is no dead time.
    """
    for name, largest in asked.items():
        if largest is not None and not whole(largest):
            raise ConfigError(
                "not a largest order",
                where=name,
                expected="a whole number from 0 to 10,000",
                got=shortened(largest),
                remedy=f"write for example {name}=4",
            )
    max_na, max_nb, max_nk = asked.values()
    own = replace(mapping, inputs=mapping.inputs[: len(mapping.inputs) - read])
    feedback = feedback_of(estimation, own) if own.inputs and max_nk != 0 else ""
    first = int(not isinstance(feedback, str) and feedback.at_once)
    samples = sum(len(trace) for trace in estimation), max(len(trace) for trace in estimation)
    grid = _grid(samples, len(mapping.inputs), (max_na, max_nb, max_nk), first, read)
    losses = order_search.search_orders(estimation, mapping, grid, start=start, workers=workers)
    late = _as_late(grid, estimation, own) if max_nk is None else grid
    if late != grid:
        later = order_search.search_orders(estimation, mapping, late, start=start, workers=workers)
        if _least(later) < _least(losses):
            grid = replace(late, min_nk=grid.min_nk)
            losses = order_search.search_orders(estimation, mapping, grid, start=start, workers=workers)
    return grid, losses


def _grid(
    samples: tuple[int, int], inputs: int, asked: tuple[int | None, int | None, int | None], first: int, read: int = 0
) -> OrderGrid:
    """The orders that were asked for; those that were not, up to ten, as far as records and patience allow.

    Samples count all together, and those of the longest record: half of it is fitted with its past beside it.
    """
    grid = OrderGrid(max_na=1, max_nb=1, max_nk=first, min_nk=first, read=read)
    for largest in range(1, 11):
        na, nb, nk = (largest if one is None else one for one in asked)
        tried = OrderGrid(
            max_na=na, max_nb=nb, max_nk=nk, min_na=min(1, na), min_nb=min(1, nb), min_nk=first, read=read
        )
        parameters = na * (1 + read) + (inputs - read) * (nb + nk) + 1
        short = 4 * parameters > samples[0] or max(na, nb + nk) > samples[1] // 2
        if largest > 1 and (short or tried.size(inputs) > LARGEST):
            break
        grid = tried
    if grid.size(inputs) > 100 * LARGEST:
        raise ConfigError(
            "the grid has too many candidates",
            where="max_na, max_nb, max_nk",
            expected=f"at most {100 * LARGEST:,} structures",
            got=f"{grid.size(inputs):,} for {inputs} inputs",
            remedy="lower the orders, or search the inputs one by one",
        )
    return grid


def _as_late(grid: OrderGrid, traces: Sequence[Trace], mapping: Mapping) -> OrderGrid:
    """The grid at dead times that seem to explain the output plainly better than those in it; itself where none do.

    Of inputs that are all late it begins near the least of their dead times: where an output is slow, or its input
    periodic, a late correlation is none of a dead time, and all lags until there would take minutes to be told so.
    """
    most = longest_dead_time([len(trace) for trace in traces])
    usable = [trace.usable_of(mapping.channels) for trace in traces]
    targets = [
        np.where(ok, t[mapping.output] - t[mapping.output][ok].mean(), 0.0) if ok.any() else np.zeros(len(t))
        for t, ok in zip(traces, usable, strict=True)
    ]
    latest, lows = grid.max_nk, list[int]()
    for name in mapping.inputs:
        found = shares([trace[name] for trace in traces], targets, most, 1)
        peak, within = int(np.argmax(found)), float(found[: grid.max_nk + 1].max())
        late = bool(found[peak] > max(LATE_SHARE, LATE_GAIN * within))
        latest = max(latest, peak + 3) if late else latest
        lows.append(max(grid.min_nk, peak - grid.max_nk) if late else grid.min_nk)
    wider, n = replace(grid, min_nk=min(lows, default=grid.min_nk), max_nk=latest), len(mapping.inputs)
    parameters = grid.max_na * (1 + grid.read) + n * (grid.max_nb + latest) + 1
    fits = replace(wider, min_nk=grid.min_nk).size(n + grid.read) <= LARGEST and 4 * parameters <= sum(
        len(t) for t in traces
    )
    return wider if fits else grid


def _least(losses: OrderLosses) -> float:
    """The least BIC a sample: grids that begin late have fewer of these."""
    return float(losses.score(Criterion.BIC).min()) / max(losses.n_samples, 1)
