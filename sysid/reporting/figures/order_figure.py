"""The picture that orders are chosen from: loss against the number of parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from sysid.estimation.linear.order_search import Criterion, OrderLosses
from sysid.reporting.figures.style import MARKERS, PALETTE, new_figure, styled
from sysid.units import squared

CRITERIA = (Criterion.BIC, Criterion.AICC, Criterion.AIC)
"""Whose choices are marked."""


@dataclass(frozen=True, kw_only=True)
class OrderCurve:
    """What is drawn of a search.

    Args:
        candidates: How many there were.
        sizes: Numbers of parameters, rising.
        lowest: The least mean squared one-step error of each size.
        highest: The greatest.
        choices: For each criterion its name, the structure that it chooses, that one's size and error.
    """

    candidates: int
    sizes: tuple[int, ...]
    lowest: tuple[float, ...]
    highest: tuple[float, ...]
    choices: tuple[tuple[str, str, int, float], ...]

    @classmethod
    def of(cls, losses: OrderLosses, criteria: Sequence[Criterion] = CRITERIA) -> OrderCurve:
        """The curve of a search.

        Args:
            losses: All candidates.
            criteria: Whose choices are marked.

        Returns:
            The curve.
        """
        p, mse = losses.n_parameters, losses.mse
        sizes = np.unique(p)
        order = np.argsort(p, kind="stable")
        starts = np.searchsorted(p[order], sizes)
        chosen = [(one, int(np.argmin(losses.score(one)))) for one in criteria]
        return cls(
            candidates=len(losses),
            sizes=tuple(sizes.tolist()),
            lowest=tuple(np.minimum.reduceat(mse[order], starts).tolist()),
            highest=tuple(np.maximum.reduceat(mse[order], starts).tolist()),
            choices=tuple((one.value, losses.orders(i).label, int(p[i]), float(mse[i])) for one, i in chosen),
        )


def order_figure(curve: OrderCurve, *, unit: str) -> Figure:
    """Loss against number of parameters: the range of all candidates, the best of each size, and the choices.

    Args:
        curve: What is drawn.
        unit: The output's unit.

    Returns:
        The figure; nothing outside it was touched.
    """
    with styled():
        figure = new_figure(7.6, 3.6)
        axes = figure.subplots()
        axes.set_title("One-step loss of every candidate")
        axes.fill_between(
            curve.sizes, curve.lowest, curve.highest, color="#DDDDDD", label=f"all {curve.candidates:,} candidates"
        )
        axes.plot(curve.sizes, curve.lowest, color=PALETTE[0], label="best of each size")
        for i, (criterion, label, size, mse) in enumerate(curve.choices):
            said = f"{criterion}: {label}"
            axes.plot([size], [mse], linestyle="none", marker=MARKERS[i], color=PALETTE[1 + i], label=said)
        if min(curve.lowest) > 0.0:
            axes.set_yscale("log")
        axes.set_xlabel("number of parameters")
        axes.set_ylabel(f"mean squared one-step error [{squared(unit)}]")
        axes.legend(loc="upper right")
        return figure


def states_figure(correlations: Sequence[float]) -> Figure:
    """Canonical correlations of past and future, as bars: those that stand out are states.

    Args:
        correlations: Descending, from 0 to 1.

    Returns:
        The figure; nothing outside it was touched.
    """
    with styled():
        figure = new_figure(7.6, 2.8)
        axes = figure.subplots()
        axes.set_title("States that the record shows")
        places = range(1, len(correlations) + 1)
        axes.bar(places, correlations, color=PALETTE[0])
        axes.set_xticks(places)
        axes.set_ylim(0.0, 1.0)
        axes.set_xlabel("state")
        axes.set_ylabel("canonical correlation")
        return figure
