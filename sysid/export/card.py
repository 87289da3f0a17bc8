"""The model card: what a person must know before using a surrogate, after Mitchell et al. (2019)."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from typing import Any


def model_card(manifest: Dict[str, Any]) -> str:
    """The model card as Markdown.

    Args:
        manifest: Content of ``model.json``, with the exported files.

    Returns:
        The text; the same for the same manifest.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("sysid.export", "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - Markdown; escaping would put HTML entities into names and units
    )
    environment.filters["number"] = _number
    return environment.get_template("model_card.md.j2").render(**manifest)


def _number(value: float | None, digits: int = 4) -> str:
    return "not finite" if value is None else f"{value:.{digits}g}"
