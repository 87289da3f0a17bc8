"""The console on which the commands show what they found: text is text there, whatever a name holds."""

from __future__ import annotations

import codecs
import sys
from collections.abc import Iterable
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from sysid.names import visible

PIPED_WIDTH = 160
"""Columns where there is no terminal to ask: enough for a table of five cases on one line."""

PLAIN = {
    **{
        "→": "->",
        "←": "<-",
        "²": "^2",
        "³": "^3",
        "·": "*",
        "×": "x",
        "µ": "u",
        "μ": "u",
        "°": "deg",
        "±": "+-",
        "≤": "<=",
    },
    **{
        "≥": ">=",
        "√": "sqrt",
        "–": "-",
        "—": "-",
        "…": "...",
        "’": "'",
        "‘": "'",
        "“": '"',
        "”": '"',
        "✓": "*",
        "é": "e",
    },
}
"""What stands for a character where there is nothing but ASCII."""


class TextConsole(Console):
    """A console that takes every text for text: no markup unless it is asked for, no command of a terminal at all."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Segments of which no text holds a control character."""
        for segment in super().render(renderable, options):
            text, style, control = segment
            yield segment if control else Segment(visible(text, lines=True), style)


def console() -> Console:
    """Where results are shown.

    ``FORCE_COLOR``, which notebooks and services that build software set, asks for colours. It makes no terminal of a
    pipe: nothing moves there, and lines are as long as in any other file.

    Returns:
        A console on standard output.
    """
    watched = sys.stdout is not None and sys.stdout.isatty()
    fixed: dict[str, Any] = {"highlight": False, "markup": False, "emoji": False}
    return TextConsole(**fixed, force_interactive=None if watched else False, width=None if watched else PIPED_WIDTH)


def say(text: str) -> None:
    """Tell something on standard error.

    Args:
        text: Any text.
    """
    sys.stderr.write(visible(text, lines=True) + "\n")


def speak_plainly() -> None:
    """Write what the terminal's alphabet lacks in letters that it has: an error of encoding would end the command."""
    codecs.register_error("sysid.plain", _plain)
    for stream in (sys.stdout, sys.stderr):
        _lenient(stream)


def _lenient(stream: TextIO) -> None:
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure is not None and (stream.encoding or "").lower().replace("-", "") != "utf8":
        reconfigure(errors="sysid.plain")


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(PLAIN.get(character, "?") for character in error.object[error.start : error.end]), error.end
