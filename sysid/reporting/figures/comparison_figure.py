"""The picture that people look for first: all models over the measured output, case by case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sysid.reporting.figures.style import TARGET, new_figure, series_style, styled
from sysid.reporting.figures.thinning import thin

COLUMNS = 450
"""How finely lines are drawn: up to four points in each of so many columns."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Overlay:
    """One case of one output.

    Args:
        case: Its name.
        output: Name of the output.
        unit: Its unit.
        time: Seconds, shape ``(n_samples,)``.
        target: Measured output, shape ``(n_samples,)``.
        runs: Free run by label of the model, shape ``(n_samples,)`` each; they may begin later than the target.
        fits: Fit in percent by label.
    """

    case: str
    output: str
    unit: str
    time: NDArray[np.float64]
    target: NDArray[np.float64]
    runs: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    fits: dict[str, float] = field(default_factory=dict)


def comparison_figure(
    panels: Sequence[Overlay], *, columns: int = COLUMNS, numbers: Sequence[int] | None = None
) -> Figure:
    """All models over the measured output.

    Args:
        panels: One for each output and case; none gives an empty figure.
        columns: How finely lines are drawn: up to four points in each of so many columns.
        numbers: Which number each model has, for its colour and for a page that hides some; their order by default.

    Returns:
        The figure, not known to pyplot; nothing outside it was touched.
    """
    with styled():
        across = 1 if len(panels) < 4 else 2
        rows = max(1, -(-len(panels) // across))
        figure = new_figure(7.6, 2.6 * rows if len(panels) > 1 else 3.6)
        grid = figure.subplots(rows, across, squeeze=False)
        for axes, panel in zip(grid.flat, panels, strict=False):
            _draw(axes, panel, columns, numbers or range(len(panel.runs)))
        for axes in list(grid.flat)[len(panels) :]:
            axes.set_visible(False)
        return figure


def _draw(axes: Axes, panel: Overlay, columns: int, numbers: Sequence[int]) -> None:
    axes.plot(*thin(panel.time, panel.target, columns), color=TARGET, linewidth=1.3, label="measured")
    for number, (label, run) in zip(numbers, panel.runs.items(), strict=True):
        style = {**series_style(number), "marker": ""}
        fit = panel.fits[label]
        text = label if np.isnan(fit) else f"{label}: {fit:.1f} %"
        finite = np.where(np.isfinite(run), run, np.nan)
        axes.plot(
            *thin(panel.time[-len(run) :], finite, columns), **style, linewidth=1.2, label=text, gid=f"model-{number}"
        )
    low, high = float(panel.target.min()), float(panel.target.max())
    span = max(high - low, 1e-6 * max(abs(low), abs(high)), 1e-12)
    # A free run that runs away must not squeeze the measurement into a line.
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, low - span), min(top, high + span))
    axes.set_title(f"{panel.output}, {panel.case}", loc="left")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"{panel.output} [{panel.unit}]")
    axes.legend(loc="best", fontsize=7.5)
