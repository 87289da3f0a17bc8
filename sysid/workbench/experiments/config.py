"""The YAML of a pipeline that asks a slow model for data."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from sysid.references.config import ReferenceConfig
from sysid.references.design import Design
from sysid.workbench.old_words import STRICT


class ExperimentConfig(BaseModel):
    """Experiments on a reference.

    Args:
        kind: ``experiment``.
        name: Name of the data set and of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        reference: The slow model. **It is code, and is run**: an FMU holds a compiled library, a program is a program.
        experiment: What is run.
        workers: Processes that run it.
    """

    model_config = STRICT

    kind: Literal["experiment"]
    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")
    description: str = ""
    reference: ReferenceConfig
    experiment: Design
    workers: int = Field(default=2, ge=1, le=256)
