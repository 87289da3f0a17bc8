"""How figures look: colours that survive colour blindness and grey printing, and SVG that is the same every time."""

from __future__ import annotations

import io
import re
from contextlib import AbstractContextManager
from typing import Any, Final

import matplotlib as mpl
from matplotlib.figure import Figure

# Okabe and Ito, Color Universal Design (2008), without the yellow, which is too faint on white. Neighbours
# differ in lightness too, and every series has a line style and a marker of its own.
PALETTE: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
DASHES: Final = ("-", (0, (6, 2)), (0, (1, 1.2)), (0, (6, 2, 1, 2)), (0, (3, 1.5)), (0, (8, 2, 1, 2, 1, 2)))
MARKERS: Final = ("o", "s", "^", "D", "v", "P")
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

# A reader's machine need not have the font that the layout was computed with.
_FONT_STACK = "'DejaVu Sans', Verdana, Geneva, sans-serif"


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
        return Figure(figsize=(width, height))


def svg(figure: Figure, *, title: str, description: str, name: str) -> str:
    """A figure as an inline SVG element, the same text every time it is made.

    Args:
        figure: The figure.
        title: Read aloud as the figure's name.
        description: Read aloud as what it shows.
        name: Unique within the page; letters, digits and dashes. Begins every id.

    Returns:
        The element, without XML declaration, with ``role="img"``, scaling to the width it is given.
    """
    buffer = io.StringIO()
    with styled():
        figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    # A rule for everything would reach beyond the figure; on its root it is inherited instead.
    text = re.sub(r"<style.*?</style>\s*", "", text, flags=re.DOTALL)
    # A hundredth of a point cannot be seen; six decimals double the size.
    text = re.sub(r'\bd="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path.group()), text)
    # Ids are unique in a figure only; in one page with others each figure needs its own.
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r"url\(#", f"url(#{name}-", text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    # In HTML an inline SVG needs no name spaces, and plain href is SVG 2.
    text = re.sub(r'\sxmlns(:xlink)?="[^"]*"', "", text).replace("xlink:href", "href")
    text = text.replace("'DejaVu Sans'", _FONT_STACK)
    text = re.sub(r"\n\s*", "\n", text)
    opening, rest = text.split(">", 1)
    box = re.search(r'viewBox="[^"]*"', opening)
    head = (
        f'<svg role="img" aria-labelledby="{name}-title {name}-desc" {box.group() if box else ""} '
        f'style="stroke-linejoin:round;stroke-linecap:butt"><title id="{name}-title">{_escape(title)}</title>'
        f'<desc id="{name}-desc">{_escape(description)}</desc>'
    )
    return head + rest.strip()


def _escape(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
