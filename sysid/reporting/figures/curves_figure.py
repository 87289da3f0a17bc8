"""The static curves of a block-oriented model, over what its records range over, and where these lie."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from sysid.models.blocks.curve_values import CurvePoints
from sysid.reporting.figures.style import PALETTE, TARGET, new_figure, styled


def curves_figure(curves: Sequence[CurvePoints]) -> Figure:
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
            panel.plot(curve.x, curve.y, color=PALETTE[0])
            panel.set_title(curve.title)
            panel.set_ylabel(curve.behind)
            counts.stairs(curve.counts, curve.edges, fill=True, color=TARGET)
            counts.set_xlabel(curve.before)
            counts.set_ylabel("samples")
        return figure
