"""Who is told of a run: the screen, the log in its folder and MLflow; and what is said at its end."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from sysid.workbench.runner.console import console
from sysid.workbench.runner.events import Event, Warned, Watcher
from sysid.workbench.runner.screen import LogFile, Screen
from sysid.workbench.tracking.listener import Tracker


def typed_command(verb: str, pipeline: str, out: Path | None) -> str:
    """The command that makes a run again.

    Args:
        verb: ``run`` or ``sweep``.
        pipeline: As it was typed.
        out: The run folder, where one was named.

    Returns:
        The command.

    Example:
        >>> typed_command("run", "tank", Path("my runs/a"))
        "sysid run tank --out 'my runs/a'"
    """
    return shlex.join(["sysid", verb, pipeline, *(["--out", str(out)] if out else [])])


@dataclass(frozen=True, kw_only=True, eq=False)
class Audience:
    """Who is told of a run.

    Args:
        target: Where the end of the run is shown.
        screen: Its steps and their progress.
        log: Writes the steps down in the run folder.
        tracker: MLflow; ``None`` where the run is not tracked.
    """

    target: Console
    screen: Screen
    log: LogFile
    tracker: Tracker | None

    @classmethod
    def of(cls, *, tracking: bool) -> Audience:
        """Everybody who listens.

        Args:
            tracking: Whether the run is tracked in MLflow.

        Returns:
            The audience.
        """
        target = console()
        screen, log = Screen(target), LogFile()

        def warn(text: str) -> None:
            for watch in (screen, log):
                watch(Warned(text=text))

        tracker = Tracker.of_workspace(Path.cwd(), warn) if tracking else None
        return cls(target=target, screen=screen, log=log, tracker=tracker)

    @property
    def watchers(self) -> list[Watcher]:
        """All of them."""
        return [self.screen, self.log, *([self.tracker] if self.tracker else [])]

    def tell(self, event: Event) -> None:
        """Tell everybody.

        Args:
            event: What has happened.
        """
        for watch in self.watchers:
            watch(event)

    def end(self, files: Mapping[str, Path]) -> int:
        """Say what lies where.

        Args:
            files: By what they are; those that do not exist are left out.

        Returns:
            Exit code: 0, or 1 if something could not be tracked.
        """
        for name, path in files.items():
            if path.exists():
                self.target.print(f"{name + ':':<9}{path}", soft_wrap=True)
        if self.tracker is not None and self.tracker.failures:
            self.target.print(
                "Everything above is done and stored, but not all of it is tracked in MLflow; run it again to retry."
            )
            return 1
        return 0
