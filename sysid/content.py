"""Where data sets and pipelines lie: in the user's workspace, in the checkout, or in the wheel.

All three hold the same layout, ``<kind>/<name>/...``. The workspace comes first, so that a user's own
``abdx-service`` is used instead of the built-in one of that name.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import sysid


def content_folders(kind: str, *, workspace: Path | None = None) -> tuple[Path, ...]:
    """The folders that may hold content of a kind, in order of precedence.

    Args:
        kind: ``"datasets"`` or ``"pipelines"``.
        workspace: The user's workspace; ``None`` is the current folder.

    Returns:
        The folders that exist, each once: ``<workspace>/<kind>``, the checkout's, the wheel's.

    Example:
        >>> content_folders("no such kind")
        ()
    """
    package = Path(sysid.__file__).resolve().parent
    base = Path.cwd() if workspace is None else Path(workspace)
    candidates = [base / kind, package.parent / kind, package / "content" / kind]
    return unique_folders(candidates)


def unique_folders(candidates: Iterable[Path]) -> tuple[Path, ...]:
    """Those of the paths that are folders, each once, in order.

    Args:
        candidates: Paths, existing or not.

    Returns:
        Absolute paths.
    """
    found: dict[Path, None] = {}
    for candidate in candidates:
        if candidate.is_dir():
            found.setdefault(candidate.resolve())
    return tuple(found)
