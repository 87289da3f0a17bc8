"""The table of trackers: who keeps runs beside each other, beyond the run folder.

A tracker listens to the events of a run and takes from them what it wants. MLflow is one, in
:mod:`sysid.workbench.tracking`, which alone knows its words. Another is a folder of its own, in this package or in
anybody's, that is named in the entry points ``sysid.trackers``; whatever fails in it is told, and costs no run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from sysid.extras import has
from sysid.plugins import entry_points
from sysid.workbench.runner.events import Event, Watcher

GROUP = "sysid.trackers"
"""Of the entry points: functions of the workspace and of whom to tell, that give a :class:`Listener`."""

UNTRACKED = 'Not tracked in MLflow, which is not installed: pip install "sysid-workbench[mlflow]"'

Warn = Callable[[str], None]


class Listener(Protocol):
    """What another package brings: it is called with every event of a run, in order."""

    compare: str
    """What to type to see runs beside each other; empty for nothing."""

    def __call__(self, event: Event) -> None:
        """Take from an event what is kept; an error is told as a warning, and the run goes on."""


@dataclass(kw_only=True, eq=False)
class Tracker:
    """A tracker and what it could not keep.

    Args:
        name: What people call it.
        listener: Told of everything.
        compare: What to type to see runs beside each other; empty for nothing.
        warn: Told what could not be tracked.
        failures: What could not be, in words.
    """

    name: str
    listener: Watcher
    compare: str
    warn: Warn
    failures: list[str] = field(default_factory=list)

    def __call__(self, event: Event) -> None:
        """Tell it of an event; never raises."""
        try:
            self.listener(event)
        except Exception as error:  # noqa: BLE001 - it may fail in any way, and no fit may be lost by it
            text = f"{type(event).__name__}: {type(error).__name__}: {error}"
            self.failures.append(text)
            self.warn(f"not tracked in {self.name} ({text})")


@dataclass(frozen=True, kw_only=True)
class Found:
    """The trackers of a run.

    Args:
        trackers: All that are there.
        missing: Why one that everybody expects is not, in words.
    """

    trackers: tuple[Tracker, ...] = ()
    missing: tuple[str, ...] = ()


def find_trackers(workspace: Path, warn: Warn) -> Found:
    """All trackers of a workspace.

    Args:
        workspace: The folder that holds their stores.
        warn: Told what could not be tracked.

    Returns:
        The trackers; nothing is opened yet.
    """
    found, missing = list[Tracker](), list[str]()
    if has("mlflow"):
        found.append(_mlflow(workspace, warn))
    else:
        missing.append(UNTRACKED)
    for entry in entry_points(GROUP):
        try:
            listener: Listener = entry.load()(workspace, warn)
        except Exception as error:  # noqa: BLE001 - somebody else's code
            warn(f"the tracker {entry.name} cannot be used ({type(error).__name__}: {error})")
            continue
        found.append(Tracker(name=entry.name, listener=listener, compare=listener.compare, warn=warn))
    return Found(trackers=tuple(found), missing=tuple(missing))


def _mlflow(workspace: Path, warn: Warn) -> Tracker:
    from sysid.workbench.tracking.listener import Tracker as MLflow

    listener = MLflow.of_workspace(workspace, warn)
    # It words its own failures, and keeps them.
    return Tracker(name="MLflow", listener=listener, compare="sysid ui", warn=warn, failures=listener.failures)
