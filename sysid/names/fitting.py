"""Names that have to fit somewhere: cut with a digest of the whole, and told apart where two would be one."""

from __future__ import annotations

import hashlib
import json
import re
import unicodedata
from collections.abc import Callable, Iterable


def shortened(text: str, length: int, joint: str = "-") -> str:
    """A text of at most some length; what is cut off is told apart by a digest of the whole.

    Args:
        text: The text.
        length: The most characters, from 12 on.
        joint: Between what is left and the digest.

    Returns:
        The text.

    Example:
        >>> shortened("a" * 100, 20)
        'aaaaaaaaaaa-28165978'
    """
    if len(text) <= length:
        return text
    return f"{text[: length - 9].rstrip(joint)}{joint}{digest(text)}"


def digest(text: str) -> str:
    """Eight hexadecimal letters that stand for a text."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:8]


def distinct(names: Iterable[str], fitted: Callable[[str], str], joint: str = "_") -> dict[str, str]:
    """Different names for different names, of which some may come out the same.

    Args:
        names: The names.
        fitted: Makes one fit.
        joint: Between a name and the number that tells it apart.

    Returns:
        What each became; the first of those that are alike keeps its own.

    Example:
        >>> from sysid.names import c_identifier
        >>> distinct(["a/b", "a b", "c"], c_identifier)
        {'a/b': 'a_b', 'a b': 'a_b_2', 'c': 'c'}
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        plain = unique = fitted(name)
        number = 2
        while unique in taken:
            unique, number = f"{plain}{joint}{number}", number + 1
        taken.add(unique)
        found[name] = unique
    return found


def ascii_of(name: str) -> str:
    """Letters without what stands above and below them; other alphabets are lost."""
    return unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()


def told_apart(fitted: str, names: Iterable[str]) -> str:
    """What some names became, with a digest behind it where one of them has lost more than its spaces and dots.

    Args:
        fitted: What they became.
        names: The names.

    Returns:
        The same, or a text that no other names have.

    Example:
        >>> told_apart("bp-ar", ["BP", "AR"]), told_apart("p", ["P+"])
        ('bp-ar', 'p-f23407cc')
    """
    given = list(names)
    plain = all(re.fullmatch(r"[A-Za-z0-9_. -]+", name) for name in given)
    return fitted if plain else f"{fitted}-{digest(json.dumps(given))}"
