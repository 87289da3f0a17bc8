"""Charts of a few lines or marks, whatever they are about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from sysid.reporting.figures.style import MARKERS, PALETTE, TARGET, logarithmic, new_figure, series_style, styled
from sysid.reporting.parts import Picture, picture


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """One series of a chart.

    Args:
        name: In the legend.
        x: Shape ``(n_points,)``.
        y: Shape ``(n_points,)``.
        how: ``line``; ``target``, what the others are held against; ``marks`` without a line; ``points``, a line with a
            mark at each of its points.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    how: Literal["line", "target", "marks", "points"] = "line"


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """A chart.

    Args:
        title: Read aloud as its name.
        caption: Stands below it.
        x: What the x axis is, with its unit.
        y: What the y axis is, with its unit.
        lines: Its series.
        logarithmic: Axes that are, of ``xy``.
    """

    title: str
    caption: str
    x: str
    y: str
    lines: Sequence[Line] = field(default_factory=tuple)
    logarithmic: Literal["", "x", "xy"] = ""

    def picture(self, name: str) -> Picture:
        """The chart as a part of a page.

        Args:
            name: Unique within the page.

        Returns:
            The picture.
        """
        return picture(chart_figure(self), self.title, self.caption, name)


def chart_pictures(charts: Sequence[Chart], anchor: str) -> list[Picture]:
    """Charts as parts of a section.

    Args:
        charts: The charts.
        anchor: Of the section.

    Returns:
        The pictures, each with a name of its own in the page.
    """
    return [chart.picture(f"{anchor}-chart-{number}") for number, chart in enumerate(charts)]


SHORT = 20
"""Letters of a name of which three surely fit beside each other above a chart."""
BESIDE = 0.9
"""Part of a chart's width that its names may take: they begin at its axis."""


def chart_figure(chart: Chart) -> Figure:
    """Draw a chart; series differ in colour, dashes and marks, so that it is read in grey too."""
    with styled():
        figure = new_figure(7.6, 3.6)
        axes = figure.subplots()
        for index, line in enumerate(chart.lines):
            _draw(axes, line, index)
        if "x" in chart.logarithmic:
            logarithmic(axes, across=True)
        if "y" in chart.logarithmic:
            logarithmic(axes)
        axes.set_xlabel(chart.x)
        axes.set_ylabel(chart.y)
        if chart.lines:
            _name_all(figure, axes, max(len(line.name) for line in chart.lines))
        return figure


def _name_all(figure: Figure, axes: Axes, longest: int) -> None:
    """The names above a chart, in as many columns as it is wide enough for."""
    for columns in (3, 2, 1):
        legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2)
        if longest <= SHORT or legend.get_window_extent().width <= BESIDE * figure.bbox.width:
            return


def _draw(axes: Axes, line: Line, index: int) -> None:
    x, y = np.asarray(line.x, dtype=np.float64), np.asarray(line.y, dtype=np.float64)
    if line.how == "target":
        axes.plot(x, y, color=TARGET, linewidth=1.6, label=line.name)
    elif line.how == "marks":
        colour, mark = PALETTE[index % len(PALETTE)], MARKERS[index % len(MARKERS)]
        axes.plot(x, y, color=colour, marker=mark, linestyle="none", markersize=5, label=line.name)
    else:
        plain = {} if line.how == "points" else {"marker": ""}
        axes.plot(x, y, **(series_style(index) | plain), label=line.name)
