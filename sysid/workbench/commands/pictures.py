"""A picture beside what a command prints."""

from __future__ import annotations

from pathlib import Path

from sysid.atomic import write_bytes
from sysid.reporting.figures.svg import as_file
from sysid.workbench.runner.naming import nearby


def kept_picture(target: Path, drawing: str) -> str:
    """Write a drawing, and say where it is, or why it is nowhere.

    Args:
        target: The file.
        drawing: What :func:`sysid.reporting.figures.svg.svg` gives.

    Returns:
        The file, or words: what lies in a folder that is not ours to write in shall still be looked into.
    """
    try:
        write_bytes(target, as_file(drawing))
    except OSError as error:
        return f"none, as {target} cannot be written ({error.strerror})"
    return str(nearby(target))
