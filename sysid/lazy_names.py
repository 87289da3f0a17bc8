"""Public names of a room that are imported when they are first asked for: a command loads no more than it uses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def imported_when_asked(where: Mapping[str, tuple[str, ...]]) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package (PEP 562).

    Args:
        where: The names that the package has from each module, by the module's name. The same list stands under
            ``TYPE_CHECKING`` for who only reads; ``tests/test_lazy_names.py`` holds the two together.

    Returns:
        A function of a name, which imports what it stands for, or raises an ``AttributeError``.
    """
    home = {name: module for module, names in where.items() for name in names}

    def found(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"there is no public name {name!r} here; there are {', '.join(sorted(home))}")
        return getattr(import_module(home[name]), name)

    return found
