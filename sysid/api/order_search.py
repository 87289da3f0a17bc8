"""What a search for orders found: every candidate with its loss, and a shortlist in free run."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, cast

from sysid.api.finalist_table import criterion_of, lines_of, table_of
from sysid.api.fits import Fit
from sysid.api.per_output import PerOutput, framed
from sysid.api.vector_order_search import VectorOrderSearch
from sysid.estimation import StabilityOptions, fitting
from sysid.estimation.linear.order_grid import OrderGrid
from sysid.estimation.linear.order_search import Criterion, OrderLosses
from sysid.estimation.linear.state_space.orders import StateOrders
from sysid.models import ARX, Mapping, Start
from sysid.traces import Role, TraceSet
from sysid.validation.metrics import percent
from sysid.validation.order_finalists import Finalist, alike_with, smallest_first
from sysid.validation.structure_search import Found, score

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from sysid.reporting.figures.order_figure import OrderCurve

BY_SELECTION = "sorted by the free run over the selection traces"
CLOSED_LOOP = "The output acts on an input within the sample (closed loop): dead times are searched from 1 on."


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
        return self.losses.best(criterion_of(criterion))

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
        found = fitting.fit(estimation, self.mapping, structure, start=self.start, stability=checked)
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
        return table_of(self.contenders, self.score)

    def score(self, finalist: Finalist, criterion: Criterion) -> float:
        """A criterion of a structure; smaller is better.

        Args:
            finalist: The structure, with its loss.
            criterion: Which criterion.

        Returns:
            Its value, without a unit.
        """
        return score(finalist, self.losses, criterion)

    @property
    def curve(self) -> OrderCurve:
        """What is drawn: all candidates by size."""
        from sysid.reporting.figures.order_figure import OrderCurve

        return OrderCurve.of(self.losses)

    def __len__(self) -> int:
        return len(self.losses)

    def plot(self) -> Figure:
        """Loss against number of parameters, with what each criterion chooses.

        Returns:
            A figure of matplotlib's.
        """
        from sysid.reporting.figures.order_figure import order_figure

        return order_figure(self.curve, unit=self.unit)

    @property
    def unit(self) -> str:
        """The output's unit."""
        return self.traces[self.traces.names[0]].channel(self.mapping.output).unit

    def __str__(self) -> str:
        lines = lines_of(self.contenders[: 10 if self.others is None else None], self.score)
        return "\n".join([f"{len(self.losses):,} structures; {self.chosen_by}", *lines, *self.notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SystemOrderSearch(PerOutput[OrderSearch]):
    """The searches of a record of several outputs, as an ARX model an output is fitted; see the base class.

    Args:
        outputs: The searches, by output.
        together: That of one model of all outputs, where it was asked for (``structures="VectorARX"``).
    """

    together: VectorOrderSearch | None = None

    def to_frame(self) -> pd.DataFrame:
        """The shortlists as a table, best first for each output.

        Returns:
            ``output``, and the columns of :meth:`OrderSearch.to_frame`; that of all outputs is named by all of them.
        """
        all_of = {} if self.together is None else {"+".join(self.outputs): self.together}
        return framed({**self.outputs, **all_of})

    def __str__(self) -> str:
        return "\n\n".join(map(str, [*self.outputs.values(), *([] if self.together is None else [self.together])]))

    __repr__ = __str__


def _orders(finalist: Finalist) -> ARX:
    """The structure; the search fits nothing but these."""
    return cast("ARX", finalist.fit.model.structure)
