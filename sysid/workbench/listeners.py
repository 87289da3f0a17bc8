"""Who is told of a run: the screen, the log in its folder and the trackers; and what is said at its end.

A run of whatever kind begins here: :func:`perform`.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from sysid.workbench.runner.console import console
from sysid.workbench.runner.dry_run import PlannedStep
from sysid.workbench.runner.events import Warned, Watcher
from sysid.workbench.runner.program import Closing, Program, carry_out, foretell
from sysid.workbench.runner.screen import LogFile, Screen
from sysid.workbench.trackers import Found, find_trackers

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest


def typed_command(verb: str, pipeline: str, out: Path | None, options: Sequence[str] = ()) -> str:
    """The command that makes a run again.

    Args:
        verb: ``run``, ``sweep`` or ``auto``.
        pipeline: As it was typed.
        out: The run folder, where one was named.
        options: What else was typed.

    Returns:
        The command.

    Example:
        >>> typed_command("run", "tank", Path("my runs/a"))
        "sysid run tank --out 'my runs/a'"
    """
    return shlex.join(["sysid", verb, pipeline, *options, *(["--out", str(out)] if out else [])])


@dataclass(frozen=True, kw_only=True, eq=False)
class Listeners:
    """Who is told of a run.

    Args:
        target: Where the end of the run is shown.
        screen: Its steps and their progress.
        log: Writes the steps down in the run folder.
        tracked: The trackers; none where the run is not tracked.
    """

    target: Console
    screen: Screen
    log: LogFile
    tracked: Found

    @classmethod
    def of(cls, *, tracking: bool) -> Listeners:
        """Everybody who listens.

        Args:
            tracking: Whether the run is tracked.

        Returns:
            The listeners.
        """
        target = console()
        screen, log = Screen(target), LogFile()

        def warn(text: str) -> None:
            for watch in (screen, log):
                watch(Warned(text=text))

        tracked = find_trackers(Path.cwd(), warn) if tracking else Found()
        return cls(target=target, screen=screen, log=log, tracked=tracked)

    @property
    def watchers(self) -> list[Watcher]:
        """All of them."""
        return [self.screen, self.log, *self.tracked.trackers]

    def end(self, closing: Closing) -> int:
        """Say how it came out, and what lies where.

        Args:
            closing: What there is to say; files that do not exist are left out.

        Returns:
            Exit code: 0, or 1 if something could not be tracked.
        """
        self.target.print()
        for line in closing.lines:
            self.target.print(line, soft_wrap=isinstance(line, str))
        for name, path in closing.files.items():
            if path.exists():
                self.target.print(f"{name + ':':<9}{path}", soft_wrap=True)
        failed = [one.name for one in self.tracked.trackers if one.failures]
        if failed:
            self.target.print(
                f"Everything above is done and stored, but not all of it is tracked in {' and '.join(failed)}; "
                "run it again to retry."
            )
            return 1
        for said in self.tracked.missing:
            self.target.print(said, soft_wrap=True, markup=False)
        for one in self.tracked.trackers if closing.compare else ():
            if one.compare:
                self.target.print(f"{'Compare:':<9}{one.compare}")
        return 0


def perform(program: Program[Any], request: RunRequest) -> int:
    """Run a pipeline with everybody who listens.

    Args:
        program: What to do.
        request: What was asked.

    Returns:
        Exit code: 0, or 1 if everything is done and stored but something could not be tracked.

    Raises:
        SysidError: What a step raises.
    """
    folder = request.out or Path("runs") / program.name
    listeners = Listeners.of(tracking=request.tracking and program.tracked)
    command = typed_command(program.verb, request.typed, request.out, request.options)
    try:
        results = carry_out(program, folder, command=command, fresh=request.fresh, watchers=listeners.watchers)
    finally:
        listeners.screen.close()
    return listeners.end(program.closing(results, folder))


def foresee(program: Program[Any], request: RunRequest) -> tuple[PlannedStep, ...]:
    """What a run would do, and how long it would take; nothing is run or written.

    Args:
        program: What would be done.
        request: What was asked.

    Returns:
        The steps in order.

    Raises:
        UserError: If the pipeline, its data or its options cannot be used: what a run would say too.
    """
    folder = request.out or Path("runs") / program.name
    command = typed_command(program.verb, request.typed, request.out, request.options)
    return foretell(program, folder, command=command, fresh=request.fresh)
