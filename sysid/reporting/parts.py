"""What a report is put together from: a verdict, and sections of tables, pictures and paragraphs."""

from __future__ import annotations

import re
from dataclasses import dataclass

from matplotlib.figure import Figure

from sysid.reporting.figures.svg import svg
from sysid.reporting.records import DataSetRecord, RunResults
from sysid.reporting.tables import Table, plain_table


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A figure as markup.

    Args:
        svg: Inline SVG element.
        caption: Stands below it.
    """

    svg: str
    caption: str


@dataclass(frozen=True, kw_only=True)
class Gallery:
    """Pictures of which a reader sees one at a time, and in it the models that are chosen; without any script.

    Args:
        name: Unique within the page; letters, digits and dashes.
        title: What is shown.
        models: Names of the models; the lines of the one at position ``n`` have the class ``model-n``.
        cases: What each picture is of.
        pictures: One a case.
    """

    name: str
    title: str
    models: tuple[str, ...]
    cases: tuple[str, ...]
    pictures: tuple[Picture, ...]


Part = Table | Picture | Gallery | str


@dataclass(frozen=True, kw_only=True)
class Section:
    """A heading and what stands under it.

    Args:
        anchor: Its id in the page.
        title: Its heading.
        parts: Tables, pictures, galleries and paragraphs, in order.
    """

    anchor: str
    title: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, kw_only=True)
class Tile:
    """One figure that stands out.

    Args:
        figure: With its unit.
        words: What it is.
    """

    figure: str
    words: str


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a reader with one minute should know.

    Args:
        headline: One sentence.
        tiles: The figures that stand out.
        points: Pairs of a keyword and a sentence.
        warnings: What makes the verdict weaker than it looks.
    """

    headline: str
    tiles: tuple[Tile, ...]
    points: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Document:
    """Everything that a page shows.

    Args:
        results: The results it was made from.
        verdict: Stands first.
        sections: The rest, in order.
    """

    results: RunResults
    verdict: Verdict
    sections: tuple[Section, ...]


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


def data_set_section(data: DataSetRecord) -> list[Section]:
    """The data sets that were read, with their digests.

    Args:
        data: What was read.

    Returns:
        A section; none where a judge brings its own scenes.
    """
    if not data.digest:
        return []
    digests = {data.name: data.digest, **data.others}
    table = plain_table("Data sets that were read.", [("data set", ""), ("SHA-256", "")], [*map(list, digests.items())])
    return [Section(anchor="data", title="Traces", parts=(table,))]
