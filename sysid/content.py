"""Where data sets and pipelines lie: in the user's workspace, in the checkout, or in the wheel.

All three hold the same layout, ``<kind>/<name>/...``. The workspace comes first, so that a user's own
``abdx-service`` is used instead of the built-in one of that name.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import sysid
from sysid.errors import near_words


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


def what_to_do_with_data(name: str) -> str:
    """What somebody may want who names a data set where a pipeline is meant.

    Args:
        name: Of the data set.

    Returns:
        A remedy.
    """
    return (
        f'sysid auto {name} --mapping "u -> y" finds a model of it; or write a pipeline, pipelines/mine.yaml, with '
        f"data: {name}, a mapping and fits, and sysid run mine"
    )


def nearest_name(wanted: str, groups: Iterable[Iterable[str]]) -> str | None:
    """What was probably meant; a name of one's own goes before a built-in one that is nearer.

    Args:
        wanted: What was asked for.
        groups: Names, in the order of the folders that they stand in.

    Returns:
        A name; ``None`` if none is near.

    Example:
        >>> nearest_name("tanks", [["tank"], ["tanks-2"]])
        'tank'
    """
    found = (near_words(wanted, names) for names in groups)
    return next((near[0] for near in found if near), None)


def nearest_file(path: Path, suffixes: Iterable[str]) -> Path | None:
    """The file beside a path that was probably meant: of the kind that was asked for, by its name without the ending.

    Args:
        path: What was asked for, and is not there.
        suffixes: Endings of the kind, in lower case.

    Returns:
        The file; ``None`` if none is near.
    """
    kind = set(suffixes)
    there = sorted(path.parent.iterdir()) if path.parent.is_dir() else []
    stems = {file.stem: file for file in there if file.suffix.lower() in kind and file.is_file()}
    near = nearest_name(path.stem, [stems])
    return None if near is None else stems[near]
