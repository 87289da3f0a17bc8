"""Files shown to people."""

from __future__ import annotations

from pathlib import Path


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
