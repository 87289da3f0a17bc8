"""What of a text can be shown: nothing that turns, hides or colours what follows."""

from __future__ import annotations

import unicodedata
from typing import Final

UNKNOWN: Final = "\N{REPLACEMENT CHARACTER}"
"""What stands for a character that cannot be shown."""

DIRECTION: Final = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\ufeff")
"""Characters that change the direction of what follows: a text could read other than it is."""


def visible(text: object, *, lines: bool = False) -> str:
    """Text that can be shown: no control characters, nothing that turns the direction, no half of a pair.

    Args:
        text: Any text.
        lines: Whether it may have several lines.

    Returns:
        The text, with a space for each break of a line and :data:`UNKNOWN` for what cannot be shown.

    Example:
        >>> visible("level" + chr(27) + "[31m" + chr(10) + "of the tank")
        'level�[31m of the tank'
    """
    written = str(text)
    if written.isascii() and written.isprintable():
        return written
    return "".join(_shown(character, lines) for character in written.replace("\r\n", "\n"))


def _shown(character: str, lines: bool) -> str:
    if character in "\t\n\r\v\f\x85\u2028\u2029":
        return character if lines and character == "\n" else " "
    hidden = unicodedata.category(character) in {"Cc", "Cs", "Cn"} or character in DIRECTION
    return UNKNOWN if hidden else character
