"""Experiments from Python: :func:`sysid.experiment`."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping as Dict
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from sysid.field_checks import check
from sysid.references.config import ReferenceConfig
from sysid.references.design import Design
from sysid.traces import TraceSet
from sysid.workbench.experiments.config import ExperimentConfig
from sysid.workbench.experiments.run import Experimented, program_of
from sysid.workbench.runner.program import carry_out
from sysid.workbench.written import Written
from sysid.yaml_files import yaml_text

COMMAND = "sysid.experiment(...)"


def experimented(
    reference: ReferenceConfig | Dict[str, Any], design: Design | Dict[str, Any], name: str, workers: int, folder: Path
) -> Experimented:
    """Run experiments in a folder; see :func:`experiment`."""
    fields = {
        "kind": "experiment",
        "name": name,
        "reference": reference.model_dump() if isinstance(reference, ReferenceConfig) else dict(reference),
        "experiment": design.model_dump() if isinstance(design, Design) else dict(design),
        "workers": workers,
    }
    config = check(ExperimentConfig, fields, where="sysid.experiment")
    text = yaml_text(config.model_dump(mode="json", exclude_defaults=True))
    pipeline = Written(config=config, text=text, path=Path.cwd() / f"{config.name}.yaml")
    return carry_out(program_of(pipeline), folder, command=COMMAND)


def experiment(
    reference: ReferenceConfig | Dict[str, Any],
    design: Design | Dict[str, Any],
    *,
    name: str = "experiment",
    workers: int = 2,
    folder: str | Path | None = None,
) -> TraceSet:
    """Run a slow model as designed. **A reference is code**: an FMU, a function or a program runs with your rights.

    Args:
        reference: The slow model: the fields of :class:`~sysid.references.config.ReferenceConfig`. Paths are relative
            to the current folder.
        design: What is run: the fields of :class:`~sysid.references.design.Design`.
        name: Of the data set.
        workers: Processes that run it.
        folder: Where the data set is kept; nowhere by default. Runs are found again in any case.

    Returns:
        The records, with roles for estimation, selection and test. Channels are inputs, parameters (constant in each
        record) and outputs.

    Raises:
        ConfigError: If the reference cannot be loaded, or no run of it gave a record.
    """
    place = nullcontext(folder) if folder is not None else tempfile.TemporaryDirectory()
    with place as where:
        return experimented(reference, design, name, workers, Path(where)).traces
