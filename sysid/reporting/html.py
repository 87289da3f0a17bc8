"""One self-contained page: inline styles and SVG, nothing fetched from anywhere."""

from __future__ import annotations

from datetime import datetime
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

import sysid
from sysid.names import visible
from sysid.reporting.parts import Document, Gallery, Picture
from sysid.reporting.tables import Table, facts


def render_html(document: Document) -> str:
    """The page.

    Args:
        document: What it shows.

    Returns:
        HTML 5 in one piece.
    """
    start = document.results.start
    return page_template("report.html.j2").render(
        document=document,
        results=document.results,
        verdict=document.verdict,
        environment=facts(document.results.environment),
        start={} if start is None else start,
        created=readable(document.results.created),
        version=sysid.__version__,
    )


def page_template(name: str) -> Template:
    """A template with the filters and tests that our pages use.

    Args:
        name: Its file.

    Returns:
        The template.
    """
    return _environment().get_template(name)


@cache
def _environment() -> Environment:
    """One for all pages of a process, which then translates each template once."""
    environment = Environment(
        loader=PackageLoader("sysid.reporting"),
        autoescape=select_autoescape(["j2"], default=True),
        undefined=StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["arrow"] = lambda text: str(text).replace("->", "→")
    environment.tests["gallery"] = lambda part: isinstance(part, Gallery)
    environment.tests["picture"] = lambda part: isinstance(part, Picture)
    environment.tests["table"] = lambda part: isinstance(part, Table)
    # Our own drawings; every text inside them was escaped where they were made.
    environment.filters["drawing"] = lambda part: Markup(part.svg)  # noqa: S704
    return environment


def _shown(value: Any) -> Any:
    """What is filled in: plain text without control characters; what is markup already stays."""
    return visible(value, lines=True) if type(value) is str else value


def readable(created: str) -> str:
    """A time stamp as people write it; as it stands where it is not ISO 8601.

    Args:
        created: ISO 8601.

    Returns:
        Text.

    Example:
        >>> readable("2026-11-21T02:59:04+0000")
        '21 November 2026, 02:59 UTC'
    """
    try:
        instant = datetime.fromisoformat(created)
    except ValueError:
        return created
    return f"{instant.day} {instant:%B %Y, %H:%M} {instant.tzname() or ''}".rstrip()
