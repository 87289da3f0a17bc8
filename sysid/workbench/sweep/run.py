"""A sweep as a program: what reads it, who does its jobs, what is said at its end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sysid.workbench.fits.table import table_of_fits, told_of_fits
from sysid.workbench.runner.program import Closing, Program
from sysid.workbench.sweep.config import SweepConfig
from sysid.workbench.sweep.sweep_steps import Hire, Sweep, SweepSteps, Swept
from sysid.workbench.sweep.table import table_of_trials
from sysid.workbench.sweep.trial import Bench
from sysid.workbench.sweep.workers import AbstractWorkers, LocalWorkers

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest


def hire(bench: Bench, config: SweepConfig) -> AbstractWorkers:
    """The workers that a sweep asks for.

    Args:
        bench: What they share.
        config: The sweep.

    Returns:
        Processes of this machine, or those of a cluster.

    Raises:
        ConfigError: If there is no such cluster.
    """
    if config.cluster is None:
        return LocalWorkers(bench, config.workers)
    from sysid.workbench.sweep.dask import DaskWorkers

    return DaskWorkers(bench, config.cluster)


def program(request: RunRequest) -> Program[Swept]:
    """What ``sysid sweep``, or ``sysid run``, does of a pipeline of kind ``sweep``.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        ConfigError: If the pipeline cannot be used.
    """
    sweep = Sweep.read(SweepConfig, request.path)
    if request.workers is not None:
        sweep = replace(sweep, config=sweep.config.model_copy(update={"workers": request.workers}))
    return program_of(sweep)


def program_of(sweep: Sweep, *, find_workers: Hire = hire) -> Program[Swept]:
    """A sweep as a program.

    Args:
        sweep: What to do.
        find_workers: Finds who does the jobs.

    Returns:
        The program.
    """
    work = SweepSteps(sweep=sweep, find_workers=find_workers)
    return Program(
        name=sweep.config.name,
        keep=sweep.keep,
        steps=work.run,
        outline=work.outline,
        closing=closing,
        verb="sweep",
    )


def closing(swept: Swept, folder: Path) -> Closing:
    """What is said at the end: the best trials, the fits by case, and the best.

    Args:
        swept: What came of the sweep.
        folder: The run folder.

    Returns:
        The lines and files.
    """
    return Closing(
        lines=[
            table_of_trials(swept.record),
            table_of_fits(swept.results),
            *told_of_fits(swept.results),
            f"Best: {swept.results.fits[0].label}. {swept.record.chosen_by}",
        ],
        files={
            "Report": folder / "report" / "index.html",
            "Bundle": folder / "bundle",
            "Trials": folder / "sweep.json",
            "Results": folder / "results.json",
        },
    )
