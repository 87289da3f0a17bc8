"""Names in a mapping, as ``u+v -> y``: quoted where they hold its signs."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Final


def written_side(names: Sequence[str]) -> str:
    """Names of one side of a mapping as text; a name that would be misread stands in quotes.

    Args:
        names: The names.

    Returns:
        The names, joined by ``+``.

    Example:
        >>> written_side(["BP", "P+"])
        'BP+"P+"'
    """
    return "+".join(_written(name) for name in names)


def _written(name: str) -> str:
    plain = name and name == name.strip() and not name.startswith('"') and "+" not in name and "->" not in name
    return (
        name if plain and not name.endswith("-") and not name.startswith(">") else json.dumps(name, ensure_ascii=False)
    )


def output_side(text: str) -> str:
    """The outputs of a mapping that is text, for a title.

    Args:
        text: The mapping.

    Returns:
        Their names.

    Example:
        >>> output_side("BP+AR -> BC")
        'BC'
    """
    return ", ".join(read_sides(text)[-1])


_QUOTED: Final = re.compile(r'\s*("(?:[^"\\]|\\.)*")\s*(?=\+|->|,|$)', re.DOTALL)


def read_sides(text: str) -> list[list[str]]:
    """The sides of a mapping from text: what stands between arrows, each as its names.

    Args:
        text: Names joined by ``+``, sides joined by ``->``; a name may stand in quotes, as in JSON.

    Returns:
        The names of each side, of which some may be empty.

    Example:
        >>> read_sides('BP + "P+" -> BC')
        [['BP', 'P+'], ['BC']]
    """
    sides: list[list[str]] = [[]]
    at = 0
    while at <= len(text):
        quoted = _QUOTED.match(text, at)
        if quoted is not None and (name := _unquoted(quoted[1])) is not None:
            end = quoted.end()
        else:
            found = re.compile(r"\+|->").search(text, at)
            end = found.start() if found else len(text)
            name = text[at:end].strip()
        sides[-1].append(name)
        arrow = text.startswith("->", end)
        if arrow:
            sides.append([])
        at = end + (2 if arrow else 1)
    return [[] if side == [""] else side for side in sides]


def _unquoted(text: str) -> str | None:
    try:
        found = json.loads(text, strict=False)
    except ValueError:
        return None
    return found if isinstance(found, str) else None
