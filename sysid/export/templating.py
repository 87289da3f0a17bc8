"""The templates of generated text: C, XML and Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from typing import Any
from xml.sax.saxutils import quoteattr


@cache
def environment() -> Any:
    """The jinja environment: what a template names and is not given is an error."""
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.PackageLoader("sysid.export", "templates"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - Markdown and C; XML attributes go through their own filter
    )
    found.filters |= {
        "number": _number,
        "real": c_real,
        "table": _table,
        "comment": _comment,
        "attribute": _attribute,
        "c_string": _c_string,
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
    return str(environment().get_template(template).render(**values))


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


def _comment(text: str) -> str:
    """Text that cannot end a C comment, nor begin one within it."""
    return re.sub(r"\s+", " ", str(text)).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")


def _attribute(text: object) -> str:
    """An XML attribute's value with its quotes."""
    return quoteattr(str(text))


def _c_string(text: str) -> str:
    """A C string literal of printable ASCII."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _number(value: float | None, digits: int = 4) -> str:
    return "not finite" if value is None else f"{value:.{digits}g}"
