"""A pipeline of kind ``fits`` as a program: what runs it, and what is said at its end."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sysid.reporting.results import Results
from sysid.workbench.fits.choice import Choice
from sysid.workbench.fits.config import Pipeline, PipelineConfig
from sysid.workbench.fits.fit_steps import FitSteps, GivenFit
from sysid.workbench.fits.table import table_of_fits, told_of_fits
from sysid.workbench.runner.program import Closing, Program

if TYPE_CHECKING:
    from sysid.workbench.kinds import RunRequest


def program(request: RunRequest) -> Program[Results]:
    """What ``sysid run`` does of a pipeline of kind ``fits``.

    Args:
        request: What was asked.

    Returns:
        The program.

    Raises:
        ConfigError: If the pipeline cannot be used.
    """
    return program_of(Pipeline.read(PipelineConfig, request.path))


def program_of(
    pipeline: Pipeline, *, given: Mapping[str, GivenFit] | None = None, chosen: Choice | None = None
) -> Program[Results]:
    """A pipeline as a program.

    Args:
        pipeline: What to do.
        given: Fits that are made already, by name.
        chosen: The fit that comes first, where it was chosen elsewhere; chosen here by default.

    Returns:
        The program.
    """
    work = FitSteps(pipeline=pipeline, given=given or {}, chosen=chosen)
    return Program(
        name=pipeline.config.name,
        keep=pipeline.keep,
        steps=work.run,
        outline=work.outline,
        closing=closing,
    )


def closing(results: Results, folder: Path) -> Closing:
    """What is said at the end: the fits by case, and the best.

    Args:
        results: The contents of ``results.json``.
        folder: The run folder.

    Returns:
        The lines and files.
    """
    lines: list[Any] = [table_of_fits(results), *told_of_fits(results)]
    if results.best is not None:
        lines.append(f"Best: {results.best_name}. {results.best.chosen_by}")
    files = {
        "Report": folder / "report" / "index.html",
        "Bundle": folder / "bundle",
        "Results": folder / "results.json",
    }
    return Closing(lines=lines, files=files, compare=True)
