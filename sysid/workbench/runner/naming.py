"""Names for people turned into names for files, and files shown to people."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path


def slug(name: str) -> str:
    """A name as a folder: lower case, letters and digits, dashes between words.

    Args:
        name: For example ``"closed loop, 2 starts"``.

    Returns:
        For example ``"closed-loop-2-starts"``; ``"fit"`` where no letter or digit is left.

    Example:
        >>> slug("Closed loop (4/4/20)")
        'closed-loop-4-4-20'
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "-", plain.lower()).strip("-") or "fit"


def nearby(path: Path) -> Path:
    """A path as a person at the prompt would type it: relative where it lies in the current folder.

    Args:
        path: The path.

    Returns:
        The same place.

    Example:
        >>> nearby(Path.cwd() / "runs" / "tank").parts
        ('runs', 'tank')
    """
    here, whole = Path.cwd().resolve(), path.resolve()
    return whole.relative_to(here) if whole.is_relative_to(here) else path
