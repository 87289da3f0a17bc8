"""What a report is put together from: sections of tables, pictures and paragraphs."""

from __future__ import annotations

import re
from dataclasses import dataclass

from matplotlib.figure import Figure

from sysid.reporting.figures.svg import svg
from sysid.reporting.tables import Table


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A figure as markup.

    Args:
        svg: Inline SVG element.
        caption: Stands below it.
    """

    svg: str
    caption: str


Part = Table | Picture | str


@dataclass(frozen=True, kw_only=True)
class Section:
    """A heading and what stands under it.

    Args:
        anchor: Its id in the page.
        title: Its heading.
        parts: Tables, pictures and paragraphs, in order.
    """

    anchor: str
    title: str
    parts: tuple[Part, ...]


def picture(figure: Figure, title: str, caption: str, name: str) -> Picture:
    """A figure with its caption, which is also what is read aloud.

    Args:
        figure: The figure.
        title: Read aloud as its name.
        caption: Stands below it.
        name: Unique within the page.

    Returns:
        The picture.
    """
    return Picture(svg=svg(figure, title=title, description=caption, name=name), caption=caption)


def identifier(slug: str) -> str:
    """A fit's slug as part of an id in the page."""
    return re.sub(r"[^A-Za-z0-9-]", "-", slug)
