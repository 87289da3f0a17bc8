"""A surrogate whose structure is given: the fits of its pipeline of experiments, in place of a search."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any

from sysid.estimation.estimators import estimator_of
from sysid.field_checks import check
from sysid.models import Mapping, Start
from sysid.reporting.results import Results
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.fits.config import FitConfig, Pipeline, PipelineConfig
from sysid.workbench.fits.run import program_of as fits_program
from sysid.workbench.runner.program import Program
from sysid.yaml_files import yaml_text

NAME = "model"


def pipeline_of(
    config: ExperimentConfig, mapping: Mapping, *, where: Path, data: Path, rest: Dict[str, float],
    seconds: float | None, seed: int, export: Dict[str, Any], tolerance: float,
) -> PipelineConfig:  # fmt: skip
    """The fits of a pipeline of experiments as a pipeline of their own.

    Args:
        config: The pipeline of experiments, with fits.
        mapping: Inputs and parameters of the reference, and its outputs.
        where: The pipeline's file, for errors.
        data: The data set that the experiments make.
        rest: Outputs before the first sample, by name.
        seconds: Wall time of all fits together, where they say no time themselves; ``None`` for no limit.
        seed: Of everything random.
        export: Fields of the export.
        tolerance: Share of each output's range that the proof counts by; so does what chooses.

    Returns:
        The pipeline.

    Raises:
        ConfigError: If a structure is not for these inputs and outputs.
    """
    own = {} if seconds is None else {"max_time_s": round(seconds / len(config.fits), 3)}
    fits = [_told(one, {**own, "within": tolerance}) for one in config.fits]
    fields: dict[str, Any] = {
        "name": NAME, "data": str(data), "mapping": str(mapping), "start": Start(), "rest": dict(rest), "seed": seed,
        "fits": [one.model_dump(mode="json", exclude_none=True) for one in fits], "export": dict(export),
        "tolerance": tolerance,
    }  # fmt: skip
    return check(PipelineConfig, fields, where=where)


def program_of(pipeline: PipelineConfig, folder: Path) -> Program[Results]:
    """The fits as a program.

    Args:
        pipeline: As :func:`pipeline_of` gives it.
        folder: Where it is run.

    Returns:
        The program; the best on the selection runs is exported.
    """
    text = yaml_text(pipeline.model_dump(mode="json", exclude_defaults=True))
    return fits_program(Pipeline(config=pipeline, text=text, path=folder / "pipeline.yaml"))


def _told(fit: FitConfig, more: Dict[str, float]) -> FitConfig:
    """A fit with further options, where its training has such and was not told otherwise."""
    row = estimator_of(fit.structure)
    options = set() if row.training is None else {one.name for one in dataclasses.fields(row.training)}
    given = {} if fit.training is None else fit.training.model_dump(exclude_unset=True)
    told = {name: value for name, value in more.items() if name in options and name not in given}
    if not told:
        return fit
    own = {"name": fit.name, "structure": fit.structure.to_dict(), "initial": fit.initial}
    return FitConfig.model_validate({**own, "training": {**given, **told}})
