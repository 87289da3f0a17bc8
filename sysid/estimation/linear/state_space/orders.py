"""How many states does a record show? Canonical correlations of past and future, without a fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.estimation.least_squares.threads import one_blas_thread
from sysid.estimation.linear.state_space.fit import records_of
from sysid.estimation.linear.subspace.starts import Subspace
from sysid.estimation.records.given import Given, Records, given
from sysid.models import LinearStateSpace, Start, StartKind


@dataclass(frozen=True, kw_only=True, eq=False)
class StateOrders:
    """What the past of a record says of its future, direction by direction.

    Args:
        correlations: Canonical correlations, descending: those that stand out are states, the others noise.
        chosen: How many stand out, by Bauer's criterion: a correlation squared counts when it is above what a state's
            parameters cost.
        most: The largest number that was looked at.
    """

    correlations: NDArray[np.float64]
    chosen: int
    most: int

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader has to know: whether the choice stands at the end of what was looked at."""
        at_end = self.chosen == self.most
        return (f"The choice stands at the end of what was looked at ({self.most}): allow more.",) * at_end


def state_orders(
    traces: Records, mapping: Given, *, most: int = 10, feedthrough: bool = False, horizon: int | None = None
) -> StateOrders:
    """Canonical correlations of some records, and how many states they ask for.

    Args:
        traces: A data set, whose records for estimation are taken; a record, or several. Never concatenated.
        mapping: Which channels go in, which come out: ``"u -> y1+y2"``.
        most: States at most.
        feedthrough: Whether outputs depend on inputs of the same sample.
        horizon: Samples of past and of future; the order of a long ARX model by default.

    Returns:
        The correlations and the choice.

    Raises:
        ChannelError: If a trace lacks a channel of the mapping.
        TraceError: If no record is long enough.
    """
    traces, mapping = given(traces, mapping)
    structure = LinearStateSpace(states=most, feedthrough=feedthrough)
    _, segments, _ = records_of(
        traces, mapping, structure, start=Start(kind=StartKind.ESTIMATED), rests=(0.0,) * len(mapping.outputs)
    )
    with one_blas_thread():
        subspace = Subspace.of(segments, states=most, horizon=horizon, feedthrough=feedthrough, noise=True)
        return StateOrders(correlations=subspace.singular_values(), chosen=subspace.order(most), most=most)
