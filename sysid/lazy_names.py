"""Public names of a room that are imported when they are first asked for: a command loads no more than it uses."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def imported_when_asked(file: str) -> tuple[Callable[[str], Any], list[str]]:
    """The ``__getattr__`` (PEP 562) and the ``__all__`` of a package, which names what it has once.

    Args:
        file: Of the package, which imports its names under ``TYPE_CHECKING``, as type checkers see them.

    Returns:
        A function of a name, which imports what it stands for, or raises an ``AttributeError``; and all names.
    """
    body = ast.parse(Path(file).read_text(encoding="utf-8")).body
    lines = [line for block in body if isinstance(block, ast.If) for line in block.body]
    named = [line for line in lines if isinstance(line, ast.ImportFrom)]
    home = {alias.name: str(line.module) for line in named for alias in line.names}

    def found(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"there is no public name {name!r} here; there are {', '.join(sorted(home))}")
        return getattr(import_module(home[name]), name)

    return found, sorted(home)
