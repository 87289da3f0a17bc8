"""One self-contained page: inline styles and SVG, nothing fetched from anywhere."""

from __future__ import annotations

from datetime import datetime

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

import sysid
from sysid.reporting.document import Document
from sysid.reporting.parts import Picture
from sysid.reporting.tables import Table, facts


def render_html(document: Document) -> str:
    """The page.

    Args:
        document: What it shows.

    Returns:
        HTML 5 in one piece.
    """
    environment = Environment(
        loader=PackageLoader("sysid.reporting"),
        autoescape=select_autoescape(["j2"], default=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["arrow"] = lambda text: str(text).replace("->", "→")
    environment.tests["picture"] = lambda part: isinstance(part, Picture)
    environment.tests["table"] = lambda part: isinstance(part, Table)
    # Our own drawings; every text inside them was escaped where they were made.
    environment.filters["drawing"] = lambda part: Markup(part.svg)  # noqa: S704
    start = document.results.start
    return environment.get_template("report.html.j2").render(
        document=document,
        results=document.results,
        verdict=document.verdict,
        environment=facts(document.results.environment),
        start={} if start is None else start,
        created=_readable(document.results.created),
        version=sysid.__version__,
    )


def _readable(created: str) -> str:
    """A time stamp as people write it; as it stands where it is not ISO 8601."""
    try:
        moment = datetime.fromisoformat(created)
    except ValueError:
        return created
    return f"{moment.day} {moment:%B %Y, %H:%M} {moment.tzname() or ''}".rstrip()
