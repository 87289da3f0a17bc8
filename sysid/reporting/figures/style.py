"""How figures look: colours that survive colour blindness and grey printing."""

from __future__ import annotations

import io
from contextlib import AbstractContextManager
from typing import Any, Final

import matplotlib as mpl
from matplotlib.figure import Figure

# Okabe and Ito, Color Universal Design (2008), without the yellow, which is too faint on white. Neighbours
# differ in lightness too, and every series has a line style and a marker of its own.
PALETTE: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
DASHES: Final = ("-", (0, (6, 2)), (0, (1, 1.2)), (0, (6, 2, 1, 2)), (0, (3, 1.5)), (0, (8, 2, 1, 2, 1, 2)))
MARKERS: Final = ("o", "s", "^", "D", "v", "P", "X")
# Seven markers on six colours: only the forty-third series looks like the first.
TARGET: Final = "#000000"
PUBLISHED: Final = "#555555"

# Any: the stubs of matplotlib name each of its keys as a literal.
_STYLE: Final[Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.3,
    "figure.facecolor": "white",
    "figure.constrained_layout.use": True,
    # Text stays text: it can be read aloud, searched and selected, and is a tenth of the size of outlines.
    "svg.fonttype": "none",
    "svg.hashsalt": "sysid",
}


def series_style(index: int) -> dict[str, Any]:
    """Colour, line style and marker of a series.

    Args:
        index: Number of the series, from 0 on.

    Returns:
        Keyword arguments of ``Axes.plot``.
    """
    return {
        "color": PALETTE[index % len(PALETTE)],
        "linestyle": DASHES[index % len(DASHES)],
        "marker": MARKERS[index % len(MARKERS)],
    }


def styled() -> AbstractContextManager[None]:
    """A context inside which figures are made, drawn on and saved in the style of the reports."""
    return mpl.rc_context(_STYLE)


class Drawing(Figure):
    """A figure that a notebook shows by itself: pyplot, which does that otherwise, is never imported here."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        with styled():
            self.savefig(buffer, format="png", dpi=110)
        return buffer.getvalue()


def new_figure(width: float, height: float, *, fixed: bool = False) -> Figure:
    """An empty figure; call it, and everything that draws on it, inside :func:`styled`.

    Args:
        width: Inches.
        height: Inches.
        fixed: Leave the margins to the caller instead of fitting them to the labels.

    Returns:
        The figure, not known to pyplot.
    """
    layout: Any = {"figure.constrained_layout.use": not fixed}
    with mpl.rc_context(layout):
        return Drawing(figsize=(width, height))
