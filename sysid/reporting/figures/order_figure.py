"""The picture that orders are chosen from: loss against the number of parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from sysid.estimation.linear.order_search import Criterion, OrderLosses
from sysid.reporting.figures.style import MARKERS, PALETTE, new_figure, styled


def order_figure(
    losses: OrderLosses,
    *,
    unit: str,
    criteria: Sequence[Criterion] = (Criterion.BIC, Criterion.AICC, Criterion.AIC),
    title: str = "One-step loss of every candidate",
) -> Figure:
    """Loss against number of parameters: the range of all candidates, the best of each size, and the choices.

    Args:
        losses: All candidates of a search.
        unit: The output's unit.
        criteria: Whose choices are marked.
        title: Stands above.

    Returns:
        The figure; nothing outside it was touched.
    """
    p, mse = losses.n_parameters, losses.mse
    sizes = np.unique(p)
    order = np.argsort(p, kind="stable")
    starts = np.searchsorted(p[order], sizes)
    lowest, highest = np.minimum.reduceat(mse[order], starts), np.maximum.reduceat(mse[order], starts)
    with styled():
        figure = new_figure(7.6, 3.6)
        axes = figure.subplots()
        axes.set_title(title)
        axes.fill_between(sizes, lowest, highest, color="#DDDDDD", label=f"all {len(losses):,} candidates")
        axes.plot(sizes, lowest, color=PALETTE[0], label="best of each size")
        for i, criterion in enumerate(criteria):
            index = int(np.argmin(losses.score(criterion)))
            axes.plot(
                [p[index]],
                [mse[index]],
                linestyle="none",
                marker=MARKERS[i],
                color=PALETTE[1 + i],
                label=f"{criterion.value}: {losses.orders(index).label}",
            )
        if lowest.min() > 0.0:
            axes.set_yscale("log")
        axes.set_xlabel("number of parameters")
        axes.set_ylabel(f"mean squared one-step error [{unit}²]")
        axes.legend(loc="upper right")
        return figure
