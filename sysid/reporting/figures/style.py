"""How figures look: colours that survive colour blindness and grey printing."""

from __future__ import annotations

import io
import re
import warnings
from contextlib import AbstractContextManager
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text
from matplotlib.ticker import Formatter, LogFormatterSciNotation, NullFormatter, ScalarFormatter

from sysid.names import visible
from sysid.reporting.figures import palette
from sysid.reporting.numbers import superscript

PALETTE: Final = palette.PALETTE
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
    # Its words are read over what is drawn, and what is drawn is seen through it.
    "legend.framealpha": 0.75,
    "legend.edgecolor": "none",
    "legend.fancybox": False,
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


LEAST_SPAN = 1.1
"""Ratio of the ends of a logarithmic axis, at least: ticks of what hardly changes have the same digits."""


def logarithmic(axes: Axes, *, across: bool = False) -> None:
    """A logarithmic axis, where anything that is drawn has a logarithm: what never changes may have no error.

    Args:
        axes: With its lines.
        across: Whether it is the axis of ``x``.
    """
    drawn = [np.asarray(line.get_xdata() if across else line.get_ydata(), float) for line in axes.get_lines()]
    values = np.concatenate([*drawn, np.empty(0)])
    values = values[np.isfinite(values) & (values > 0.0)]
    if not len(values):
        return
    (axes.set_xscale if across else axes.set_yscale)("log")
    low, high = float(values.min()), float(values.max())
    if high < LEAST_SPAN * low:  # ticks would all have the same digits
        room = np.sqrt(LEAST_SPAN * low / high)
        (axes.set_xlim if across else axes.set_ylim)(low / room, high * room)


class Drawing(Figure):
    """A figure that a notebook shows by itself: pyplot, which does that otherwise, is never imported here.

    Its words are words: a name between dollar signs is no formula, and none turns the text around.
    """

    _is_saved = False

    def savefig(self, *words: Any, **more: Any) -> None:
        """Save it as matplotlib does, drawn once instead of twice."""
        self._is_saved = True
        try:
            super().savefig(*words, **more)
        finally:
            self._is_saved = False

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        with styled():
            self.savefig(buffer, format="png", dpi=110)
        return buffer.getvalue()

    def draw(self, renderer: Any) -> None:
        """Draw it, the labels as they are meant."""
        numbers = set[Text]()
        beside = self.get_size_inches()[0] / max(1, len({axes.get_position().x0 for axes in self.axes}))
        for axes in self.axes:
            titles = {axes.get_title(place) for place in ("left", "center", "right")} if beside < NARROW else set()
            for text in axes.get_children():
                if isinstance(text, Text) and text.get_text() in titles:
                    text.set_text(_fitting(text.get_text(), round(13 * beside)))
            legend = axes.get_legend()
            for text in legend.get_texts() if legend is not None and beside < NARROW else ():
                text.set_text(_fitting(text.get_text(), round(8 * beside)))
            for axis in (axes.xaxis, axes.yaxis):
                numbers |= _numbers_of(axis)
        for text in self.findobj(Text):
            if isinstance(text, Text) and text not in numbers:
                text.set_parse_math(False)
                text.set_text(_fitting(text.get_text(), UPRIGHT if text.get_rotation() else ACROSS))
        engine = self.get_layout_engine()
        with warnings.catch_warnings():
            # A letter that our font lacks stays text in the drawing, and the reader's machine may have it.
            warnings.filterwarnings("ignore", message="Glyph .* missing")
            if self._is_saved and isinstance(engine, ConstrainedLayoutEngine):
                # To save a figure matplotlib draws it first for its layout, into nothing, and then without an engine.
                engine.execute(self)
            else:
                super().draw(renderer)


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


ACROSS, UPRIGHT = 110, 60
"""Letters of a line across a figure, and along its side: longer ones would leave no room for what is drawn."""
NARROW = 3.0
"""Inches of a panel beside others, below which its title has to be as short as it is wide."""


def _fitting(text: str, length: int) -> str:
    lines = visible(text, lines=True).split("\n")
    return "\n".join(line if len(line) <= length else f"{line[: length - 1]}…" for line in lines)


_NUMBERS: Final = (ScalarFormatter, NullFormatter)


def _numbers_of(axis: Any) -> set[Text]:
    """Labels of ticks that may be formulae, after names and powers of ten have been given letters."""
    formatter = axis.get_major_formatter()
    if isinstance(formatter, LogFormatterSciNotation):
        axis.set_major_formatter(_Powers())
        if isinstance(axis.get_minor_formatter(), LogFormatterSciNotation):
            axis.set_minor_formatter(_Powers())
        return set()
    if not isinstance(formatter, _NUMBERS):
        if not isinstance(formatter, _Words):
            axis.set_major_formatter(_Words(formatter))
        return set()
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    return {label for tick in ticks for label in (tick.label1, tick.label2)}


class _Powers(LogFormatterSciNotation):
    r"""Powers of ten in letters, which can be read aloud and selected; a formula takes some ms to be set.

    Example:
        >>> _Powers()._words(r"$\mathdefault{2\times10^{-3}}$")
        '2×10⁻³'
        >>> _Powers()._words(r"$\mathdefault{4\times10^{0}}$")
        '4'
    """

    PLAIN = (1e-4, 1e5)
    """Axes within these have plain numbers, as the tables beside them do."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of a tick; none where there are many."""
        words = self._words(super().__call__(x, pos))
        least, greatest = sorted(self.axis.get_view_interval()) if self.axis is not None else (0.0, 0.0)
        return f"{x:.6g}" if words and self.PLAIN[0] <= least and greatest <= self.PLAIN[1] else words

    def _words(self, formula: str) -> str:
        plain = re.sub(r"\$\\mathdefault\{(.*)\}\$", r"\1", formula)
        plain = plain.removesuffix(r"\times10^{0}").replace(r"\times", "×")
        return re.sub(r"\^\{(-?\d+)\}", lambda found: superscript(int(found[1])), plain)


class _Words(Formatter):
    """Labels of ticks that are names."""

    def __init__(self, names: Formatter) -> None:
        self._names = names

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of a tick."""
        return _fitting(self._names(x, pos), UPRIGHT)

    def set_locs(self, locs: Any) -> None:
        """Told where the ticks are."""
        self._names.set_locs(locs)
