"""Names for people turned into names for files."""

from __future__ import annotations

import re
import unicodedata


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
