"""Equations as words: numbers, names and signs, line ends where a line is not over."""

from __future__ import annotations

import re
from dataclasses import dataclass

from sysid.equations.syntax import equation_error
from sysid.errors import ConfigError

MOST_TEXT = 20_000
"""Characters of all equations together."""
MOST_WORDS = 10_000
"""Numbers, names and signs of all equations together."""

_WORD = re.compile(
    r"""(?P<blank>[ \t\r\f]+|\#[^\n]*)
    |(?P<end>\n)
    |(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
    |(?P<name>[^\W\d]\w*)
    |"(?P<quoted>(?:[^"\n]|"")+)"
    |(?P<sign>\*\*|<=|>=|==|!=|[-+*/^(),;=<>\[\]])""",
    re.VERBOSE,
)
_OPEN = frozenset({"+", "-", "*", "/", "^", "**", ",", "(", "[", "=", "<", ">", "<=", ">=", "and", "or", "not"})
"""Words after which a line cannot be over."""


@dataclass(frozen=True, kw_only=True)
class Word:
    """A word.

    Args:
        kind: ``number``, ``name``, ``quoted`` (a name in double quotes, where two stand for one), ``sign`` or ``end``
            (of an equation).
        text: As it is written, a quoted name without its quotes.
        at: Where it begins, in characters.
    """

    kind: str
    text: str
    at: int

    @property
    def is_open(self) -> bool:
        """Whether a line cannot be over after it; a name in double quotes ends one like any other."""
        return self.kind != "quoted" and self.text in _OPEN


def words_of(text: str) -> list[Word]:
    """Cut equations into words.

    Args:
        text: All equations, one a line or divided by semicolons; ``#`` begins a remark.

    Returns:
        The words; the last is an end.

    Raises:
        ConfigError: If a sign is none of the language's, or there are too many.

    Example:
        >>> [word.text for word in words_of("y = 2*x  # twice")]
        ['y', '=', '2', '*', 'x', '']
    """
    if len(text) > MOST_TEXT:
        raise ConfigError(
            "the equations are too long",
            where="equations",
            expected=f"at most {MOST_TEXT:,} characters",
            got=f"{len(text):,}",
            remedy="shorten them",
        )
    words: list[Word] = []
    at = depth = 0
    while at < len(text):
        found = _WORD.match(text, at)
        if found is None:
            raise equation_error(
                f"{text[at]!r} is no sign of an equation",
                text,
                at,
                expected="names, numbers, + - * / ^ < <= > >= ( ) [ ] , ; =, and # before a remark",
                remedy='put a name that holds other signs in double quotes, as in "P 1"',
            )
        kind = str(found.lastgroup)
        said = found.group(kind)
        word = Word(kind=kind, text=said.replace('""', '"') if kind == "quoted" else said, at=at)
        at = found.end()
        if kind == "sign":
            depth += (word.text in "([") - (word.text in ")]")
        if kind == "end" or (kind == "sign" and word.text == ";" and depth <= 0):
            depth = max(depth, 0)
            if depth == 0 and words and words[-1].kind != "end" and not words[-1].is_open:
                words.append(Word(kind="end", text="", at=word.at))
        elif kind != "blank":
            words.append(word)
        if len(words) > MOST_WORDS:
            raise equation_error(
                "too many words", text, word.at, expected=f"at most {MOST_WORDS:,}", remedy="shorten the equations"
            )
    if not words or words[-1].kind != "end":
        words.append(Word(kind="end", text="", at=len(text)))
    return words
