"""Words in the name of a record that say what it may be used for."""

from __future__ import annotations

import re

_ROLES = {
    "estimation": {"est", "estimation", "estim", "id", "ident", "idn", "identification", "train", "training", "trn"},
    "validation": {"val", "valid", "validation", "vali", "ver", "verification", "vrf", "vld", "check", "chk"},
    "test": {"test", "testing", "tst"},
    "selection": {"sel", "selection"},
}
WORDS = {word: role for role, words in _ROLES.items() for word in words}
PIECES = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^A-Za-z\d]+")


def role_of(name: str) -> str | None:
    """What a record may be used for, by a word in its name.

    Args:
        name: For example ``"id"``, ``"run_val"``, ``"TestData"``.

    Returns:
        The role, or ``None`` if no word says one.
    """
    return next((WORDS[piece] for piece in map(str.casefold, PIECES.findall(name)) if piece in WORDS), None)
