"""What a search for the orders of one ARX model of several outputs found."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from sysid.api.finalist_table import criterion_of, lines_of, table_of
from sysid.api.fits import Fit
from sysid.estimation import StabilityOptions, fitting
from sysid.estimation.linear.order_search import Criterion, OrderLosses
from sysid.models import ARX, Mapping, Start, VectorARX
from sysid.traces import Role, TraceSet
from sysid.validation.order_finalists import Finalist
from sysid.validation.vector_orders import joined

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from sysid.reporting.figures.order_figure import OrderCurve


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class VectorOrderSearch:
    """Of every output all its equations with their losses, and a shortlist of models of all outputs in free run.

    Args:
        losses: By output: its equations, which read the inputs and the past of all outputs.
        finalists: The shortlist, best first, as of :class:`~sysid.api.order_search.OrderSearch`.
        chosen_by: By what the shortlist is sorted, as a sentence.
        mapping: Inputs and outputs.
        traces: The data set.
        start: How each free run begins.
    """

    losses: Dict[str, OrderLosses]
    finalists: tuple[Finalist, ...]
    chosen_by: str
    mapping: Mapping
    traces: TraceSet
    start: Start

    unit = "1"
    """Its errors are means over the outputs, each over the output's variance."""
    others = None
    states = None

    def __len__(self) -> int:
        return sum(len(one) for one in self.losses.values())

    @property
    def contenders(self) -> tuple[Finalist, ...]:
        """The shortlist."""
        return self.finalists

    def best(self, criterion: str | None = None) -> VectorARX:
        """The structure to go on with.

        Args:
            criterion: ``AIC``, ``AICc``, ``BIC`` or ``loss``, of each equation; the first of the shortlist by default.

        Returns:
            The structure.

        Raises:
            ConfigError: If there is no such criterion.
        """
        if criterion is None:
            return cast("VectorARX", self.finalists[0].fit.model.structure)
        chosen = criterion_of(criterion)
        equations: list[ARX] = [one.best(chosen) for one in self.losses.values()]
        return joined(equations, len(self.mapping.inputs))

    @property
    def fit(self) -> Fit:
        """The fit of the first of all, with what every fit says of its records."""
        estimation = self.traces.with_role(Role.ESTIMATION)
        found = fitting.fit(estimation, self.mapping, self.best(), start=self.start, stability=StabilityOptions())
        return Fit.of(found, self.traces, self.start)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader has to know."""
        return ("Errors of an ARX model of all outputs are means over them, each over its output's variance.",)

    def score(self, finalist: Finalist, criterion: Criterion) -> float:
        """A criterion of a structure, summed over its equations; smaller is better.

        Args:
            finalist: The structure.
            criterion: Which criterion.

        Returns:
            Its value, without a unit.
        """
        orders = cast("VectorARX", finalist.fit.model.structure)
        total = 0.0
        for i, one in enumerate(self.losses.values()):
            counts, m = (*orders.nb[i], *(n for j, n in enumerate(orders.na[i]) if j != i)), len(self.mapping.inputs)
            here = (one.na == orders.na[i][i]) & (one.nb == np.array(counts)).all(axis=1)
            here &= (one.nk[:, :m] == np.array(orders.nk[i])).all(axis=1)
            total += float(one.score(criterion)[np.flatnonzero(here)[0]])
        return total

    @property
    def curve(self) -> OrderCurve:
        """What is drawn: the shortlist by size."""
        from sysid.reporting.figures.order_figure import CRITERIA, OrderCurve

        ranked = sorted(self.finalists, key=lambda one: (one.fit.model.n_parameters, one.one_step_mse))
        first = {one.fit.model.n_parameters: one for one in reversed(ranked)}
        last = {one.fit.model.n_parameters: one for one in ranked}
        chosen = [(c.value, min(ranked, key=lambda one: self.score(one, c))) for c in CRITERIA]
        sizes = sorted(first)
        return OrderCurve(
            candidates=len(self),
            sizes=tuple(sizes),
            lowest=tuple(first[size].one_step_mse for size in sizes),
            highest=tuple(last[size].one_step_mse for size in sizes),
            choices=tuple(
                (name, one.fit.model.structure.label, one.fit.model.n_parameters, one.one_step_mse)
                for name, one in chosen
            ),
        )

    def plot(self) -> Figure:
        """Loss against number of parameters, with what each criterion chooses.

        Returns:
            A figure of matplotlib's.
        """
        from sysid.reporting.figures.order_figure import order_figure

        return order_figure(self.curve, unit=self.unit)

    def to_frame(self) -> pd.DataFrame:
        """The shortlist as a table, best first; columns as of :meth:`sysid.api.order_search.OrderSearch.to_frame`.

        Returns:
            The table.
        """
        return table_of(self.contenders, self.score)

    def __str__(self) -> str:
        head = f"{len(self):,} equations of {self.mapping}; {self.chosen_by}"
        return "\n".join([head, *lines_of(self.contenders[:10], self.score), *self.notes])

    __repr__ = __str__
