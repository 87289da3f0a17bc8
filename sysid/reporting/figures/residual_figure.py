"""The picture of what a model leaves: autocorrelation, and correlation with every input, between their bounds."""

from __future__ import annotations

from collections.abc import Mapping as Dict

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sysid.reporting.figures.style import PALETTE, TARGET, new_figure, styled
from sysid.reporting.residuals import CorrelationRecord, ResidualRecord


def residual_figure(groups: Dict[str, ResidualRecord]) -> Figure:
    """Correlations of the residuals, one row a group of cases, one column a correlation.

    Args:
        groups: Analyses by the name of their cases, such as ``estimation``; all of one model.

    Returns:
        The figure. What lies outside the grey bounds is a filled square, what lies within an open circle.
    """
    columns = 1 + len(next(iter(groups.values())).inputs)
    with styled():
        figure = new_figure(max(7.6, 1.3 * columns), 0.5 + 1.6 * len(groups))
        rows = figure.subplots(len(groups), columns, squeeze=False, sharex="col")
        for axes, (name, analysis) in zip(rows, groups.items(), strict=True):
            for place, correlation in zip(axes, (analysis.whiteness, *analysis.inputs), strict=True):
                _draw(place, correlation)
            axes[0].set_ylabel(name)
        rows[0, 0].set_title("with itself")
        for place, correlation in zip(rows[0, 1:], next(iter(groups.values())).inputs, strict=True):
            place.set_title(f"with {correlation.name}")
        for place in rows[-1]:
            place.set_xlabel("lag [samples]")
        return figure


def _draw(axes: Axes, correlation: CorrelationRecord) -> None:
    lags, values = np.asarray(correlation.lags), np.asarray(correlation.values)
    outside = np.abs(values) > correlation.bound
    axes.axhspan(-correlation.bound, correlation.bound, color="#DDDDDD", zorder=0)
    axes.axhline(0.0, color=TARGET, linewidth=0.6)
    axes.vlines(lags, 0.0, values, color="#888888", linewidth=0.8)
    axes.plot(lags[~outside], values[~outside], linestyle="none", marker="o", markersize=2.5, color=PALETTE[0], mfc="w")
    axes.plot(lags[outside], values[outside], linestyle="none", marker="s", markersize=2.5, color=PALETTE[1])
