"""What a person sees of a run: progress while it goes, a table when it is done; and the same in a log file."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    Task,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from sysid.names import visible
from sysid.workbench.runner.events import Event, RunStarted, StepDone, StepProgress, StepStarted, Warned

if TYPE_CHECKING:
    from sysid.workbench.runner.dry_run import PlannedStep


class Left(TimeRemainingColumn):
    """How long a step will take yet, where that is known: "left" alone was read of the time that it has taken."""

    def render(self, task: Task) -> Text:
        """The time, and what it is."""
        known = super().render(task)
        return Text.assemble(known, (" left", "dim")) if task.total and task.time_remaining is not None else Text("")


class Screen:
    """Shows a run: a bar for the step that is running, a line for each that is done.

    Without a terminal there is no bar, only the lines.

    Args:
        console: Where to write.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._progress: Progress | None = None
        self._task: TaskID | None = None

    def __call__(self, event: Event) -> None:
        """Show an event."""
        match event:
            case StepStarted():
                self._start(event.step)
            case StepProgress() if self._progress is not None and self._task is not None:
                share = None if event.fraction is None else 100.0 * event.fraction
                self._progress.update(self._task, completed=share, detail=visible(event.detail))
                if share is not None:
                    self._progress.update(self._task, total=100.0)
            case StepDone():
                self.close()
                mark = ("stored", "dim") if event.stored else ("done  ", "green")
                told = Text.assemble(mark, f"  {visible(event.step)}", (f"  {visible(event.detail)}", "dim"))
                self._console.print(told, soft_wrap=True)
            case Warned():
                told = Text.assemble(("warning", "yellow"), f" {visible(event.text, lines=True)}")
                self._console.print(told, soft_wrap=True)
            case _:
                pass

    def close(self) -> None:
        """Take the bar away."""
        if self._progress is not None:
            self._progress.stop()
        self._progress = self._task = None

    def _start(self, step: str) -> None:
        self.close()
        if not self._console.is_interactive:
            return
        self._progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=24),
            TimeElapsedColumn(),
            Left(),
            TextColumn("{task.fields[detail]}", style="dim", markup=False),
            console=self._console,
            transient=True,
        )
        self._task = self._progress.add_task(visible(step), total=None, detail="")
        self._progress.start()


SILENCE_S = 60.0
"""Seconds after which a log says again how a step goes: one of hours shows that it lives, a short one stays a line."""


class LogFile:
    """Writes a run's steps into ``log.txt``, with the time of day; how a long one goes, once a minute.

    Args:
        clock: Seconds, from any beginning.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._path: Path | None = None
        self._clock = clock
        self._began = self._said = clock()

    def __call__(self, event: Event) -> None:
        """Write an event down."""
        match event:
            case RunStarted():
                self._path = event.folder / "log.txt"
                self._write(f"run {event.run_id}: {event.command}")
            case StepStarted():
                self._began = self._said = self._clock()
                self._write(f"{event.step} ...")
            case StepProgress() if self._clock() - self._said >= SILENCE_S:
                self._said = self._clock()
                self._write(f"{event.step}: {_standing(event, self._said - self._began)}")
            case StepDone():
                self._write(f"{event.step}: {'stored' if event.stored else 'done'}. {event.detail}")
            case Warned():
                self._write(f"warning: {event.text}")
            case _:
                pass

    def _write(self, text: str) -> None:
        if self._path is not None:
            with self._path.open("a", encoding="utf-8") as log:
                log.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')}  {visible(text)}\n")


def _standing(event: StepProgress, elapsed_s: float) -> str:
    """How a step stands, and how long it has to go if it goes on like this."""
    if not event.fraction:
        return event.detail
    left = elapsed_s * (1.0 - event.fraction) / event.fraction
    return f"{100.0 * event.fraction:.0f} %, {duration(left)} left; {event.detail}"


def duration(seconds: float) -> str:
    """A time as one says it.

    Args:
        seconds: The time.

    Returns:
        For example ``"2 min 05 s"``.

    Example:
        >>> duration(125.0), duration(0.2), duration(3.4), duration(4000.0)
        ('2 min 05 s', 'under 1 s', '3 s', '1 h 07 min')
    """
    if seconds < 1.0:
        return "under 1 s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {round(whole % 3600 / 60):02d} min"


def table_of_steps(planned: Sequence[PlannedStep]) -> Table:
    """The steps that a run would take.

    Args:
        planned: The steps.

    Returns:
        The table.
    """
    table = Table(header_style="bold")
    table.add_column("step")
    table.add_column("time", justify="right")
    table.add_column("how that is known")
    for one in planned:
        seconds = "-" if one.stored else "?" if one.seconds is None else duration(one.seconds)
        table.add_row(one.step, seconds, one.basis)
    return table
