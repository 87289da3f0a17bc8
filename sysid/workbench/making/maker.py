"""Makers: what plays a scene through and leaves a data set, found by name among the installed packages.

A maker is an object registered in the entry-point group ``sysid.makers``; its name there is the kind of its pipelines.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from importlib.metadata import entry_points
from typing import Any, Protocol

from pydantic import BaseModel

from sysid.errors import ConfigError
from sysid.workbench.kept_steps import Step

GROUP = "sysid.makers"


class Maker(Protocol):
    """What a maker answers."""

    options: type[BaseModel]
    """Fields of ``options`` in its pipelines."""

    @property
    def version(self) -> str:
        """Digest of the code that its results depend on."""

    def steps(self, options: Any) -> Sequence[Step]:
        """What is to be done; the steps do not depend on each other."""

    def dataset(self, options: Any, results: Mapping[str, Any]) -> dict[str, Any]:
        """The data set of all results, by name of their step: the fields of a ``dataset.yaml`` but for its name."""


def find_maker(name: str, *, where: object) -> Maker:
    """The maker of a name.

    Args:
        name: Kind of the pipeline.
        where: The file that asks for it, for errors.

    Returns:
        The maker.

    Raises:
        ConfigError: If none of that name is installed.
    """
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in found:
        near = difflib.get_close_matches(name, found, n=1)
        raise ConfigError(
            f"no maker named {name} is installed",
            where=where,
            expected=f"one of {', '.join(sorted(found))}" if found else "an installed maker; there is none at all",
            got=name,
            remedy=f"did you mean {near[0]}?" if near else "install the package that brings it",
        )
    maker: Maker = found[name].load()
    return maker
