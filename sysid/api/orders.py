"""Which orders? Every ARX structure of a grid by its one-step loss, and the best of each size in free run."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from sysid.api.fits import Fit
from sysid.api.given import ESTIMATED, TracesLike, traces_of
from sysid.api.per_output import PerOutput, framed
from sysid.errors import ConfigError, shortened
from sysid.estimation import StabilityOptions, estimators
from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear import order_search
from sysid.estimation.linear.order_search import Criterion, OrderGrid, OrderLosses
from sysid.estimation.linear.state_space.orders import StateOrders, state_orders
from sysid.estimation.nonparametric.dead_time import longest_dead_time, shares
from sysid.estimation.nonparametric.feedback import feedback_of
from sysid.extras import need
from sysid.models import ARX, Mapping, Start, StartLike
from sysid.models.orders.lags import whole
from sysid.reporting.numbers import pole
from sysid.traces import Role, Trace, TraceSet
from sysid.validation.metrics import percent
from sysid.validation.order_finalists import Finalist, alike_with, run_finalists, smallest_first
from sysid.validation.structure_search import ARX_KIND, MOST, Found, check_kinds, run_structures, score

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

LARGEST = 400_000
"""Candidates that a search without orders of its own tries at most: some seconds."""

BY_SELECTION = "sorted by the free run over the selection traces"
CLOSED_LOOP = "The output acts on an input within the sample (closed loop): dead times are searched from 1 on."
LATE_SHARE, LATE_GAIN = 0.2, 1.2
"""Part of the output that a longer dead time than the usual ones must explain, and how much more than they do."""
FINALISTS = 40
"""Candidates that are run freely."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class OrderSearch:
    """Every candidate with its loss, and a shortlist in free run.

    Args:
        losses: All candidates.
        finalists: The shortlist, best first: by the free run over the selection traces where there are some, the
            smallest of those that cannot be told from the best before all; by BIC otherwise.
        chosen_by: By what the shortlist is sorted, as a sentence.
        grid: What was searched.
        mapping: Inputs and output.
        traces: The data set.
        start: How each free run begins.
        others: What became of other structures, where some were asked for.
        states: Canonical correlations of past and future, where state spaces were.
    """

    losses: OrderLosses
    finalists: tuple[Finalist, ...]
    chosen_by: str
    grid: OrderGrid
    mapping: Mapping
    traces: TraceSet
    start: Start
    others: Found | None = None
    states: StateOrders | None = None

    def best(self, criterion: str | None = None) -> ARX:
        """The structure to go on with.

        Args:
            criterion: ``AIC``, ``AICc``, ``BIC`` or ``loss``; the first of the shortlist by default.

        Returns:
            The structure.

        Raises:
            ConfigError: If there is no such criterion.
        """
        if criterion is None:
            return _orders(self.finalists[0])
        known = {one.value.lower(): one for one in Criterion}
        if criterion.lower() not in known:
            raise ConfigError(
                "unknown criterion",
                where="criterion",
                expected=", ".join(one.value for one in Criterion),
                got=criterion,
                remedy="write one of these, or leave it out for the best free run",
            )
        return self.losses.best(known[criterion.lower()])

    @property
    def contenders(self) -> tuple[Finalist, ...]:
        """All structures in one table, best first: the best ARX models, and every other structure that was fitted."""
        if self.others is None:
            return self.finalists
        known = {one.fit.model.structure.label: one for one in self.finalists}
        by_bic = known.get(self.losses.best().label)
        arx = [self.finalists[0], *([by_bic] if by_bic is not None else [])]
        found = list({one.fit.model.structure.label: one for one in [*arx, *self.others.finalists]}.values())
        if self.selects:
            return smallest_first(sorted(found, key=lambda one: -one.mean_fit))
        return tuple(sorted(found, key=lambda one: self.score(one, Criterion.BIC)))

    @property
    def selects(self) -> bool:
        """Whether traces chose that nothing was fitted to."""
        return self.chosen_by == BY_SELECTION

    @property
    def fit(self) -> Fit:
        """The fit of the first of all, with what every fit says of its records."""
        structure = self.contenders[0].fit.model.structure
        # Those of the search were fitted by the dozen, and say nothing.
        checked = StabilityOptions() if isinstance(structure, ARX) else None
        estimation = self.traces.with_role(Role.ESTIMATION)
        found = estimators.fit(estimation, self.mapping, structure, start=self.start, stability=checked)
        return Fit.of(found, self.traces, self.start)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader has to know: where the best stands at the end of what was tried."""
        best, grid = _orders(self.finalists[0]), self.grid
        at_end = [
            f"{name} = {found}"
            for name, found, largest in (
                ("na", best.na, grid.max_na),
                ("nb", max(best.nb, default=0), grid.max_nb),
                ("nk", max(best.nk, default=0), grid.max_nk),
            )
            if found == largest > 0
        ]
        arx = "The best" if self.others is None else "The best ARX model"
        told = [CLOSED_LOOP] if grid.min_nk else []
        told += self._tie
        told += [f"{arx} stands at the end of what was tried ({', '.join(at_end)}): allow more."] if at_end else []
        if self.others is not None:
            first = self.contenders[0].fit.model.structure.label
            at_largest = first in self.others.largest
            told += [f"{first} has the largest order that was tried of its kind: allow more (most)."] * at_largest
            told += self.others.notes
        return tuple(told)

    @property
    def _tie(self) -> list[str]:
        """That the best free run is no better than smaller ones by more than chance, where that is so."""
        if not self.selects:
            return []
        first, best = self.contenders[0], max(self.contenders, key=lambda one: one.mean_fit)
        alike = alike_with(best, self.contenders)
        if best is first or first not in alike:
            return []
        labels = [one.fit.model.structure.label for one in (first, best)]
        return [
            f"{labels[0]} is put first: the smallest of {len(alike)} whose free runs differ by no more than one "
            f"standard error from the best, {labels[1]} ({percent(best.mean_fit)} %)."
        ]

    def to_frame(self) -> pd.DataFrame:
        """The shortlist as a table, best first.

        Returns:
            Columns ``structure``, ``parameters``, ``one_step_mse``, ``AIC``, ``AICc``, ``BIC``, ``fit`` (mean over the
            cases that chose, percent), ``largest_pole`` (magnitude) and ``stable``.
        """
        need("pandas", "a frame")
        import pandas as pd

        criteria = (Criterion.AIC, Criterion.AICC, Criterion.BIC)
        rows = [
            {
                "structure": one.fit.model.structure.label,
                "parameters": one.fit.model.n_parameters,
                "one_step_mse": one.one_step_mse,
                **{criterion.value: self.score(one, criterion) for criterion in criteria},
                "fit": one.mean_fit,
                "largest_pole": one.pole_radius,
                "stable": bool(np.isfinite(one.mean_fit)) and not one.pole_radius >= 1.0,
            }
            for one in self.contenders
        ]
        return pd.DataFrame(rows)

    def score(self, finalist: Finalist, criterion: Criterion) -> float:
        """A criterion of a structure; smaller is better.

        Args:
            finalist: The structure, with its loss.
            criterion: Which criterion.

        Returns:
            Its value, without a unit.
        """
        return score(finalist, self.losses, criterion)

    def plot(self) -> Figure:
        """Loss against number of parameters, with what each criterion chooses.

        Returns:
            A figure of matplotlib's.
        """
        from sysid.reporting.figures.order_figure import OrderCurve, order_figure

        return order_figure(OrderCurve.of(self.losses), unit=self.unit)

    @property
    def unit(self) -> str:
        """The output's unit."""
        return self.traces[self.traces.names[0]].channel(self.mapping.output).unit

    def __str__(self) -> str:
        head = f"{'structure':<24}{'parameters':>11}{'one-step mse':>14}{'BIC':>12}{'free run, fit %':>17}"
        head += f"{'largest pole':>14}"
        lines = [
            f"{one.fit.model.structure.label:<24}{one.fit.model.n_parameters:>11}{one.one_step_mse:>14.4g}"
            f"{self.score(one, Criterion.BIC):>12.1f}{percent(one.mean_fit):>17}"
            f"  {pole(one.pole_radius):>12}"
            for one in self.contenders[: 10 if self.others is None else None]
        ]
        return "\n".join([f"{len(self.losses):,} structures; {self.chosen_by}", head, *lines, *self.notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SystemOrderSearch(PerOutput[OrderSearch]):
    """The searches of a record of several outputs, as an ARX model an output is fitted; see the base class."""

    def to_frame(self) -> pd.DataFrame:
        """The shortlists as a table, best first for each output.

        Returns:
            ``output``, and the columns of :meth:`OrderSearch.to_frame`.
        """
        return framed(self.outputs)


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
        structures: Kinds beside ARX: ``SS``, ``TF``, ``OE``, ``ARMAX``, ``BJ``.
        most: Largest order of those.
        selection: Traces that choose, in place of those of the data set.
        workers: Threads.

    Returns:
        The search: its best structure, its table, its picture. Of several outputs, that of each, ``found["y1"]``.

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
    return SystemOrderSearch(outputs=found) if len(found) > 1 else next(iter(found.values()))


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
    grid, losses = _searched(estimation, chosen, asked, start, workers)
    found = run_finalists(
        losses, estimation, chosen, selection or estimation, count=FINALISTS, start=start, workers=workers
    ).ranked
    beside, others, states = [kind for kind in kinds if kind != ARX_KIND], None, None
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
        said = "sorted by BIC, for want of selection traces"
    return OrderSearch(
        losses=losses, finalists=found, chosen_by=said, grid=grid, mapping=chosen, traces=traces, start=start,
        others=others, states=states,
    )  # fmt: skip


def _searched(
    estimation: tuple[Trace, ...], mapping: Mapping, asked: Dict[str, int | None], start: Start, workers: int
) -> tuple[OrderGrid, OrderLosses]:
    """The losses over the orders that were asked for, and over longer dead times where one plainly explains more."""
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
    feedback = feedback_of(estimation, mapping) if mapping.inputs and max_nk != 0 else ""
    first = int(not isinstance(feedback, str) and feedback.at_once)
    samples = sum(len(trace) for trace in estimation), max(len(trace) for trace in estimation)
    grid = _grid(samples, len(mapping.inputs), (max_na, max_nb, max_nk), first)
    losses = order_search.search_orders(estimation, mapping, grid, start=start, workers=workers)
    late = _as_late(grid, estimation, mapping) if max_nk is None else grid
    if late != grid:
        later = order_search.search_orders(estimation, mapping, late, start=start, workers=workers)
        if _least(later) < _least(losses):
            grid = replace(late, min_nk=grid.min_nk)
            losses = order_search.search_orders(estimation, mapping, grid, start=start, workers=workers)
    return grid, losses


def _grid(
    samples: tuple[int, int], inputs: int, asked: tuple[int | None, int | None, int | None], first: int
) -> OrderGrid:
    """The orders that were asked for; those that were not, up to ten, as far as records and patience allow.

    Samples count all together, and those of the longest record: half of it is fitted with its past beside it.
    """
    grid = OrderGrid(max_na=1, max_nb=1, max_nk=first, min_nk=first)
    for largest in range(1, 11):
        na, nb, nk = (largest if one is None else one for one in asked)
        tried = OrderGrid(max_na=na, max_nb=nb, max_nk=nk, min_na=min(1, na), min_nb=min(1, nb), min_nk=first)
        parameters = na + inputs * (nb + nk) + 1
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
    parameters = grid.max_na + n * (grid.max_nb + latest) + 1
    fits = replace(wider, min_nk=grid.min_nk).size(n) <= LARGEST and 4 * parameters <= sum(len(t) for t in traces)
    return wider if fits else grid


def _least(losses: OrderLosses) -> float:
    """The least BIC a sample: grids that begin late have fewer of these."""
    return float(losses.score(Criterion.BIC).min()) / max(losses.n_samples, 1)


def _orders(finalist: Finalist) -> ARX:
    """The structure; the search fits nothing but these."""
    return cast("ARX", finalist.fit.model.structure)
