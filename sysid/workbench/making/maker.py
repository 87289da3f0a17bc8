"""Makers: what plays a scene through and leaves a data set, found by name among the installed packages.

A maker is an object registered in the entry-point group ``sysid.makers``; its name there is the kind of its pipelines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from pydantic import BaseModel

from sysid.workbench.runner.kept_steps import KeptStep

GROUP = "sysid.makers"


class Maker(Protocol):
    """What a maker answers."""

    options: type[BaseModel]
    """Fields of ``options`` in its pipelines."""

    @property
    def version(self) -> str:
        """Digest of the code that its results depend on."""

    def steps(self, options: Any) -> Sequence[KeptStep]:
        """What is to be done; the steps do not depend on each other."""

    def dataset(self, options: Any, results: Mapping[str, Any]) -> dict[str, Any]:
        """The data set of all results, by name of their step: the fields of a ``dataset.yaml`` but for its name."""
