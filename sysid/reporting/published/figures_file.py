"""How a file of published figures is read: what lies beside a published page, for programs."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import TypeAdapter, ValidationError

from sysid.bounded_text import read_json
from sysid.errors import ConfigError

T = TypeVar("T")


def read_figures(path: Path, kind: TypeAdapter[T], *, what: str, expected: str, remedy: str) -> T:
    """What a file of figures holds.

    Args:
        path: The file.
        kind: What it is to hold.
        what: What cannot be read, for the error.
        expected: What writes such a file.
        remedy: What to do.

    Returns:
        The figures.

    Raises:
        ConfigError: If there is no such file, or it is damaged.
    """
    try:
        return kind.validate_python(read_json(path))
    except (OSError, ValueError, RecursionError, ValidationError) as error:
        raise ConfigError(what, where=path, expected=expected, got=f"{error}".splitlines()[0], remedy=remedy) from error
