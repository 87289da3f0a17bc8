"""Judges: what says which consequence a model's error has, found by name among the installed packages.

A judge is an object registered in the entry-point group ``sysid.judges``; its name there is the kind of its pipelines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from pydantic import BaseModel

from sysid.models import AbstractModel, Cascade, Interpolation
from sysid.workbench.runner.kept_steps import KeptStep

GROUP = "sysid.judges"

Given = tuple[AbstractModel | Cascade | Interpolation, Mapping[str, Any], Mapping[str, tuple[float, float]]]
"""A model, cascade or line, its options in the pipeline, and the range of each of its inputs in the traces that it was
fitted on, where that is known."""

Subjects = Mapping[str, Sequence[Given]]
"""What is judged, by the name of what the models are together."""


class Judge(Protocol):
    """What a judge answers."""

    options: type[BaseModel]
    """Fields of ``options`` in its pipelines."""
    part_options: type[BaseModel]
    """Fields of ``options`` of each model."""

    @property
    def version(self) -> str:
        """Digest of the code that its results depend on."""

    def steps(self, options: Any, subjects: Subjects) -> Sequence[KeptStep]:
        """What is to be done; the steps do not depend on each other."""

    def document(self, options: Any, subjects: Subjects, results: Mapping[str, Any]) -> dict[str, Any]:
        """All results, by name of their step, as :class:`sysid.reporting.judging.results.JudgementRecord` has them."""
