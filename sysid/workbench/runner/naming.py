"""Files and data sets as they are shown to people."""

from __future__ import annotations

from pathlib import Path

from sysid.traces import TraceSet


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


def meant(place: Path) -> Path:
    """What somebody means who names a run: its folder, or its name alone, as of a pipeline.

    Args:
        place: As it was typed.

    Returns:
        The folder under ``runs`` where there is one of that name and no such path.
    """
    named = Path("runs") / place
    return named if len(place.parts) == 1 and not place.exists() and named.exists() else place


def cases_of(traces: TraceSet) -> str:
    """How many cases of which data set.

    Args:
        traces: The data set.

    Returns:
        For example ``"3 cases of rig"``.
    """
    return f"{len(traces)} {'case' if len(traces) == 1 else 'cases'} of {traces.name}"
