"""The templates of generated text: C, XML and Markdown."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

from sysid.names import c_comment, c_string, markdown_inline, read_sides, xml_attribute
from sysid.units import squared


@cache
def environment(*, markdown: bool = False) -> Any:
    """The jinja environment: what a template names and is not given is an error.

    Args:
        markdown: Whether every text that is filled in becomes one of Markdown.

    Returns:
        The environment.
    """
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.PackageLoader("sysid.export", "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - C; XML attributes and Markdown go through what is their own
        finalize=_markdown if markdown else None,
    )
    found.filters |= {
        "number": _number,
        "squared": squared,
        "real": c_real,
        "table": _table,
        "comment": c_comment,
        "attribute": xml_attribute,
        "c_string": c_string,
        "sides": read_sides,
    }
    return found


def render(template: str, **values: Any) -> str:
    """Fill in a template.

    Args:
        template: Its file name.
        values: What it names.

    Returns:
        The text; the same for the same values.
    """
    found = environment(markdown=template.endswith(".md.j2"))
    return str(found.get_template(template).render(**values))


def _markdown(value: Any) -> Any:
    return markdown_inline(value) if isinstance(value, str) else value


def c_real(value: float) -> str:
    """A number as a C literal that reads back as the very same double.

    Args:
        value: A finite number.

    Returns:
        The literal.

    Example:
        >>> c_real(2), c_real(1e-05), c_real(-0.1)
        ('2.0', '1e-05', '-0.1')
    """
    return repr(float(value))


def _table(values: Iterable[float], width: int = 110) -> str:
    """Numbers as lines of a C initialiser."""
    lines, line = [], ""
    for text in [f"R({c_real(value)})" for value in values]:
        if line and len(line) + len(text) > width:
            lines.append(line)
            line = ""
        line += f"{text}, "
    return "\n".join(f"        {one.rstrip()}" for one in [*lines, line]).rstrip(",")


def _number(value: float | None, digits: int = 4) -> str:
    return "not finite" if value is None else f"{value:.{digits}g}"
