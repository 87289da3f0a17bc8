"""The YAML of a pipeline whose product is a data set."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field

from sysid.field_checks import FolderName
from sysid.workbench.old_words import STRICT


class MakingConfig(BaseModel):
    """A pipeline whose product is a data set.

    Args:
        kind: Name of the maker.
        name: Name of the data set and of the run folder; letters, digits, dots, dashes and underscores.
        description: What it is for.
        options: The maker's own.
    """

    model_config = STRICT

    kind: str
    name: FolderName
    description: str = ""
    options: dict[str, Any] = Field(default_factory=dict)
