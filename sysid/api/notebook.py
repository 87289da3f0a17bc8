"""Text as a notebook shows it."""

from __future__ import annotations

from html import escape


def html_of(text: object) -> str:
    """Text in its columns, its long lines broken where a page ends: on a phone nothing is cut off.

    Args:
        text: What is printed elsewhere.

    Returns:
        HTML.
    """
    return f'<pre style="white-space: pre-wrap">{escape(str(text))}</pre>'
