"""A pipeline as the runner takes it: its steps, what is known of them beforehand, and what is said at the end.

Every kind of pipeline turns its YAML into a :class:`Program`; lock, events, dry run and what lies in the run folder are
the same for all of them, and written here once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from sysid.workbench.runner.dry_run import DryRun, PlannedStep
from sysid.workbench.runner.events import RunDone, RunStarted, Watcher
from sysid.workbench.runner.run import Run
from sysid.workbench.runner.steps import NotKnownError, Outlined
from sysid.workbench.runner.store import RunFolder, write_json

R = TypeVar("R")


@dataclass(frozen=True, kw_only=True, eq=False)
class Closing:
    """What a person sees at the end of a run.

    Args:
        lines: Texts and tables.
        files: What lies where, by what it is.
        compare: Whether what is tracked is worth comparing.
    """

    lines: Sequence[Any] = ()
    files: Mapping[str, Path] = field(default_factory=dict)
    compare: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Program(Generic[R]):
    """A pipeline that can be run.

    Args:
        name: Of the pipeline and of its run folder.
        keep: Writes the pipeline, as it was read, into the run folder.
        steps: Does all steps, in order, and gives the results.
        outline: The steps that are known before any is done.
        closing: What is said of the results, and of what lies in the run folder.
        verb: The command that runs it, after ``sysid``.
        tracked: Whether it is tracked in MLflow.
    """

    name: str
    keep: Callable[[Path], None]
    steps: Callable[[Run], R]
    outline: Callable[[], Sequence[Outlined]]
    closing: Callable[[R, Path], Closing] = lambda _, __: Closing()
    verb: str = "run"
    tracked: bool = True


def carry_out(
    program: Program[R], folder: Path, *, command: str, fresh: bool = False, watchers: Sequence[Watcher] = ()
) -> R:
    """Run a pipeline; what an earlier run has finished is not done again, and what it has begun goes on.

    Args:
        program: What to do.
        folder: The run folder.
        command: The command that makes the run again.
        fresh: Do everything again.
        watchers: Told everything that happens, in order.

    Returns:
        The results.

    Raises:
        BusyError: If another run is at work in the folder.
        SysidError: What a step raises.
    """
    run = Run(store=RunFolder(path=folder.resolve()), command=command, fresh=fresh, watchers=tuple(watchers))
    with run.store.locked():
        program.keep(run.store.path)
        write_json(run.store.path / "environment.json", run.environment)
        run.tell(RunStarted(pipeline=program.name, folder=run.store.path, run_id=run.run_id, command=command))
        results = program.steps(run)
        if run.refused:
            raise run.refused[0]
        run.tell(RunDone(results=results))
        return results


def foretell(program: Program[Any], folder: Path, *, command: str = "", fresh: bool = False) -> tuple[PlannedStep, ...]:
    """What a run would do, and how long it would take; nothing is written.

    Args:
        program: What would be done.
        folder: The run folder.
        command: The command that makes the run again: what is kept under another one is written anew.
        fresh: Whether everything would be done again.

    Returns:
        The steps in order.

    Raises:
        UserError: If data or options cannot be used as they are: what a run would say too.
    """
    run = DryRun(store=RunFolder(path=folder.resolve()), command=command, fresh=fresh)
    if look(program, run):
        return tuple(run.planned.values())
    # As far as it can be known; what comes after stands in the outline.
    return run.with_outline(program.outline())


def look(program: Program[Any], run: DryRun) -> bool:
    """Go through the steps of a pipeline as far as their results are there.

    Args:
        program: The pipeline.
        run: Looks at each step.

    Returns:
        Whether all of them are.
    """
    try:
        program.steps(run)
    except NotKnownError:
        return False
    return True
