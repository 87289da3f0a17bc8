"""The static curves of a block-oriented model, over what its records range over, and where these lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from sysid.models.curve_values import CurveValues
from sysid.reporting.figures.style import PALETTE, TARGET, new_figure, styled

POINTS, BINS = 400, 40
"""Points of a curve that are drawn, and bars that say where samples lie."""


def curves_figure(curves: Sequence[CurveValues]) -> Figure:
    """One panel a curve, with the number of samples in each part of its range below.

    Args:
        curves: At least one.

    Returns:
        The figure.
    """
    with styled():
        figure = new_figure(max(4.2, 3.8 * len(curves)), 3.6)
        rows = figure.subplots(2, len(curves), squeeze=False, sharex="col", height_ratios=[3, 1])
        for curve, panel, counts in zip(curves, rows[0], rows[1], strict=True):
            x, first = np.unique(curve.x, return_index=True)
            some = np.unique(np.linspace(0, len(x) - 1, min(POINTS, len(x))).astype(int))
            panel.plot(x[some], curve.y[first][some], color=PALETTE[0])
            panel.set_title(curve.title)
            panel.set_ylabel(curve.behind)
            counts.hist(curve.x, bins=BINS, color=TARGET)
            counts.set_xlabel(curve.before)
            counts.set_ylabel("samples")
        return figure
