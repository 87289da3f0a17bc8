"""What other packages bring: objects found by name in a group of entry points."""

from __future__ import annotations

import difflib
from importlib.metadata import entry_points
from typing import Any

from sysid.errors import ConfigError


def find_plugin(group: str, name: str, *, what: str, where: object) -> Any:
    """Load what is registered under a name.

    Args:
        group: The group of entry points, such as ``sysid.judges``.
        name: The name asked for.
        what: One of them in words, for errors, such as ``judge``.
        where: Who asks for it, for errors.

    Returns:
        The object.

    Raises:
        ConfigError: If nothing of that name is installed.
    """
    found = {entry.name: entry for entry in entry_points(group=group)}
    if name not in found:
        near = difflib.get_close_matches(name, found, n=1)
        raise ConfigError(
            f"no {what} named {name} is installed",
            where=where,
            expected=f"one of {', '.join(sorted(found))}" if found else f"an installed {what}; there is none at all",
            got=name,
            remedy=f"did you mean {near[0]}?" if near else "install the package that brings it",
        )
    return found[name].load()
