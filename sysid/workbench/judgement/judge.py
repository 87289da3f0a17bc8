"""Judges: what says which consequence a model's error has, found by name among the installed packages.

A judge is an object registered in the entry-point group ``sysid.judges``; its name there is the kind of its pipelines.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from importlib.metadata import entry_points
from typing import Any, Protocol

from pydantic import BaseModel

from sysid.errors import ConfigError
from sysid.models import AbstractModel, Cascade
from sysid.workbench.kept_steps import Step

GROUP = "sysid.judges"

Subjects = Mapping[str, Sequence[tuple[AbstractModel | Cascade, Mapping[str, Any]]]]
"""Models and cascades by the name of what they are together, each with the options that its pipeline gives it."""


class Judge(Protocol):
    """What a judge answers."""

    options: type[BaseModel]
    """Fields of ``options`` in its pipelines."""
    part_options: type[BaseModel]
    """Fields of ``options`` of each model."""

    @property
    def version(self) -> str:
        """Digest of the code that its results depend on."""

    def steps(self, options: Any, subjects: Subjects) -> Sequence[Step]:
        """What is to be done; the steps do not depend on each other."""

    def document(self, options: Any, subjects: Subjects, results: Mapping[str, Any]) -> dict[str, Any]:
        """All results, by name of their step, as :class:`sysid.reporting.judgement.JudgementRecord` has them."""


def find_judge(name: str, *, where: object) -> Judge:
    """The judge of a name.

    Args:
        name: Kind of the pipeline.
        where: The file that asks for it, for errors.

    Returns:
        The judge.

    Raises:
        ConfigError: If none of that name is installed.
    """
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in found:
        near = difflib.get_close_matches(name, found, n=1)
        raise ConfigError(
            f"no judge named {name} is installed",
            where=where,
            expected=f"one of {', '.join(sorted(found))}" if found else "an installed judge; there is none at all",
            got=name,
            remedy=f"did you mean {near[0]}?" if near else "install the package that brings it",
        )
    judge: Judge = found[name].load()
    return judge
