"""What other packages bring: objects found by name in a group of entry points."""

from __future__ import annotations

import importlib.metadata
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints
from typing import Any

from sysid.errors import ConfigError


@cache
def entry_points(group: str) -> EntryPoints:
    """What the installed packages register in a group.

    They are gone through once a process for each group: a run asks ten times.

    Args:
        group: The group, such as ``sysid.judges``.

    Returns:
        Its entries.
    """
    return importlib.metadata.entry_points(group=group)


def find_entry(group: str, name: str, *, what: str, where: object) -> EntryPoint:
    """What is registered under a name.

    Args:
        group: The group of entry points.
        name: The name asked for.
        what: One of them in words, for errors, such as ``judge``.
        where: Who asks for it, for errors.

    Returns:
        The entry, not loaded.

    Raises:
        ConfigError: If nothing of that name is installed; those that are known are listed.
    """
    found = {entry.name: entry for entry in entry_points(group)}
    if name not in found:
        raise ConfigError.unknown(
            f"no {what} named {name} is installed",
            name,
            sorted(found),
            "install the package that brings it; for what is built in, the workbench itself (pip install -e .)",
            where=where,
            none=f"an installed {what}; there is none at all",
        )
    return found[name]


def find_plugin(group: str, name: str, *, what: str, where: object) -> Any:
    """Load what is registered under a name.

    Args:
        group: As for :func:`find_entry`.
        name: Likewise.
        what: Likewise.
        where: Likewise.

    Returns:
        The object.

    Raises:
        ConfigError: As of :func:`find_entry`.
    """
    return find_entry(group, name, what=what, where=where).load()
